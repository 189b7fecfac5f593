"""One frame into a map: observed points are fused, points in free space removed, occluded ones kept."""

import dataclasses
from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.map.blocks import bounding_boxes, claim, slots_around, store
from hrcjax.map.coarse import Changed, update_coarse
from hrcjax.map.direction import LEVELS
from hrcjax.map.entries import Entries
from hrcjax.map.layout import VOXELS, MapLayout
from hrcjax.map.level import Level, padded_place
from hrcjax.map.params import MapParams
from hrcjax.map.sighting import (
    CANDIDATES,
    Fused,
    Known,
    Observed,
    Sight,
    Working,
    look_at,
    merge,
    observe,
    recall,
    working_blocks,
)
from hrcjax.map.state import DYNAMIC, NEW, STATIC, FieldMap, FrameReport
from hrcjax.map.view import View
from hrcjax.map.visibility import blocks_in_view
from hrcjax.map.weigh import refit, typical_weight
from hrcjax.sense import Camera
from hrcjax.sense.points import remove_body
from hrcjax.typing import Array, Bool, Float, Int

DEEP = 0.01
"""Points this far within the robot's surface are removed: nothing else can be there [m]."""


class Verdict(NamedTuple):
    """What becomes of the points, entry by entry."""

    there: Bool[Array, "entry"]
    """Points that the map holds from now on."""
    gone: Bool[Array, "entry"]
    """Points that it held until now."""
    information: Float[Array, "entry"]
    """Inverse variance that is left [1/m^2]."""
    missed: Int[Array, "entry"]
    """`FieldMap.missed`."""
    unmet: Int[Array, "entry"]
    """`FieldMap.unmet`."""
    label: Int[Array, "entry"]
    """`FieldMap.label`."""


def fuse(
    layout: MapLayout,
    params: MapParams,
    state: FieldMap,
    camera: Camera,
    view: View,
    body: Capsules | None = None,
) -> tuple[FieldMap, FrameReport]:
    """The map after one frame.

    A point of the map that the frame sees again moves to the mean of both, weighed by their variances. One in the
    free space of the image, with no point of the frame near it, is dynamic, and is removed after `patience` such frames in
    which it was not met in between. What is hidden or out of sight stays. What appears farther than `new_distance` from
    all points of the map is new.

    Args:
        view: of the camera's image, without the robot.
        body: the robot; where it is, nothing else can be, and points deep within it are removed.
    """
    beyond, wanted, inside = _usable(layout, params, camera, view)
    base, slot, lost = claim(state.levels[0], padded_place(layout, 0, view.points), wanted & inside, layout.born)
    in_view = blocks_in_view(layout, params, base, camera)
    work = working_blocks(layout, base, in_view, slot, state.frames)
    entries, seen = observe(layout, params, base, work, camera, view, slot)
    known = recall(state, base, entries)
    fused = merge(params, camera, view, known, seen)
    sight = look_at(params, base, work, entries, camera, view, known, seen, fused)
    verdict = _judge(params, known, seen, fused, sight, body)

    base, drift, stale, changed = _write(layout, params, state, base, work, entries, known, fused, verdict)
    coarse, more = _update_levels(layout, state, base, changed)
    base, waiting, turn = refit(layout, base, stale, state.turn, params)

    def count(which: Bool[Array, "..."]) -> Int[Array, ""]:
        return jnp.sum(which, dtype=jnp.int32)

    report = FrameReport(
        measured=count(view.mask),
        beyond=count(beyond),
        points=count(verdict.there),
        blocks=count(base.place[:, 0] > 0),
        new=count(sight.new),
        dynamic=count(sight.dynamic),
        removed=count(verdict.gone),
        waiting=count(waiting),
        lost=lost + more,
        outside=count(wanted & ~inside),
        unseen=count(in_view) - count(work.slots < layout.capacity),
        deferred=jnp.maximum(count(sight.through) - CANDIDATES, 0),
        left_out=entries.left_out,
    )
    index = entries.slot * VOXELS + entries.voxel

    def to_map(values: Array, some: Array) -> Array:
        some = jnp.where(verdict.there, some, 0).astype(values.dtype)
        return values.reshape(-1).at[index].set(some, mode="drop").reshape(values.shape)

    after = FieldMap(
        levels=(base, *coarse),
        stale=waiting,
        turn=turn,
        information=to_map(state.information, verdict.information),
        missed=to_map(state.missed, verdict.missed),
        unmet=to_map(state.unmet, verdict.unmet),
        label=to_map(state.label, verdict.label),
        drift=drift,
        frames=(state.frames + 1) % (1 << 16),
    )
    return after, report


def _usable(
    layout: MapLayout, params: MapParams, camera: Camera, view: View
) -> tuple[Bool[Array, "tile"], Bool[Array, "tile"], Bool[Array, "tile"]]:
    """Which points of the view lie nearer or farther than what counts, which are taken in, which lie within the box."""
    dtype = view.points.dtype
    lower = jnp.asarray(layout.lower, dtype)
    upper = lower + jnp.asarray(layout.shape, dtype) * layout.edge_of(0)
    depth = jnp.sum((view.points - camera.position) * camera.rotation[:, 2], axis=1)
    counts = (depth > params.near) & (depth < params.far)
    wanted = view.mask & counts & jnp.isfinite(view.variance)
    return view.mask & ~counts, wanted, jnp.all((view.points > lower) & (view.points < upper), axis=1)


def _judge(
    params: MapParams, known: Known, seen: Observed, fused: Fused, sight: Sight, body: Capsules | None
) -> Verdict:
    """Which points stay, which go, and what is remembered of them."""
    look, dynamic = sight.look, sight.dynamic
    there_still = seen.there | (known.exists & look.met) | sight.beside
    missed = jnp.where(there_still, 0, jnp.minimum(known.missed, 126) + dynamic.astype(jnp.int8)).astype(jnp.int8)
    unmet = jnp.where(there_still, 0, jnp.minimum(known.unmet, 126) + look.unmet.astype(jnp.int8)).astype(jnp.int8)
    # looked at, and not found: what was seen but once or twice, beside a surface, was noise
    looked_through = dynamic | sight.beside
    total = jnp.where(looked_through, params.fade * fused.information, fused.information)
    once = 1.0 / ((params.pixel_noise * look.depth**2) ** 2 + params.least_deviation**2)
    tired = dynamic & (missed.astype(total.dtype) >= params.patience)
    gone = known.exists & (tired | (looked_through & (total < params.least_information * once)))
    if body is not None:
        outside = remove_body(Cloud(jnp.stack(fused.points, axis=-1), known.exists), body, 1.0, -DEEP).mask
        gone = gone | (known.exists & ~outside)
    label = jnp.where(seen.there, STATIC, known.label)
    label = jnp.where(sight.new, NEW, jnp.where(dynamic, DYNAMIC, label))
    return Verdict(
        there=(known.exists | seen.there) & ~gone,
        gone=gone,
        information=jnp.minimum(total, params.memory / params.least_deviation**2),
        missed=missed,
        unmet=unmet,
        label=label,
    )


def _write(
    layout: MapLayout,
    params: MapParams,
    state: FieldMap,
    base: Level,
    work: Working,
    entries: Entries,
    known: Known,
    fused: Fused,
    verdict: Verdict,
) -> tuple[Level, Float[Array, "slot"], Bool[Array, "slot"], Changed]:
    """Level 0 with its points after the frame.

    Returns:
        the level; how far the points of each block have drifted since they were fitted; blocks whose weights are stale;
        blocks that have changed, for the level above.
    """
    dtype, capacity, slots = fused.information.dtype, layout.capacity, work.slots
    first_weight = typical_weight(layout, params).astype(dtype)
    values = (*fused.points, jnp.where(fused.fresh, first_weight, known.weight))
    rows = base.rows
    for a, value in enumerate(values):
        rows = rows.at[entries.slot, a, entries.voxel].set(jnp.where(verdict.there, value, 0.0), mode="drop")

    toward = base.toward
    for a, value in enumerate(fused.toward):
        kept = jnp.round(LEVELS * jnp.where(verdict.there, value, 0.0)).astype(toward.dtype)
        toward = toward.at[entries.slot, a, entries.voxel].set(kept, mode="drop")

    move = jnp.zeros((layout.seen,), dtype).at[entries.row].max(fused.moves, mode="drop")
    drift = state.drift.at[slots].get(mode="fill", fill_value=0) + move
    other = jnp.zeros((layout.seen,), bool).at[entries.row].max(fused.fresh | verdict.gone, mode="drop")
    changed = (other | (drift > (params.drift * layout.spacing) ** 2)) & (slots < capacity)
    # what has drifted is fitted anew; where points came or went, its neighbours too
    around = jnp.where(other[:, None] & (slots < capacity)[:, None], slots_around(base, work.place), capacity)
    drift = state.drift.at[slots].set(jnp.where(changed, 0.0, drift), mode="drop")
    own_rows = rows.at[slots].get(mode="fill", fill_value=0)
    boxes = bounding_boxes(layout, 0, work.place, own_rows)
    base = store(dataclasses.replace(base, rows=rows, toward=toward), slots, own_rows, boxes)
    stale = state.stale.at[around].set(True, mode="drop")
    stale = stale.at[jnp.where(changed, slots, capacity)].set(True, mode="drop") & (base.place[:, 0] > 0)
    return base, drift, stale, Changed(work.place, own_rows, changed)


def _update_levels(
    layout: MapLayout, state: FieldMap, base: Level, changed: Changed
) -> tuple[tuple[Level, ...], Int[Array, ""]]:
    """The coarse levels after what has changed below them, and how many of their blocks found no place."""
    below, levels, lost = base, [], jnp.zeros((), jnp.int32)
    for level in state.levels[1:]:
        below, more, changed = update_coarse(layout, below, level, changed)
        lost = lost + more
        levels.append(below)
    return tuple(levels), lost
