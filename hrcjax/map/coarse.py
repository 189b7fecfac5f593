"""Coarse levels: the mean point of every block is a voxel of the next level. They lead queries to the blocks of level 0
(`hrcjax.map.descent`)."""

import dataclasses
from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.map.blocks import claim, flat_index, store
from hrcjax.map.index import hull_below
from hrcjax.map.layout import EDGE, REACH, MapLayout
from hrcjax.map.level import Level
from hrcjax.typing import Array, Bool, Float, Int


class Changed(NamedTuple):
    """Blocks of a level whose points may have changed."""

    place: Int[Array, "block 3"]
    """Padded places."""
    rows: Float[Array, "block 4 voxel"]
    """Points and weights."""
    which: Bool[Array, "block"]
    """Which of the blocks count."""


def update_coarse(
    layout: MapLayout, below: Level, coarse: Level, changed: Changed
) -> tuple[Level, Int[Array, ""], Changed]:
    """A level after blocks of the one below have changed: their mean points are its own.

    Args:
        below: the level below, after the change.
        changed: blocks of it.

    Returns:
        the level, how many blocks could not be stored, and its own blocks that have changed.
    """
    place, rows, which = changed
    capacity = coarse.place.shape[0]
    most = min(capacity, layout.seen)  # of these blocks no more can change
    there = (rows[:, 3] > 0).astype(rows.dtype)
    count = jnp.sum(there, axis=1)
    some = count > 0
    mean = jnp.sum(rows[:, :3] * there[:, None], axis=2) / jnp.maximum(count, 1)[:, None]
    step = place - REACH
    above = step // EDGE + REACH
    voxel = flat_index((EDGE, EDGE, EDGE), step % EDGE)
    coarse, slot, lost = claim(coarse, above, which & some, most)
    known = coarse.slot.reshape(-1)[flat_index(coarse.slot.shape, above)]
    slot = jnp.where(which, jnp.where(some, slot, known), capacity)
    point = jnp.concatenate([mean, jnp.ones_like(mean[:, :1])], axis=1)
    all_rows = coarse.rows.at[slot, :, voxel].set(jnp.where(some[:, None], point, 0.0), mode="drop")
    flags = jnp.zeros((capacity,), bool).at[slot].set(True, mode="drop")
    touched = jnp.nonzero(flags, size=most, fill_value=capacity)[0].astype(jnp.int32)
    own = coarse.place.at[touched].get(mode="fill", fill_value=REACH)
    own_rows = all_rows.at[touched].get(mode="fill", fill_value=0)
    coarse = dataclasses.replace(coarse, rows=all_rows)
    coarse = store(coarse, touched, own_rows, hull_below(below.index, own))
    return coarse, lost, Changed(own, own_rows, touched < capacity)
