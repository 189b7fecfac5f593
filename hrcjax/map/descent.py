"""The blocks of level 0 that are nearest to a query, wherever it is: found from the coarsest level down.

The voxels of a level are the blocks of the level below. Of these, those with the nearest bounding boxes are looked into,
and those with the nearest mean points: of a surface aslant to the axes many boxes reach before the surface, and one of
them may be nearer than that of the point that is sought.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.map.index import NO_BOX, squared_gaps
from hrcjax.map.index import below as blocks_below
from hrcjax.map.layout import EDGE, REACH, VOXELS, MapLayout
from hrcjax.map.level import Level
from hrcjax.typing import Array, Float, Int, Vector3


class Chosen(NamedTuple):
    """How many blocks are looked into."""

    by_box: int
    """By their bounding boxes."""
    by_mean: int
    """By their mean points, besides."""


COARSE = Chosen(16, 8)
"""Of every coarser level."""
FINE = Chosen(32, 16)
"""Of level 0."""


class Children(NamedTuple):
    """The blocks below some blocks, voxel by voxel."""

    slot: Int[Array, "block voxel"]
    """The capacity: none."""
    gap: Float[Array, "block voxel"]
    """Square of the gap between bounding box and query; infinity: none [m^2]."""
    mean: Float[Array, "block voxel"]
    """Square of the distance between mean point and query; infinity: none [m^2]."""


def children_of(
    layout: MapLayout, level: int, above: Level, below: Level, slots: Int[Array, "block"], low: Vector3, high: Vector3
) -> Children:
    """What is known of the blocks of the level below without looking into them.

    Args:
        level: that of `above`, 1 or more.
        slots: of blocks of `above`; the capacity: none.
        low, high: corners of a box of queries; of a single one, the same [m].
    """
    edge = layout.edge_of(level - 1)
    there = slots < above.place.shape[0]
    padded = above.place.at[slots].get(mode="fill", fill_value=REACH)
    box, slot = blocks_below(below.index, padded)
    place = padded - REACH
    voxel = jnp.arange(EDGE, dtype=jnp.int32)
    begin = [layout.lower[a] + edge * (EDGE * place[:, a, None] + voxel).astype(low.dtype) for a in range(3)]
    corner = (begin[0][:, :, None, None], begin[1][:, None, :, None], begin[2][:, None, None, :])
    gap = squared_gaps(box.reshape(-1, EDGE, EDGE, EDGE), corner, edge, low, high).reshape(-1, VOXELS)
    rows = above.rows.at[slots].get(mode="fill", fill_value=0)
    away = (jnp.maximum(jnp.maximum(low[a] - rows[:, a], rows[:, a] - high[a]), 0.0) for a in range(3))
    mean = sum(d * d for d in away)
    some = there[:, None] & (box != NO_BOX)
    slot = jnp.where(some, slot, below.place.shape[0])
    return Children(slot, jnp.where(some, gap, jnp.inf), jnp.where(some & (rows[:, 3] > 0), mean, jnp.inf))


def nearest_children(found: Children, chosen: Chosen, capacity: int) -> tuple[Int[Array, "chosen"], Float[Array, ""]]:
    """Slots of the nearest blocks (the capacity: none), each once, and a lower bound of the squared gap to the others
    [m^2]."""
    slot, gap, mean = (v.reshape(-1) for v in found)
    near, first = jax.lax.top_k(-gap, min(chosen.by_box, gap.shape[0]))
    # a query that is not a number has gaps that are none: it must not read as free space
    by_box = jnp.where(near == -jnp.inf, capacity, slot[first])
    mean = mean.at[first].set(jnp.inf)
    near_mean, then = jax.lax.top_k(-mean, min(chosen.by_mean, gap.shape[0]))
    by_mean = jnp.where(near_mean == -jnp.inf, capacity, slot[then])
    return jnp.concatenate([by_box, by_mean]), jnp.max(-near)


def descend(
    layout: MapLayout, levels: tuple[Level, ...], low: Vector3, high: Vector3, fine: Chosen = FINE
) -> tuple[Int[Array, "block"], Float[Array, ""]]:
    """Slots of the blocks of level 0 that are nearest to a box of queries, the capacity: none.

    Args:
        low, high: corners of the box; of a single query, the same [m].
        fine: how many.

    Returns:
        the slots, each once, and a lower bound of the squared gap to the bounding boxes of all other blocks [m^2].
    """
    top = layout.levels - 1
    slots, unread = jnp.arange(levels[top].place.shape[0], dtype=jnp.int32), jnp.asarray(jnp.inf, low.dtype)
    for level in range(top, 0, -1):
        found = children_of(layout, level, levels[level], levels[level - 1], slots, low, high)
        slots, left = nearest_children(found, COARSE if level > 1 else fine, levels[level - 1].place.shape[0])
        unread = jnp.minimum(unread, left)
    return slots, unread
