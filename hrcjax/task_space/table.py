"""The plane that things stand on, from points and their normals; robust against all that is no plane."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage
from scipy.spatial import ConvexHull

from hrcjax.task_space.view import View, normals, points

TRIES = 300
"""Points whose plane is tried."""
SAMPLE = 20_000
"""Points by which they are judged."""
MOST = 60_000
"""Points to which the plane is fitted."""
NEAR = 0.02
"""Distance from a tried plane within which a point counts [m]."""
SHARE = 0.3
"""A plane is large if it has this share of the largest one's points [1]."""
APART = 0.08
"""Planes nearer to each other than this are one [m]."""
CELL = 0.05
"""Grid on which the table hangs together [m]."""
ALIKE = np.cos(np.deg2rad(15.0))
"""Cosine between a tried plane's normal and that of a point that counts."""


class Table(NamedTuple):
    """A plane, normal . x = offset, and which part of it was seen."""

    normal: Float[np.ndarray, "3"]
    """Upwards, of length 1."""
    offset: float
    """[m]"""
    deviation: float
    """Robust standard deviation of its points' heights [m]."""
    excess: float
    """The same over what is expected of the noise; at least 1 [1]."""
    corners: Float[np.ndarray, "corner 2"]
    """Convex outline of its points in the table's frame [m]."""
    rotation: Float[np.ndarray, "3 3"]
    """Table's frame from the world: z upwards, by the least turn."""
    shift: Float[np.ndarray, "3"]
    """x in the table's frame is rotation x + shift; its z = 0 is the plane [m]."""


def _least_turn(normal: np.ndarray) -> np.ndarray:
    """The rotation about a horizontal axis that brings a normal upwards."""
    x, y, z = normal
    if z < -1 + 1e-9:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0, 0, -x], [0, 0, -y], [x, y, 0.0]])
    return np.eye(3) + cross + cross @ cross / (1 + z)


def _robust(values: np.ndarray) -> float:
    return 1.4826 * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0.0


def inside(
    corners: Float[np.ndarray, "corner 2"], place: np.ndarray, margin: float = 0.0
) -> Bool[np.ndarray, "*point"]:
    """Whether places lie in a convex outline grown by a margin [m]; corners in counter-clockwise order."""
    edge = np.roll(corners, -1, 0) - corners
    outward = np.stack([edge[:, 1], -edge[:, 0]], -1) / np.maximum(np.linalg.norm(edge, axis=1), 1e-12)[:, None]
    return np.all(place @ outward.T - np.sum(corners * outward, -1) <= margin, axis=-1)


def _outline(flat: np.ndarray) -> np.ndarray:
    """Convex outline of the largest part of points that hangs together on a grid."""
    lower = flat.min(0) - CELL
    at = ((flat - lower) / CELL).astype(int)
    count = np.zeros(at.max(0) + 2)
    np.add.at(count, tuple(at.T), 1)
    joined: Any = ndimage.label(ndimage.binary_closing(count > 2, np.ones((3, 3))), np.ones((3, 3)))
    part, parts = joined
    if parts == 0:
        return flat[ConvexHull(flat).vertices]
    largest = 1 + int(np.argmax(ndimage.sum(count, part, np.arange(1, parts + 1))))
    kept = flat[part[tuple(at.T)] == largest]
    return kept[ConvexHull(kept).vertices]


def find_table(views: list[View], up: Float[np.ndarray, "3"], tilt: float = 0.35) -> Table:
    """The highest large plane within `tilt` of `up`: a table, and not the floor around it.

    A plane is tried through each of some points with its normal, and counts the points on it whose normals are its own. Of those
    with at least `SHARE` of the most points the highest is meant; it is fitted by least squares with Cauchy weights.

    Args:
        up: about upwards, of length 1.
        tilt: greatest angle to it [rad].

    Raises:
        ValueError: nothing horizontal is in view.
    """
    draw = np.random.default_rng(0)
    place, normal, expected = [], [], []
    for view in views:
        n, exists = normals(view)
        exists &= n @ up > np.cos(tilt)
        p = points(view)[exists]
        away = np.sum(n[exists] * (view.position - p), -1) / np.maximum(
            np.linalg.norm(view.position - p, axis=-1), 1e-9
        )
        place.append(p)
        normal.append(n[exists])
        expected.append(view.deviation[exists] * np.maximum(away, 0.1))
    p, n, s = (np.concatenate(x) for x in (place, normal, expected))
    if len(p) < 100:
        raise ValueError("no table in view: fewer than 100 pixels have a normal near the vertical")
    if len(p) > MOST:
        fewer = draw.choice(len(p), MOST, replace=False)
        p, n, s = p[fewer], n[fewer], s[fewer]
    some = draw.choice(len(p), min(SAMPLE, len(p)), replace=False)
    q, m = p[some], n[some]
    tried = draw.choice(len(q), min(TRIES, len(q)), replace=False)
    heights = np.array([m[k] @ q[k] for k in tried])
    counts = np.array([np.sum((np.abs(q @ m[k] - h) < NEAR) & (m @ m[k] > ALIKE)) for k, h in zip(tried, heights, strict=True)])  # fmt: skip
    large = counts >= SHARE * counts.max()
    across = counts[large] @ m[tried][large]  # what is level need not be so along `up`
    level = q[tried] @ (across / np.linalg.norm(across))
    same = np.abs(level - level[large].max()) < APART
    best = tried[int(np.argmax(np.where(same & large, counts, -1)))]
    way, offset = m[best], float(m[best] @ q[best])
    for _ in range(15):
        height = p @ way - offset
        near = (np.abs(height) < NEAR) & (n @ way > ALIKE)
        scale = np.hypot(_robust(height[near]), 1e-4)
        weight = 1 / (s[near] ** 2 + 1e-8) / (1 + (height[near] / (2 * scale)) ** 2)
        middle = np.average(p[near], axis=0, weights=weight)
        off = (p[near] - middle) * np.sqrt(weight / weight.sum())[:, None]
        way = np.linalg.eigh(off.T @ off)[1][:, 0]
        way = way * np.sign(way @ up)
        offset = float(way @ middle)
    height = p @ way - offset
    near = (np.abs(height) < NEAR) & (n @ way > ALIKE)
    if way @ up < np.cos(tilt) or near.sum() < 100:
        raise ValueError("no table in view: no plane near the horizontal has 100 points")
    rotation = _least_turn(way)
    outline = _outline((p[near] @ rotation.T)[:, :2])
    excess = max(1.0, _robust(height[near] / s[near]))
    return Table(way, offset, _robust(height[near]), excess, outline, rotation, np.array([0.0, 0.0, -offset]))
