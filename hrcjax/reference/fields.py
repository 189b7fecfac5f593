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
SURFACES = 3
"""Surfaces of people that are read at a point."""
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
    groups: list[NDArray]
    """Places of neighbouring points, group by group."""


@dataclass(frozen=True)
class Scene:
    """The distance to all that stands."""

    spline: NdBSpline
    """Inside the box."""
    lower: NDArray
    """Corners of the box [m]."""
    upper: NDArray
    """[m]"""


def fit(points: NDArray, length_scale: float, noise: float, places: int | None = None) -> Field:
    """The field of surface points: alpha_i = 1 / (noise^2 + sum_j k_ij).

    Args:
        points: those that exist, (point 3) [m].
        length_scale: of the kernel [m].
        noise: standard deviation of the occupancy [1].
        places: capacity of the cloud that they are from, by which they are grouped; None: as many as there are.
    """
    r2 = cdist(points, points, "sqeuclidean")
    weights = 1.0 / (noise**2 + np.exp(-0.5 * r2 / length_scale**2).sum(axis=1))
    columns = weights[:, None] * np.column_stack([np.ones(len(points)), points])
    return Field(points, columns, length_scale, neighbours(points, len(points) if places is None else places))


def neighbours(points: NDArray, places: int, members: int = 16) -> list[NDArray]:
    """Places of the points in groups of at most `members`, along a Hilbert curve of 256 steps of 2 cm from -2.56 m on.

    A group ends before a gap, of the least kind for which the number of groups suffices.

    Args:
        points: those that exist, (point 3) [m].
        places: points for which there are groups.
        members: points of a group at most.
    """
    cells = np.clip((points + 2.56) / 0.02, 0, 255).astype(int)
    order = np.argsort([_along_curve(cell) for cell in cells.tolist()], kind="stable").astype(int)
    for gap in (0.15, 0.25, 0.5, np.inf):
        groups: list[list[int]] = []
        for before, i in zip([-1, *order.tolist()], order.tolist(), strict=False):
            apart = before < 0 or np.linalg.norm(points[i] - points[before]) > gap
            if apart or len(groups[-1]) == members:
                groups.append([])
            groups[-1].append(i)
        if len(groups) <= -(-places // members):
            break
    return [np.array(group) for group in groups]


def _along_curve(cell: list[int], bits: int = 8) -> int:
    """Place of a cell along the Hilbert curve (Skilling 2004)."""
    a = list(cell)
    for level in range(bits - 1, 0, -1):
        low = (1 << level) - 1
        for i in range(3):
            if a[i] >> level & 1:
                a[0] ^= low
            else:
                swap = (a[0] ^ a[i]) & low
                a[0], a[i] = a[0] ^ swap, a[i] ^ swap
    a[1] ^= a[0]
    a[2] ^= a[1]
    turn = 0
    for level in range(1, bits):
        if a[2] >> level & 1:
            turn ^= (1 << level) - 1
    digits = [f"{one ^ turn:0{bits}b}" for one in a]
    return int("".join(x + y + z for x, y, z in zip(*digits, strict=True)), 2)


def other_surfaces(
    field: Field, x: NDArray, away: NDArray, plane: float, count: int = 2
) -> list[tuple[float, NDArray]]:
    """The nearest points in directions over 60 degrees from those of all nearer ones, or in front of them: distance [m], vector to
    the query [m].

    A group of points counts by the place of its mean. Where there is none: FAR, and 0.

    Args:
        field: with points.
        x: one query [m].
        away: unit vector away from the nearest surface [1].
        plane: distance of x to that surface, if it has no points; else FAR [m].
        count: how many are wanted.
    """
    order = np.concatenate(field.groups)
    sizes = np.array([len(group) for group in field.groups])
    starts = np.append(0, np.cumsum(sizes)[:-1])
    offsets = x - field.points[order]
    reaches = np.sqrt((offsets * offsets).sum(axis=1))
    least = np.minimum.reduceat(reaches, starts)
    ways = np.add.reduceat(offsets, starts) / sizes[:, None]
    left, found = np.ones(len(sizes), bool), []

    def nearest_of(group: int) -> NDArray:
        part = slice(starts[group], starts[group] + sizes[group])
        return offsets[part][np.argmin(reaches[part])]

    k = int(np.argmin(least))
    left[k] = not (least[k] <= plane and nearest_of(k) @ away > 0.99 * least[k])
    plane = min(plane, float(least[k]))
    for _ in range(count):
        left &= _another(ways, away, plane)
        if not left.any():
            found.append((FAR, np.zeros(3)))
            continue
        k = int(np.argmin(np.where(left, least, np.inf)))
        found.append((float(least[k]), nearest_of(k)))
        left[k] = False
        away, plane = _unit(found[-1][1][None])[0], found[-1][0]
    return found


def _another(ways: NDArray, away: NDArray, plane: float) -> NDArray:
    """Which vectors differ from a unit vector by more than 60 degrees, or end in front of a cone about it: by 1 cm and a slope of 0.1."""
    along, square = ways @ away, (ways * ways).sum(axis=1)
    aside = np.sqrt(np.maximum(square - along * along, 0.0))
    return (along <= 0.5 * np.sqrt(square)) | (along < plane - 0.01 - 0.1 * aside)


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
) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray, NDArray]:
    """At every x: distance to everything and its gradient; lower bounds of the distances to three surfaces of people and unit
    gradients, (point surface) and (point surface 3), the nearest first; distance to what stands and its gradient.

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
        bound = scale * _root(2.0 * (least - log_p))[0] - _margin(spread, x - offset)
        away = _unit(offset)
    room = beyond - np.linalg.norm(x, axis=1)
    nearer = room < bound
    plane = np.where(nearer, room, FAR)
    bound = np.where(nearer, room, bound)
    away = np.where(nearer[:, None], -_unit(x), away)
    distances, directions = np.full((len(x), SURFACES), FAR), np.zeros((len(x), SURFACES, 3))
    distances[:, 0], directions[:, 0] = bound, away
    if len(people.points):
        for i in range(len(x)):
            for k, (reach, way) in enumerate(other_surfaces(people, x[i], away[i], plane[i], SURFACES - 1), start=1):
                if way.any():
                    distances[i, k] = reach - _margin(spread, (x[i] - way)[None])[0]
                    directions[i, k] = _unit(way[None])[0]
    return scale * root, (2.0 * slope / scale)[:, None] * pull, distances, directions, d, unit_where_long(g)


def _margin(spread: Spread, at: NDArray) -> NDArray:
    """How far a person reaches beyond points at these places [m]."""
    share = np.clip((np.linalg.norm(at, axis=1) - spread.coarse_from) / spread.over + 1.0, 0.0, 1.0)
    return spread.near * (1.0 - share) + spread.far * share + spread.noise


def unit_where_long(g: NDArray) -> NDArray:
    """Gradients from length 1/2 on as unit vectors; shorter ones as they are [1]."""
    size = np.sqrt((g * g).sum(axis=-1, keepdims=True))
    return np.where(size < 0.5, g, g / np.where(size < 0.5, 1.0, size))


def _unit(v: NDArray) -> NDArray:
    """Vectors of length 1; 0 where there is no direction [1]."""
    size = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(size > 0, size, 1.0)
