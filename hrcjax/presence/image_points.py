"""The points of people in one image: a mean point for each voxel in which it shows somebody."""

import jax
import jax.numpy as jnp

from hrcjax.geom.cloud import Cloud
from hrcjax.presence.track import Track
from hrcjax.presence.voxels import VoxelLayout, unpack_columns
from hrcjax.typing import Array, Int


def image_points(layout: VoxelLayout, track: Track, camera: Int[Array, ""], capacity: int) -> Cloud:
    """Mean points of the voxels in which a camera's last good image shows somebody, the nearest to the robot's base first.

    Unlike the cloud of `presence_cloud` they are all of one moment, and none of them stands for hidden space.

    Args:
        layout: of the voxels.
        track: of the people.
        camera: whose image.
        capacity: of the cloud; farther points are dropped.
    """
    rows = track.sums[camera]
    shown = unpack_columns(layout, track.occupied[camera]) & (rows[:, 0] > 0)
    middle = rows[:, 1:] / jnp.maximum(rows[:, :1], 1.0)
    square = jnp.where(shown, jnp.sum(middle * middle, axis=1), jnp.inf)
    negative, best = jax.lax.top_k(-square, capacity)
    mask = jnp.isfinite(negative)
    return Cloud(jnp.where(mask[:, None], middle[best], 0.0), mask)
