"""Storage of blocks: allocating slots, bounding boxes of the points, and freeing slots."""

import dataclasses

import jax
import jax.numpy as jnp

from hrcjax.map.index import GRAIN, NO_BOX, pack_box, with_boxes
from hrcjax.map.layout import EDGE, REACH, MapLayout
from hrcjax.map.level import Level
from hrcjax.typing import Array, Bool, Float, Int


def flat_index(shape: tuple[int, ...], place: Int[Array, "*n 3"]) -> Int[Array, "*n"]:
    """Position of a place in a grid that is laid out in one row."""
    return (place[..., 0] * shape[1] + place[..., 1]) * shape[2] + place[..., 2]


def voxel_of(layout: MapLayout, level: int, x: Float[Array, "*n 3"]) -> Int[Array, "*n"]:
    """Number of the voxel of its block in which x lies."""
    lower = jnp.asarray(layout.lower, x.dtype)
    v = jnp.floor((x - lower) / layout.spacing_of(level)).astype(jnp.int32) % EDGE
    return flat_index((EDGE, EDGE, EDGE), v)


def slots_in_turn(which: Bool[Array, "slot"], most: int, turn: Int[Array, ""]) -> Int[Array, "most"]:
    """Some of the slots that are asked for, beginning at `turn` and going round; the capacity: none."""
    capacity = which.shape[0]
    rolled = jnp.nonzero(jnp.roll(which, -turn), size=most, fill_value=capacity)[0].astype(jnp.int32)
    return jnp.where(rolled < capacity, (rolled + turn) % capacity, capacity)


def claim(
    blocks: Level, place: Int[Array, "point 3"], wanted: Bool[Array, "point"], born: int
) -> tuple[Level, Int[Array, "point"], Int[Array, ""]]:
    """Gives a slot to every wanted place that has none.

    Args:
        place: padded places, the same one any number of times.
        wanted: which of them count.
        born: most slots that are given.

    Returns:
        the level, the slot of every point (the capacity: none), and how many places went without.
    """
    shape, capacity = blocks.slot.shape, blocks.place.shape[0]
    size = shape[0] * shape[1] * shape[2]
    cell = flat_index(shape, place)
    slots = blocks.slot.reshape(-1)
    need = wanted & (slots[cell] == capacity)
    order = jnp.arange(cell.shape[0], dtype=jnp.int32)
    last = jnp.full((size,), -1, jnp.int32).at[jnp.where(need, cell, size)].max(order, mode="drop")
    speaker = need & (last[cell] == order)  # one point for each new place
    chosen = jnp.nonzero(speaker, size=born, fill_value=cell.shape[0])[0]
    free = jnp.nonzero(blocks.place[:, 0] == 0, size=born, fill_value=capacity)[0].astype(jnp.int32)
    given = (chosen < cell.shape[0]) & (free < capacity)
    at = jnp.where(given, cell.at[chosen].get(mode="fill", fill_value=0), size)
    slots = slots.at[at].set(free, mode="drop")
    places = place.at[chosen].get(mode="fill", fill_value=0)
    places = blocks.place.at[jnp.where(given, free, capacity)].set(places, mode="drop")
    lost = jnp.sum(speaker, dtype=jnp.int32) - jnp.sum(given, dtype=jnp.int32)
    level = dataclasses.replace(blocks, slot=slots.reshape(shape), place=places)
    return level, jnp.where(wanted, slots[cell], capacity), lost


def bounding_boxes(
    layout: MapLayout, level: int, place: Int[Array, "block 3"], rows: Float[Array, "block 4 voxel"]
) -> Int[Array, "block"]:
    """Bounding boxes of the points of blocks, packed."""
    there = rows[:, 3:] > 0
    edge = layout.edge_of(level)
    corner = jnp.asarray(layout.lower, rows.dtype) + (place - REACH).astype(rows.dtype) * edge
    within = (rows[:, :3] - corner[:, :, None]) * (GRAIN / edge)
    low = jnp.floor(jnp.min(jnp.where(there, within, GRAIN), axis=2)).astype(jnp.int32)
    high = jnp.ceil(jnp.max(jnp.where(there, within, 0), axis=2)).astype(jnp.int32) - 1
    packed = pack_box(jnp.clip(low, 0, GRAIN - 1), jnp.clip(high, 0, GRAIN - 1))
    return jnp.where(jnp.any(there, axis=(1, 2)), packed, NO_BOX)


def store(
    blocks: Level, slots: Int[Array, "block"], rows: Float[Array, "block 4 voxel"], boxes: Int[Array, "block"]
) -> Level:
    """Writes points and boxes of blocks, and gives back the slots of those without points.

    Args:
        slots: different ones; the capacity: none.
        boxes: packed bounding boxes of the points of level 0 in the blocks.
    """
    capacity, shape = blocks.place.shape[0], blocks.slot.shape
    size = shape[0] * shape[1] * shape[2]
    place = blocks.place.at[slots].get(mode="fill", fill_value=0)
    cell = jnp.where(slots < capacity, flat_index(shape, place), size)
    index = with_boxes(blocks.index, place, slots, boxes, capacity)
    vacant = ~jnp.any(rows[:, 3] > 0, axis=1)
    slot = blocks.slot.reshape(-1).at[jnp.where(vacant, cell, size)].set(capacity, mode="drop").reshape(shape)
    places = blocks.place.at[jnp.where(vacant, slots, capacity)].set(0, mode="drop")
    rows = blocks.rows.at[slots].set(rows, mode="drop")
    return dataclasses.replace(blocks, slot=slot, index=index, place=places, rows=rows)


def slots_around(blocks: Level, place: Int[Array, "block 3"]) -> Int[Array, "block 27"]:
    """Slots of blocks and of their 26 neighbours; the capacity: none."""

    def around(p: Int[Array, "3"]) -> Int[Array, "27"]:
        return jax.lax.dynamic_slice(blocks.slot, (p[0] - 1, p[1] - 1, p[2] - 1), (3, 3, 3)).reshape(-1)

    return jax.vmap(around)(place)


def voxels_around(
    blocks: Level, place: Int[Array, "point 3"], voxel: Int[Array, "point"]
) -> tuple[Int[Array, "point 27"], Int[Array, "point 27"]]:
    """Slots and voxels of voxels and of their 26 neighbours; slot capacity: none."""
    steps = jnp.stack(jnp.meshgrid(*[jnp.arange(-1, 2)] * 3, indexing="ij"), axis=-1).reshape(-1, 3).astype(jnp.int32)
    own = jnp.stack([voxel // (EDGE * EDGE), (voxel // EDGE) % EDGE, voxel % EDGE], axis=-1)
    at = (EDGE * place + own)[:, None, :] + steps
    slot = blocks.slot.reshape(-1)[flat_index(blocks.slot.shape, at // EDGE)]
    return slot, flat_index((EDGE, EDGE, EDGE), at % EDGE)
