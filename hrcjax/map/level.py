"""One level of a map: blocks of voxels with a point each, found by their place."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.field import GPField
from hrcjax.map.layout import REACH, VOXELS, MapLayout
from hrcjax.typing import Array, Float, Int, Scalar, Vector3

NOWHERE = 1e3
"""Coordinate of what does not exist, far from all queries [m]."""


class Level(eqx.Module):
    """Blocks by slot, and the slot of every place. Places are padded by REACH on every side."""

    slot: Int[Array, "x y z"]
    """Slot of the block at a place; the capacity: none."""
    box: Float[Array, "6 x y z"]
    """Least and greatest coordinates of the points of the block at a place [m]."""
    place: Int[Array, "slot 3"]
    """Padded place of the block in a slot; 0: the slot is free."""
    rows: Float[Array, "slot 4 voxel"]
    """x, y, z [m] and weight [1] of the voxels' points; weight 0: no point."""


def empty_level(layout: MapLayout, level: int, dtype: jnp.dtype | type = jnp.float32) -> Level:
    """A level without points."""
    x, y, z = (n + 2 * REACH for n in layout.shape_of(level))
    capacity = layout.capacity_of(level)
    none = jnp.asarray([NOWHERE] * 3 + [-NOWHERE] * 3, dtype)
    return Level(
        slot=jnp.full((x, y, z), capacity, jnp.int32),
        box=jnp.broadcast_to(none[:, None, None, None], (6, x, y, z)) + jnp.zeros((6, x, y, z), dtype),
        place=jnp.zeros((capacity, 3), jnp.int32),
        rows=jnp.zeros((capacity, 4, VOXELS), dtype),
    )


def padded_place(layout: MapLayout, level: int, x: Float[Array, "*n 3"]) -> Int[Array, "*n 3"]:
    """Padded place of the block that holds x; of the nearest one if x is outside the map."""
    lower = jnp.asarray(layout.lower, x.dtype)
    top = jnp.asarray(layout.shape_of(level), jnp.int32) - 1
    return jnp.clip(jnp.floor((x - lower) / layout.edge_of(level)).astype(jnp.int32), 0, top) + REACH


def nearest_blocks(layout: MapLayout, level: int, blocks: Level, x: Vector3, count: int) -> Int[Array, "count"]:
    """Slots of the blocks within REACH whose boxes are nearest to x; the capacity: none.

    Of a surface all blocks within some five length scales of the nearest point matter; `count` must hold these.
    """
    i, j, k = padded_place(layout, level, x) - REACH
    size = (2 * REACH + 1,) * 3
    box = jax.lax.dynamic_slice(blocks.box, (jnp.zeros_like(i), i, j, k), (6, *size)).reshape(6, -1)
    slots = jax.lax.dynamic_slice(blocks.slot, (i, j, k), size).reshape(-1)
    gap = jnp.maximum(jnp.maximum(box[:3] - x[:, None], x[:, None] - box[3:]), 0.0)
    _, best = jax.lax.top_k(-jnp.sum(gap * gap, axis=0), count)
    return slots[best]


def block_rows(blocks: Level, slots: Int[Array, "block"]) -> Float[Array, "block 4 voxel"]:
    """Points and weights of blocks; weight 0 of those that do not exist."""
    return blocks.rows.at[slots].get(mode="fill", fill_value=0)


def local_field(layout: MapLayout, level: int, blocks: Level, x: Vector3, ratio: Scalar, count: int) -> GPField:
    """The Gaussian process about x: the points of the nearest blocks. Which they are is a constant to derivatives.

    Args:
        ratio: length scale over spacing [1].
        count: number of blocks.
    """
    rows = block_rows(blocks, nearest_blocks(layout, level, blocks, jax.lax.stop_gradient(x), count))
    points = jnp.moveaxis(rows[:, :3], 1, 2).reshape(-1, 3)
    weights = rows[:, 3].reshape(-1)
    scale = jnp.asarray(layout.scale_of(level, ratio), x.dtype)
    return GPField(points, weights, weights > 0, scale, signed=False)
