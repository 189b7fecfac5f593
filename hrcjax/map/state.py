"""What a map knows, and what one frame did to it."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.map.layout import VOXELS, MapLayout
from hrcjax.map.level import Level, empty_level
from hrcjax.typing import Array, Bool, Float, Int

NONE, NEW, STATIC, DYNAMIC = 0, 1, 2, 3
"""State of a point: observed for the first time where the map had none; observed again; in the free space of the last
frame, to be removed."""
LABELS = ("none", "new", "static", "dynamic")


class FieldMap(eqx.Module):
    """A map of surfaces as a distance field. Level 0 carries the knowledge, the coarser ones follow it."""

    levels: tuple[Level, ...]
    """Points and weights, finest first."""
    stale: Bool[Array, "slot"]
    """Blocks of level 0 whose weights are out of date."""
    turn: Int[Array, ""]
    """The slot at which refitting continues."""
    information: Float[Array, "slot voxel"]
    """Inverse variance of the points of level 0, as far as it is remembered [1/m^2]."""
    missed: Int[Array, "slot voxel"]
    """Frames since the last observation in whose free space the point was."""
    unmet: Int[Array, "slot voxel"]
    """Frames in a row that did not observe a point in view, up to 127: it was occluded, or nothing was measured there."""
    label: Int[Array, "slot voxel"]
    """NONE, NEW, STATIC or DYNAMIC."""
    drift: Float[Array, "slot"]
    """Sum of the squares of the largest moves of a block's points since they were fitted [m^2]."""
    frames: Int[Array, ""]
    """Frames taken in so far, modulo 65536."""


class FrameReport(eqx.Module):
    """What one frame did. If one of the last five is not 0, the map is incomplete or lags behind the camera."""

    measured: Int[Array, ""]
    """Tiles of the image with a surface, or points of the cloud."""
    beyond: Int[Array, ""]
    """Of them those nearer or farther than the limits of depth, which do not count."""
    points: Int[Array, ""]
    """Points in the blocks that the frame saw."""
    blocks: Int[Array, ""]
    """Blocks of level 0 that have a place."""
    new: Int[Array, ""]
    """Points that appeared where the map had none."""
    dynamic: Int[Array, ""]
    """Points in free space of this frame: the camera measured a surface behind them, and none near."""
    removed: Int[Array, ""]
    """Points that were removed."""
    waiting: Int[Array, ""]
    """Blocks of level 0 whose weights are out of date until a later frame fits them."""
    lost: Int[Array, ""]
    """Blocks of any level that could not be stored: `MapLayout.capacity` or `born` is exhausted."""
    outside: Int[Array, ""]
    """Measured tiles outside the mapped box; they are not stored."""
    unseen: Int[Array, ""]
    """Blocks in view that this frame did not update: `MapLayout.seen` is exhausted; they are served round robin."""
    deferred: Int[Array, ""]
    """Points in free space that a later frame will check: one frame checks 1024."""
    left_out: Int[Array, ""]
    """Points, of the map or of the frame, that this frame did not update: `MapLayout.entries` is exhausted."""


def empty_map(layout: MapLayout, dtype: jnp.dtype | type = jnp.float32) -> FieldMap:
    """A map without points."""
    shape = (layout.capacity, VOXELS)
    return FieldMap(
        levels=tuple(empty_level(layout, k, dtype) for k in range(layout.levels)),
        stale=jnp.zeros(layout.capacity, bool),
        turn=jnp.zeros((), jnp.int32),
        information=jnp.zeros(shape, dtype),
        missed=jnp.zeros(shape, jnp.int8),
        unmet=jnp.zeros(shape, jnp.int8),
        label=jnp.zeros(shape, jnp.int8),
        drift=jnp.zeros(layout.capacity, dtype),
        frames=jnp.zeros((), jnp.int32),
    )
