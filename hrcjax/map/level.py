"""One level of a map: blocks of voxels with a point each, found by their place."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.field import GPField
from hrcjax.map.layout import REACH, VOXELS, MapLayout
from hrcjax.typing import Array, Float, Int, Scalar, Vector3

GRAIN = 32
"""Parts of a block's edge in which the box about its points is kept."""
NO_BOX = -1
"""Box of a block without points."""


class Level(eqx.Module):
    """Blocks by slot, and the slot of every place. Places are padded by REACH on every side."""

    slot: Int[Array, "x y z"]
    """Slot of the block at a place; the capacity: none."""
    box: Int[Array, "x y z"]
    """Box about the points of the block at a place: least x, y, z and greatest ones, five bits each, in GRAIN-ths of the
    block; NO_BOX: no points. One number, as reading them is most of what a query costs."""
    place: Int[Array, "slot 3"]
    """Padded place of the block in a slot; 0: the slot is free."""
    rows: Float[Array, "slot 4 voxel"]
    """x, y, z [m] and weight [1] of the voxels' points; weight 0: no point."""


def empty_level(layout: MapLayout, level: int, dtype: jnp.dtype | type = jnp.float32) -> Level:
    """A level without points."""
    x, y, z = (n + 2 * REACH for n in layout.shape_of(level))
    capacity = layout.capacity_of(level)
    return Level(
        slot=jnp.full((x, y, z), capacity, jnp.int32),
        box=jnp.full((x, y, z), NO_BOX, jnp.int32),
        place=jnp.zeros((capacity, 3), jnp.int32),
        rows=jnp.zeros((capacity, 4, VOXELS), dtype),
    )


def padded_place(layout: MapLayout, level: int, x: Float[Array, "*n 3"]) -> Int[Array, "*n 3"]:
    """Padded place of the block that holds x; of the nearest one if x is outside the map."""
    lower = jnp.asarray(layout.lower, x.dtype)
    top = jnp.asarray(layout.shape_of(level), jnp.int32) - 1
    return jnp.clip(jnp.floor((x - lower) / layout.edge_of(level)).astype(jnp.int32), 0, top) + REACH


def pack_box(low: Int[Array, "*n 3"], high: Int[Array, "*n 3"]) -> Int[Array, "*n"]:
    """One number for a box from the GRAIN-th `low` to the end of the GRAIN-th `high`, each from 0 to GRAIN - 1."""
    parts = jnp.concatenate([low, high], axis=-1) << jnp.arange(0, 30, 5, dtype=jnp.int32)
    return jnp.sum(parts, axis=-1, dtype=jnp.int32)


def gaps_about(
    layout: MapLayout, level: int, blocks: Level, low: Vector3, high: Vector3, span: int
) -> tuple[Int[Array, "place"], Float[Array, "place"]]:
    """Places about a box of queries, and the squares of the gaps from that box to the boxes of the blocks there [m^2].

    Args:
        low, high: corners of the box; of a single query, the same [m].
        span: places along each edge of the box.

    Returns:
        positions in the grid laid out in one row, and the gaps; infinity where no points are.
    """
    shape, edge = blocks.slot.shape, layout.edge_of(level)
    size = tuple(min(2 * REACH + span, n) for n in shape)
    begin = padded_place(layout, level, low) - REACH
    start = [jnp.minimum(begin[a], shape[a] - size[a]) for a in range(3)]
    box = jax.lax.dynamic_slice(blocks.box, start, size)
    r2 = jnp.zeros((), low.dtype)
    for a in range(3):
        place = start[a] + jnp.arange(size[a], dtype=jnp.int32)
        corner = (jnp.asarray(layout.lower[a], low.dtype) + (place - REACH).astype(low.dtype) * edge).reshape(
            [-1 if axis == a else 1 for axis in range(3)]
        )
        first, last = ((box >> shift) & (GRAIN - 1) for shift in (5 * a, 5 * a + 15))
        under = corner + first.astype(low.dtype) * (edge / GRAIN) - high[a]
        over = low[a] - corner - (last + 1).astype(low.dtype) * (edge / GRAIN)
        gap = jnp.maximum(jnp.maximum(under, over), 0.0)
        r2 = r2 + gap * gap
    offset = jnp.arange(size[0])[:, None, None] * shape[1] + jnp.arange(size[1])[:, None]
    offset = offset * shape[2] + jnp.arange(size[2])
    place = (start[0] * shape[1] + start[1]) * shape[2] + start[2] + offset.astype(jnp.int32)
    return place.reshape(-1), jnp.where(box == NO_BOX, jnp.inf, r2).reshape(-1)


def nearest_blocks(
    layout: MapLayout, level: int, blocks: Level, low: Vector3, high: Vector3, count: int, span: int = 1
) -> tuple[Int[Array, "count"], Float[Array, ""]]:
    """Slots of the blocks about a box of queries whose own boxes are nearest to it; the capacity: none.

    Of a surface all blocks within some five length scales of the nearest point matter; `count` must hold these.

    Args:
        low, high: corners of the box; of a single query, the same [m].
        span: places along each edge of the box.

    Returns:
        the slots, and the square of the gap to the last of them: to what is left out it is not less; infinity: nothing
        is left out [m^2].
    """
    place, gap = gaps_about(layout, level, blocks, low, high, span)
    # only whole results of top_k are used: of a part, XLA sorts everything
    near, best = jax.lax.top_k(-gap, min(count, gap.shape[0]))
    slots = jnp.where(jnp.isfinite(near), blocks.slot.reshape(-1)[place[best]], blocks.place.shape[0])
    return slots, jnp.max(-near)


def block_rows(blocks: Level, slots: Int[Array, "block"]) -> Float[Array, "block 4 voxel"]:
    """Points and weights of blocks; weight 0 of those that do not exist."""
    return blocks.rows.at[slots].get(mode="fill", fill_value=0)


def local_field(layout: MapLayout, level: int, blocks: Level, x: Vector3, ratio: Scalar, count: int) -> GPField:
    """The Gaussian process about x: the points of the nearest blocks. Which they are is a constant to derivatives.

    Args:
        ratio: length scale over spacing [1].
        count: number of blocks.
    """
    at = jax.lax.stop_gradient(x)
    rows = block_rows(blocks, nearest_blocks(layout, level, blocks, at, at, count)[0])
    points = jnp.moveaxis(rows[:, :3], 1, 2).reshape(-1, 3)
    weights = rows[:, 3].reshape(-1)
    scale = jnp.asarray(layout.scale_of(level, ratio), x.dtype)
    return GPField(points, weights, weights > 0, scale, signed=False)
