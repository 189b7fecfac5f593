"""Coarse levels: the mean point of every block is a voxel of the next level."""

import jax.numpy as jnp

from hrcjax.map.blocks import claim, flat_index, slots_around, store
from hrcjax.map.layout import EDGE, REACH, MapLayout
from hrcjax.map.level import Level
from hrcjax.map.params import MapParams
from hrcjax.typing import Array, Bool, Float, Int


def typical_weight(layout: MapLayout, level: int, params: MapParams) -> Float[Array, ""]:
    """Weight of a point of a flat, regular sample: what a new one has until it is fitted [1]."""
    return jnp.asarray(
        1.0 / (1.0 + 2 * jnp.pi * (layout.scale_of(level, params.ratio) / layout.spacing_of(level)) ** 2)
    )


def follow(
    layout: MapLayout,
    level: int,
    coarse: Level,
    stale: Bool[Array, "slot"],
    place: Int[Array, "block 3"],
    rows: Float[Array, "block 4 voxel"],
    changed: Bool[Array, "block"],
    params: MapParams,
) -> tuple[
    Level,
    Bool[Array, "slot"],
    Int[Array, ""],
    Int[Array, "touched 3"],
    Float[Array, "touched 4 voxel"],
    Bool[Array, "touched"],
]:
    """A level after blocks of the one below have changed: their mean points are its own.

    Args:
        place: padded places of the blocks below.
        rows: their points.
        changed: which of them to take over.

    Returns:
        the level, what is stale in it, how many blocks went without a place, and its own blocks that have changed: places,
        points, which.
    """
    capacity = coarse.place.shape[0]
    most = min(capacity, layout.seen)  # of these blocks no more can change
    dtype = rows.dtype
    there = (rows[:, 3] > 0).astype(dtype)
    count = jnp.sum(there, axis=1)
    some = count > 0
    mean = jnp.sum(rows[:, :3] * there[:, None], axis=2) / jnp.maximum(count, 1)[:, None]
    below = place - REACH
    above = below // EDGE + REACH
    voxel = flat_index((EDGE, EDGE, EDGE), below % EDGE)
    coarse, slot, lost = claim(coarse, above, changed & some, most)
    known = coarse.slot.reshape(-1)[flat_index(coarse.slot.shape, above)]
    slot = jnp.where(changed, jnp.where(some, slot, known), capacity)
    old = coarse.rows.at[slot, :, voxel].get(mode="fill", fill_value=0)
    weight = jnp.where(
        some, jnp.where(old[:, 3] > 0, old[:, 3], typical_weight(layout, level, params).astype(dtype)), 0.0
    )
    point = jnp.concatenate([jnp.where(some[:, None], mean, 0.0), weight[:, None]], axis=1)
    all_rows = coarse.rows.at[slot, :, voxel].set(point, mode="drop")
    flags = jnp.zeros((capacity,), bool).at[slot].set(True, mode="drop")
    touched = jnp.nonzero(flags, size=most, fill_value=capacity)[0].astype(jnp.int32)
    own = coarse.place.at[touched].get(mode="fill", fill_value=1)
    coarse = Level(coarse.slot, coarse.box, coarse.place, all_rows)
    own_rows = all_rows.at[touched].get(mode="fill", fill_value=0)
    real = touched < capacity
    about = jnp.where(real[:, None], slots_around(coarse, own), capacity)
    coarse = store(layout, level, coarse, touched, own_rows)
    stale = stale.at[about].set(True, mode="drop") & (coarse.place[:, 0] > 0)
    return coarse, stale, lost, own, own_rows, real
