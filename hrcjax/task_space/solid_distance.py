"""Signed distances to one solid on the host, many points at once."""

import numpy as np
from jaxtyping import Float

from hrcjax.world.scene import BOX, SPHERE

POINTS = -1
"""Kind of a thing that no shape explains: kept as points, solid as its upright box."""
Solid = tuple[int, np.ndarray, np.ndarray, float]
"""Kind, centre [m], half extents [m] and turn about the vertical [rad]."""
GRID = 25
"""Places along every axis at which `common_depth` looks."""


def solid_distances(
    kind: int, center: np.ndarray, size: np.ndarray, yaw: float, place: Float[np.ndarray, "point 3"]
) -> Float[np.ndarray, "point"]:
    """Signed distances of points to one solid, on the host [m]; things kept as points are their upright box."""
    offset = place - center
    if kind == SPHERE:
        return np.linalg.norm(offset, axis=-1) - size[0]
    c, s = np.cos(yaw), np.sin(yaw)
    over = np.abs(offset[:, 2]) - size[2]
    if kind in (BOX, POINTS):
        along, across = c * offset[:, 0] + s * offset[:, 1], c * offset[:, 1] - s * offset[:, 0]
        excess = np.stack([np.abs(along) - size[0], np.abs(across) - size[1], over])
    else:
        excess = np.stack([np.hypot(offset[:, 0], offset[:, 1]) - size[0], over])
    deepest = excess.max(0)
    return np.where(deepest > 0, np.linalg.norm(np.maximum(excess, 0), axis=0), deepest)


def solid_normals(
    kind: int, center: np.ndarray, size: np.ndarray, yaw: float, place: Float[np.ndarray, "point 3"], step: float = 1e-5
) -> Float[np.ndarray, "point 3"]:
    """Gradients of `solid_distances` by central differences over twice a step [m]: outwards, of length 1 but at ridges within [1]."""
    sides = [
        solid_distances(kind, center, size, yaw, place + step * axis)
        - solid_distances(kind, center, size, yaw, place - step * axis)
        for axis in np.eye(3)
    ]
    return np.stack(sides, axis=-1) / (2 * step)


def common_depth(one: Solid, other: Solid) -> float:
    """How far two solids pass through each other: the diameter of the largest ball within both, to a part in `GRID` of the overlap of
    their upright bounding boxes; 0: they do not [m]."""
    lower, upper = np.stack([_bounds(one), _bounds(other)], axis=1)
    low, high = lower.max(0), upper.min(0)
    if np.any(high <= low):
        return 0.0
    axes = np.linspace(low, high, GRID).T
    place = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    return 2 * max(0.0, float(-np.maximum(solid_distances(*one, place), solid_distances(*other, place)).min()))


def _bounds(solid: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coordinates [m]."""
    kind, center, size, yaw = solid
    half = np.asarray(size, float)
    if kind in (BOX, POINTS):
        c, s = abs(np.cos(yaw)), abs(np.sin(yaw))
        half = np.array([c * half[0] + s * half[1], s * half[0] + c * half[1], half[2]])
    return center - half, center + half
