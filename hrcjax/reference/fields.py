"""The distance field of a cloud: lumped weights, distances of a union, and the bound for convex bodies.

The formulas are those of `hrcjax.field` for the squared-exponential kernel. Its default weights need no linear solve
(`solver="lumped"`), so there is none here either. Masked points are removed before.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

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


def _occupancy(field: Field, x: NDArray) -> tuple[NDArray, NDArray]:
    """Logarithm of the occupancy, and the vector from the weighted mean of the points to the query, by query [1], [m]."""
    if not len(field.points):
        return np.full(len(x), -np.inf), np.zeros_like(x)
    precision = 0.5 / field.length_scale**2
    r2 = cdist(x, field.points, "sqeuclidean")
    nearest = r2.min(axis=1)
    sums = np.exp(precision * (nearest[:, None] - r2)) @ field.columns
    return np.log(sums[:, 0]) - precision * nearest, x - sums[:, 1:] / sums[:, :1]


def _read(log_o: NDArray, offset: NDArray, length_scale: float) -> tuple[NDArray, NDArray]:
    """Distance [m] and gradient [1]: l sqrt(-2 ln o), bent to 0 near the surface."""
    v = -2.0 * log_o
    root = np.sqrt(np.maximum(v, ROOT_BLEND**2))
    slope = 0.5 / root
    near = v <= ROOT_BLEND**2
    if near.any():
        t = np.maximum(v, 0.0) / ROOT_BLEND**2
        root = np.where(near, ROOT_BLEND * t * (1.5 - 0.5 * t), root)
        slope = np.where(near, np.where(v > 0, (1.5 - t) / ROOT_BLEND, 0.0), slope)
    return length_scale * root, (2.0 * slope / length_scale)[:, None] * offset


def _nothing(x: NDArray) -> tuple[NDArray, NDArray]:
    """Distance and gradient of no points."""
    return np.full(len(x), FAR), np.zeros_like(x)


def union(static: Field, moving: Field, x: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Distance [m] and gradient [1] at every x, to both fields together and to the moving one alone.

    Args:
        static: of the scene.
        moving: of the moving points, with the same length scale.
        x: queries, (point 3) [m].
    """
    log_s, offset_s = _occupancy(static, x)
    log_m, offset_m = _occupancy(moving, x)
    d, g = _read(log_m, offset_m, moving.length_scale) if len(moving.points) else _nothing(x)
    if not len(static.points) and not len(moving.points):
        return d, g, d, g
    log_all = np.logaddexp(log_s, log_m)
    offset = np.exp(log_s - log_all)[:, None] * offset_s + np.exp(log_m - log_all)[:, None] * offset_m
    d_all, g_all = _read(log_all, offset, static.length_scale)
    return d_all, g_all, d, g


def lower_bound(d_hat: NDArray, radius: float, length_scale: float) -> NDArray:
    """The distances at which the field of a sphere reads d_hat, by Newton's method from above [m].

    Args:
        d_hat: distances read [m].
        radius: smallest radius of a body [m].
        length_scale: of the field [m].
    """
    two_l2 = 2.0 * length_scale**2
    d_hat = np.maximum(d_hat, 0.0)
    square, d = d_hat * d_hat, d_hat
    for _ in range(8):
        excess = d * d + two_l2 * np.log1p(d / radius) - square
        change = excess / (2.0 * d + two_l2 / (radius + d))
        d = np.maximum(d - change, 0.0)
        if np.abs(change).max() < 1e-14:
            break
    return d
