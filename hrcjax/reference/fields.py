"""The distance fields in NumPy and SciPy: the cloud's Gaussian process, the scene's spline, both together, the bound to people.

The formulas are those of `hrcjax.field` for the squared-exponential kernel. Its default weights need no linear solve
(`solver="lumped"`), so there is none here either. Masked points are removed before. The spline is SciPy's, through the
coefficients of the grid.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import NdBSpline
from scipy.spatial.distance import cdist

from hrcjax.field import GridField

FAR = 10.0
"""Distance of a field without points [m]."""
ROOT_BLEND = 0.2
"""Below this many length scales the distance bends to 0 [1]."""


@dataclass(frozen=True)
class Field:
    """A fitted field."""

    points: NDArray
    """Training points, (point 3) [m]."""
    columns: NDArray
    """Weights, and weights times points, (point 4) [1], [m]."""
    length_scale: float
    """Length scale of the kernel [m]."""


@dataclass(frozen=True)
class Scene:
    """The distance to all that stands."""

    spline: NdBSpline
    """Inside the box."""
    lower: NDArray
    """Corners of the box [m]."""
    upper: NDArray
    """[m]"""


def fit(points: NDArray, length_scale: float, noise: float) -> Field:
    """The field of surface points: alpha_i = 1 / (noise^2 + sum_j k_ij).

    Args:
        points: those that exist, (point 3) [m].
        length_scale: of the kernel [m].
        noise: standard deviation of the occupancy [1].
    """
    r2 = cdist(points, points, "sqeuclidean")
    weights = 1.0 / (noise**2 + np.exp(-0.5 * r2 / length_scale**2).sum(axis=1))
    return Field(points, weights[:, None] * np.column_stack([np.ones(len(points)), points]), length_scale)


def scene_of(grid: GridField) -> Scene:
    """The spline of a grid: coefficient k of an edge belongs to the B-spline about node k - 1."""
    layout = grid.layout
    knots = tuple(
        low + layout.spacing * np.arange(-3, nodes + 3) for low, nodes in zip(layout.lower, layout.shape, strict=True)
    )
    spline = NdBSpline(knots, np.asarray(grid.coefficients, np.float64), 3)
    return Scene(spline, np.array(layout.lower), np.array(layout.upper))


def scene_distance(scene: Scene, x: NDArray) -> tuple[NDArray, NDArray]:
    """Distance [m] and gradient [1] at every x; outside the box that at the nearest place in it, and the way there."""
    place = np.clip(x, scene.lower, scene.upper)
    way = x - place
    length = np.sqrt((way * way).sum(axis=1))
    slope = np.stack([scene.spline(place, nu=nu) for nu in ((1, 0, 0), (0, 1, 0), (0, 0, 1))], axis=1)
    out = way / np.where(length > 0, length, 1.0)[:, None]
    return scene.spline(place) + length, np.where(way == 0, slope, out)


def _occupancy(field: Field, x: NDArray) -> tuple[NDArray, NDArray]:
    """Logarithm of the occupancy, and the vector from the weighted mean of the points to the query, by query [1], [m]."""
    if not len(field.points):
        return np.full(len(x), -np.inf), np.zeros_like(x)
    precision = 0.5 / field.length_scale**2
    r2 = cdist(x, field.points, "sqeuclidean")
    nearest = r2.min(axis=1)
    sums = np.exp(precision * (nearest[:, None] - r2)) @ field.columns
    return np.log(sums[:, 0]) - precision * nearest, x - sums[:, 1:] / sums[:, :1]


def _root(v: NDArray) -> tuple[NDArray, NDArray]:
    """Square root of v, bent to 0 near 0, and its slope [1]."""
    root = np.sqrt(np.maximum(v, ROOT_BLEND**2))
    slope = 0.5 / root
    near = v <= ROOT_BLEND**2
    if near.any():
        t = np.maximum(v, 0.0) / ROOT_BLEND**2
        root = np.where(near, ROOT_BLEND * t * (1.5 - 0.5 * t), root)
        slope = np.where(near, np.where(v > 0, (1.5 - t) / ROOT_BLEND, 0.0), slope)
    return root, slope


@dataclass(frozen=True)
class Spread:
    """How far a person reaches beyond the points of the cloud [m]; as `hrcjax.field.FieldParams`."""

    near: float
    """About the points of single voxels [m]."""
    far: float
    """About those of coarse cubes [m]."""
    noise: float
    """Of the points themselves [m]."""
    coarse_from: float
    """Distance from the base at which points are surely coarse [m]."""
    over: float
    """Way over which the spread grows before it [m]."""


def read(
    scene: Scene, people: Field, beyond: float, spread: Spread, x: NDArray
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """At every x: distance to everything and its gradient, lower bound of the distance to people and its unit gradient.

    Args:
        scene: what stands.
        people: field of the moving points.
        beyond: who has no point in it is farther from the base than this [m].
        spread: what the bound is lowered by.
        x: queries, (point 3) [m].
    """
    scale = people.length_scale
    d, g = scene_distance(scene, x)
    log_p, offset = _occupancy(people, x)
    log_s = -0.5 * np.sign(d) * (d / scale) ** 2
    log_all = np.logaddexp(log_s, log_p)
    pull = np.exp(log_s - log_all)[:, None] * np.abs(d)[:, None] * g + np.exp(log_p - log_all)[:, None] * offset
    root, slope = _root(-2.0 * log_all)
    away, bound = np.zeros_like(x), np.full(len(x), FAR)
    if len(people.points):
        least = np.log(people.columns[:, 0].min())
        mean = np.linalg.norm(x - offset, axis=1)
        share = np.clip((mean - spread.coarse_from) / spread.over + 1.0, 0.0, 1.0)
        margin = spread.near * (1.0 - share) + spread.far * share + spread.noise
        bound = scale * _root(2.0 * (least - log_p))[0] - margin
        away = _unit(offset)
    room = beyond - np.linalg.norm(x, axis=1)
    nearer = room < bound
    bound = np.where(nearer, room, bound)
    away = np.where(nearer[:, None], -_unit(x), away)
    return scale * root, (2.0 * slope / scale)[:, None] * pull, bound, away


def _unit(v: NDArray) -> NDArray:
    """Vectors of length 1; 0 where there is no direction [1]."""
    size = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(size > 0, size, 1.0)
