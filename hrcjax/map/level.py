"""One level of a map: blocks of voxels with a point each, found by their place."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.map.index import BlockIndex, empty_index
from hrcjax.map.layout import REACH, VOXELS, MapLayout
from hrcjax.typing import Array, Float, Int


class Level(eqx.Module):
    """Blocks by slot, and the slot of every place. Places are padded by REACH on every side."""

    slot: Int[Array, "x y z"]
    """Slot of the block at a place; the capacity: none."""
    index: BlockIndex
    """Where the points of the blocks are, for queries."""
    place: Int[Array, "slot 3"]
    """Padded place of the block in a slot; 0: the slot is free."""
    rows: Float[Array, "slot 4 voxel"]
    """x, y, z [m] and weight [1] of the voxels' points; weight 0: no point."""
    toward: Int[Array, "_ 3 voxel"]
    """Mean direction from the points to the sensors that saw them, in 127ths [1]; of level 0 only."""


def empty_level(layout: MapLayout, level: int, dtype: jnp.dtype | type = jnp.float32) -> Level:
    """A level without points."""
    x, y, z = (n + 2 * REACH for n in layout.shape_of(level))
    capacity = layout.capacity_of(level)
    return Level(
        slot=jnp.full((x, y, z), capacity, jnp.int32),
        index=empty_index((x, y, z), capacity),
        place=jnp.zeros((capacity, 3), jnp.int32),
        rows=jnp.zeros((capacity, 4, VOXELS), dtype),
        toward=jnp.zeros((0 if level else capacity, 3, VOXELS), jnp.int8),
    )


def padded_place(layout: MapLayout, level: int, x: Float[Array, "*n 3"]) -> Int[Array, "*n 3"]:
    """Padded place of the block that holds x; of the nearest one if x is outside the map."""
    lower = jnp.asarray(layout.lower, x.dtype)
    top = jnp.asarray(layout.shape_of(level), jnp.int32) - 1
    return jnp.clip(jnp.floor((x - lower) / layout.edge_of(level)).astype(jnp.int32), 0, top) + REACH


def block_rows(blocks: Level, slots: Int[Array, "block"]) -> Float[Array, "block 4 voxel"]:
    """Points and weights of blocks; weight 0 of those that do not exist."""
    return blocks.rows.at[slots].get(mode="fill", fill_value=0)
