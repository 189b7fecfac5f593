"""Signed distances to one solid on the host, many points at once."""

import numpy as np
from jaxtyping import Float

from hrcjax.world.scene import BOX, SPHERE

POINTS = -1
"""Kind of a thing that no shape explains: kept as points, solid as its upright box."""


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
