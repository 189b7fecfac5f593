"""Coarse levels: the mean point of every block is a voxel of the next level."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.map.blocks import claim, flat_index, slots_around, store
from hrcjax.map.layout import EDGE, REACH, MapLayout
from hrcjax.map.level import Level
from hrcjax.map.params import MapParams
from hrcjax.typing import Array, Bool, Float, Int


class Changed(NamedTuple):
    """Blocks of a level whose points may have changed."""

    place: Int[Array, "block 3"]
    """Padded places."""
    rows: Float[Array, "block 4 voxel"]
    """Points and weights."""
    extent: Float[Array, "block voxel"]
    """Greatest distance of the fine points that a point stands for from it [m]."""
    which: Bool[Array, "block"]
    """Which of the blocks count."""


def typical_weight(layout: MapLayout, level: int, params: MapParams) -> Float[Array, ""]:
    """Weight of a point of a flat, regular sample: what a new one has until it is fitted [1]."""
    return jnp.asarray(
        1.0 / (1.0 + 2 * jnp.pi * (layout.scale_of(level, params.ratio) / layout.spacing_of(level)) ** 2)
    )


def update_coarse(
    layout: MapLayout,
    level: int,
    coarse: Level,
    extent: Float[Array, "slot voxel"],
    stale: Bool[Array, "slot"],
    changed: Changed,
    params: MapParams,
) -> tuple[Level, Float[Array, "slot voxel"], Bool[Array, "slot"], Int[Array, ""], Changed]:
    """A level after blocks of the one below have changed: their mean points are its own.

    Args:
        extent: greatest distance of the fine points that a point stands for from it [m].
        changed: blocks of the level below.

    Returns:
        the level, the extents, its stale blocks, how many blocks could not be stored, and its own blocks that have
        changed.
    """
    place, rows, known_extent, which = changed
    capacity = coarse.place.shape[0]
    most = min(capacity, layout.seen)  # of these blocks no more can change
    dtype = rows.dtype
    there = (rows[:, 3] > 0).astype(dtype)
    count = jnp.sum(there, axis=1)
    some = count > 0
    mean = jnp.sum(rows[:, :3] * there[:, None], axis=2) / jnp.maximum(count, 1)[:, None]
    apart = jnp.sqrt(jnp.sum((rows[:, :3] - mean[:, :, None]) ** 2, axis=1)) + known_extent
    farthest = jnp.max(jnp.where(there > 0, apart, 0.0), axis=1)
    below = place - REACH
    above = below // EDGE + REACH
    voxel = flat_index((EDGE, EDGE, EDGE), below % EDGE)
    coarse, slot, lost = claim(coarse, above, which & some, most)
    known = coarse.slot.reshape(-1)[flat_index(coarse.slot.shape, above)]
    slot = jnp.where(which, jnp.where(some, slot, known), capacity)
    old = coarse.rows.at[slot, :, voxel].get(mode="fill", fill_value=0)
    weight = jnp.where(
        some, jnp.where(old[:, 3] > 0, old[:, 3], typical_weight(layout, level, params).astype(dtype)), 0.0
    )
    point = jnp.concatenate([jnp.where(some[:, None], mean, 0.0), weight[:, None]], axis=1)
    all_rows = coarse.rows.at[slot, :, voxel].set(point, mode="drop")
    extent = extent.at[slot, voxel].set(farthest, mode="drop")
    flags = jnp.zeros((capacity,), bool).at[slot].set(True, mode="drop")
    touched = jnp.nonzero(flags, size=most, fill_value=capacity)[0].astype(jnp.int32)
    own = coarse.place.at[touched].get(mode="fill", fill_value=1)
    coarse = Level(coarse.slot, coarse.index, coarse.place, all_rows)
    own_rows = all_rows.at[touched].get(mode="fill", fill_value=0)
    real = touched < capacity
    # as on level 0: what has moved is fitted anew; where points came or went, its neighbours too
    other = jnp.zeros((capacity,), bool).at[jnp.where(some == (old[:, 3] > 0), capacity, slot)].set(True, mode="drop")
    other = other.at[touched].get(mode="fill", fill_value=False)
    around = jnp.where(other[:, None], slots_around(coarse, own), capacity)
    coarse = store(layout, level, coarse, touched, own_rows)
    stale = stale.at[around].set(True, mode="drop").at[touched].set(True, mode="drop") & (coarse.place[:, 0] > 0)
    own_extent = extent.at[touched].get(mode="fill", fill_value=0)
    return coarse, extent, stale, lost, Changed(own, own_rows, own_extent, real)
