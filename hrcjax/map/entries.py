"""The voxels that one frame can change, numbered in one list: an eighth of those of the blocks in view."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.map.blocks import voxels_around
from hrcjax.map.layout import VOXELS, MapLayout
from hrcjax.map.level import Level
from hrcjax.typing import Array, Bool, Float, Int, Scalar


class Entries(NamedTuple):
    """Voxels of the blocks in view that hold a point or get one. The last ones may be void: row and slot beyond all."""

    of: Int[Array, "row voxel"]
    """Entry of every voxel of the blocks in view; the number of entries: none."""
    row: Int[Array, "entry"]
    """Which of the blocks in view."""
    slot: Int[Array, "entry"]
    """Its slot."""
    voxel: Int[Array, "entry"]
    """The voxel in it."""
    left_out: Int[Array, ""]
    """Voxels for which no entry was left."""


def make_entries(layout: MapLayout, seen: Int[Array, "row"], here: Bool[Array, "row voxel"]) -> Entries:
    """Numbers voxels in their order.

    Args:
        seen: slots of the blocks in view.
        here: which of their voxels get an entry.
    """
    most, size = layout.entries, here.size
    flags = here.astype(jnp.float32)
    within = (flags @ jnp.triu(jnp.ones((VOXELS, VOXELS), jnp.float32))).astype(jnp.int32)
    begin = jnp.cumsum(within[:, -1]) - within[:, -1]
    number = jnp.where(here, begin[:, None] + within - 1, most)
    of = jnp.minimum(number, most)
    index = jnp.full((most,), size, jnp.int32).at[of.reshape(-1)].set(jnp.arange(size, dtype=jnp.int32), mode="drop")
    row = index // VOXELS
    slot = seen.at[row].get(mode="fill", fill_value=layout.capacity)
    left_out = jnp.maximum(begin[-1] + within[-1, -1] - most, 0)
    return Entries(of, row, slot, index % VOXELS, left_out)


def near_any(
    blocks: Level,
    table: Int[Array, "slot"],
    entries: Entries,
    marks: Bool[Array, "entry"],
    points: tuple[Float[Array, "entry"], ...],
    asked: Int[Array, "n"],
    x: tuple[Float[Array, "entry"], ...],
    distance: Scalar,
) -> Bool[Array, "n"]:
    """Whether a marked point lies within a distance [m] of entries, in their voxel or its 26 neighbours.

    Args:
        table: row of every slot; beyond all rows: not in view.
        marks, points: which entries hold a point, and where.
        asked: entries to ask about.
        x: where these are, as coordinates of all entries [m].
    """
    slot, voxel = entries.slot.at[asked].get(mode="clip"), entries.voxel.at[asked].get(mode="clip")
    place = blocks.place.at[slot].get(mode="fill", fill_value=1)
    near_slot, near_voxel = voxels_around(blocks, place, voxel)
    row = table.at[near_slot].get(mode="fill", fill_value=entries.of.shape[0])
    other = entries.of.at[row, near_voxel].get(mode="fill", fill_value=marks.shape[0])
    there = marks.at[other].get(mode="fill", fill_value=False)
    r2 = sum(
        (p.at[other].get(mode="fill", fill_value=0) - own.at[asked].get(mode="clip")[:, None]) ** 2
        for p, own in zip(points, x, strict=True)
    )
    return jnp.any(there & (r2 < jnp.asarray(distance, x[0].dtype) ** 2), axis=1)
