"""Other distances from points: the nearest point, and a voxel distance transform."""

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]  # made at run time

from .survey import LAYOUT


def nearest_point(points: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance to the nearest of the points (point, 3) from x (query, 3) [m], and its gradient [1]."""
    d, index = cKDTree(points).query(x)
    return d, (x - points[index]) / np.maximum(d, 1e-9)[:, None]


def voxel_transform(points: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Euclidean distance transform of the voxels that hold a point, interpolated trilinearly between voxel centres [m].

    Returns:
        distance [m] and the gradient of the interpolation, not normalised.
    """
    lower, spacing = np.asarray(LAYOUT.lower), LAYOUT.spacing
    free = np.ones(np.asarray(LAYOUT.shape) * 4, bool)
    free[tuple(np.floor((points - lower) / spacing).astype(int).T)] = False
    grid = distance_transform_edt(free) * spacing
    at = np.clip((x - lower) / spacing - 0.5, 0, np.asarray(free.shape) - 1.001)
    corner = np.floor(at).astype(int)
    t = at - corner
    d, g = np.zeros(len(x)), np.zeros((len(x), 3))
    for step in np.ndindex(2, 2, 2):
        value = grid[tuple((corner + step).T)]
        part = np.where(np.asarray(step) == 1, t, 1 - t)
        d += value * np.prod(part, axis=1)
        for a in range(3):
            others = np.prod(np.delete(part, a, axis=1), axis=1)
            g[:, a] += value * others * (1 if step[a] else -1) / spacing
    return d, g
