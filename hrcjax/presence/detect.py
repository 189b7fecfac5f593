"""Occupied voxels from one image: foreground pixels that support each other."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.presence.background import foreground
from hrcjax.presence.params import PresenceParams
from hrcjax.presence.voxels import Columns, VoxelLayout, grow, pack_columns, voxel_of
from hrcjax.sense import Camera
from hrcjax.sense.points import deproject, supported
from hrcjax.typing import Array, Float, Vector3


class Found(NamedTuple):
    """What one image shows of people."""

    sums: Float[Array, "voxel 4"]
    """Of every voxel the number of its points and the sum of their positions [1], [m]."""
    shown: Float[Array, "height width"]
    """Depth of the pixels that show somebody; 0: others [m]."""
    occupied: Columns
    """Voxels with enough of these, or some beside where somebody was a moment ago."""


def find_people(
    layout: VoxelLayout,
    params: PresenceParams,
    camera: Camera,
    depth: Float[Array, "height width"],
    settled: Float[Array, "height width"],
    robot: Float[Array, "height width"],
    box: tuple[Vector3, Vector3],
    before: Columns,
) -> Found:
    """The foreground of an image in voxels.

    Args:
        depth: measured [m].
        settled: depth of the empty cell; 0: not known [m].
        robot: expected depth of the robot; infinity where it is not [m].
        box: least and greatest corner of what counts [m].
        before: where people were before.
    """
    marked = jnp.where(foreground(params, depth, settled, robot), depth, 0.0)
    kept = supported(marked, params.support_gap * jnp.maximum(marked, 1.0), corners=True)
    shown = jnp.where(kept, marked, 0.0)
    cloud = deproject(camera, shown)
    inside = cloud.mask & jnp.all((cloud.points > box[0]) & (cloud.points < box[1]), axis=-1)
    voxel = jnp.where(inside, voxel_of(layout, cloud.points), layout.count)
    rows = jnp.concatenate([jnp.ones_like(cloud.points[:, :1]), cloud.points], axis=1)
    sums = jnp.zeros((layout.count, 4), depth.dtype).at[voxel].add(rows, mode="drop")
    count = sums[:, 0]
    enough = pack_columns(layout, count >= params.least_pixels)
    occupied = enough | (pack_columns(layout, count > 0) & grow(layout, before))
    return Found(sums, shown, occupied)
