"""A camera that looks straight down at a box of voxels, and sets of voxels as NumPy arrays."""

import jax.numpy as jnp
import numpy as np

from hrcjax.presence import PresenceParams, VoxelLayout, pack_columns, unpack_columns
from hrcjax.sense import Camera

EXACT = PresenceParams(pixel_noise=1e-6)
"""Parameters for images without noise."""


def down(
    width: int, height: int, focal: float, above: float, dtype=np.float64, x: float = 0.0, y: float = 0.0
) -> Camera:
    """A camera at (x, y, above): columns go with x, rows against y, depth is height below it."""
    return Camera(
        rotation=jnp.asarray(np.diag([1.0, -1.0, -1.0]), dtype),
        position=jnp.asarray([x, y, above], dtype),
        fx=jnp.asarray(focal, dtype),
        fy=jnp.asarray(focal, dtype),
        cx=jnp.asarray((width - 1) / 2, dtype),
        cy=jnp.asarray((height - 1) / 2, dtype),
        width=width,
        height=height,
    )


def packed(layout: VoxelLayout, grid: np.ndarray):
    return pack_columns(layout, jnp.asarray(grid.reshape(-1)))


def grid_of(layout: VoxelLayout, columns) -> np.ndarray:
    return np.asarray(unpack_columns(layout, columns)).reshape(layout.shape)


def middles(layout: VoxelLayout) -> np.ndarray:
    """(x, y, z, 3) [m]."""
    axes = [layout.lower[a] + layout.edge * (np.arange(layout.shape[a]) + 0.5) for a in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
