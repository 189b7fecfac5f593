"""One frame into a map: what is seen is fused, what is seen through goes, what is hidden stays."""

from typing import Any

import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.map.blocks import claim, slots_around, slots_in_turn, store, voxel_of
from hrcjax.map.coarse import Changed, typical_weight, update_coarse
from hrcjax.map.entries import make_entries, near_any
from hrcjax.map.layout import VOXELS, MapLayout
from hrcjax.map.level import Level, padded_place
from hrcjax.map.params import MapParams
from hrcjax.map.state import DYNAMIC, NEW, STATIC, FieldMap, FrameReport
from hrcjax.map.view import View
from hrcjax.map.visibility import blocks_in_view, look_along
from hrcjax.map.weigh import refit
from hrcjax.sense import Camera
from hrcjax.sense.points import remove_body
from hrcjax.typing import Array, Bool, Int, Scalar

CANDIDATES = 1024
"""Points of one frame that are compared with their neighbourhood; beyond, what appears counts as new, and what is seen
through waits for a later frame."""
DEEP = 0.01
"""Points this far within the robot's surface go: no other thing can be there [m]."""


def fuse(
    layout: MapLayout,
    params: MapParams,
    state: FieldMap,
    camera: Camera,
    view: View,
    body: Capsules | None = None,
) -> tuple[FieldMap, FrameReport]:
    """The map after one frame.

    A point of the map that the frame sees again moves to the mean of both, weighed by their variances. One that the
    image sees through, with nothing of the frame about it, is dynamic, and goes after `patience` such frames in which it
    was not met in between. What is
    hidden or out of sight stays. What appears farther than `new_distance` from all points of the map is new.

    Args:
        view: of the camera's image, without the robot.
        body: the robot; where it is, nothing else can be, and points deep within it go.
    """
    base, capacity, dtype = state.levels[0], layout.capacity, view.points.dtype
    lower = jnp.asarray(layout.lower, dtype)
    upper = lower + jnp.asarray(layout.shape, dtype) * layout.edge_of(0)
    depth = jnp.sum((view.points - camera.position) * camera.rotation[:, 2], axis=1)
    wanted = view.mask & (depth > params.near) & (depth < params.far) & jnp.isfinite(view.variance)
    inside = jnp.all((view.points > lower) & (view.points < upper), axis=1)
    base, slot, lost = claim(base, padded_place(layout, 0, view.points), wanted & inside, layout.born)

    # the frame's own points, voxel by voxel of the blocks in view
    in_view = blocks_in_view(layout, params, base, camera)
    hit = jnp.zeros((capacity,), bool).at[slot].set(True, mode="drop") & in_view
    # what the frame adds to goes before what it may see through; who comes too late is first another time
    turn = (state.frames * (layout.seen // 2)) % capacity
    first, then = (slots_in_turn(which, layout.seen, turn) for which in (hit, in_view & ~hit))
    count_hit = jnp.sum(hit, dtype=jnp.int32)
    order = jnp.arange(layout.seen, dtype=jnp.int32)
    seen = jnp.where(order < count_hit, first, then[jnp.maximum(order - count_hit, 0)])
    table = jnp.full((capacity,), layout.seen, jnp.int32).at[seen].set(order, mode="drop")
    place = base.place.at[seen].get(mode="fill", fill_value=1)

    # voxels that hold a point, or get one
    row = table.at[slot].get(mode="fill", fill_value=layout.seen)
    own = row * VOXELS + voxel_of(layout, 0, view.points)
    held = base.rows.at[seen, 3].get(mode="fill", fill_value=0) > 0
    got = jnp.zeros((held.size,), bool).at[own].set(True, mode="drop")
    entries = make_entries(layout, seen, held | got.reshape(held.shape))
    most = entries.slot.shape[0]

    # the frame's own points, voxel by voxel
    weight = 1.0 / (view.variance + params.least_deviation**2)
    parts = jnp.concatenate([weight[:, None] * (view.points - camera.position), weight[:, None]], axis=1)
    entry = entries.of.reshape(-1).at[own].get(mode="fill", fill_value=most)
    sums = jnp.zeros((most, 4), dtype).at[entry].add(parts, mode="drop")
    observed = sums[:, 3] > 0
    scale = jnp.where(observed, 1.0 / jnp.where(observed, sums[:, 3], 1.0), 0.0)
    frame = tuple(camera.position[a] + scale * sums[:, a] for a in range(3))

    # fused with the map's
    old, alpha = (
        tuple(base.rows.at[entries.slot, a, entries.voxel].get(mode="fill", fill_value=0) for a in which)
        for which in ((0, 1, 2), (3,))
    )
    exists = alpha[0] > 0
    index = entries.slot * VOXELS + entries.voxel

    def of_map(values: Array) -> Array:
        return values.reshape(-1).at[index].get(mode="fill", fill_value=0)

    information, missed, unmet, label = (of_map(a) for a in (state.information, state.missed, state.unmet, state.label))
    gain = jnp.where(observed, jnp.minimum(sums[:, 3], 1.0 / params.least_deviation**2), 0.0)
    total = information + gain
    share = gain / jnp.where(total > 0, total, 1.0)
    points = tuple(jnp.where(exists, o + share * (f - o), f) for o, f in zip(old, frame, strict=True))
    fresh = observed & ~exists
    moves = jnp.where(exists & observed, sum((p - o) ** 2 for p, o in zip(points, old, strict=True)), 0.0)

    def near(which: Bool[Array, "entry"], marks: Bool[Array, "entry"], x: tuple[Array, ...], distance: Scalar) -> Any:
        """Which entries were asked about, of those in `which`, and whether a marked x lies near to their points."""
        asked = jnp.nonzero(which, size=CANDIDATES, fill_value=most)[0].astype(jnp.int32)
        return asked, near_any(base, table, entries, marks, x, asked, points, distance)

    # seen through, and nothing of this frame about: the frustum's own field is far from there
    look = look_along(params, camera, view, *points)
    through = exists & ~observed & look.past
    nothing = jnp.zeros((most,), bool)
    asked, covered = near(through, observed, frame, params.clear_distance)
    dynamic = nothing.at[asked].set(~covered, mode="drop")
    beside = nothing.at[asked].set(covered, mode="drop")
    asked, known = near(fresh, exists, old, params.new_distance)
    new = fresh & ~nothing.at[asked].set(known, mode="drop")

    there_still = observed | (exists & look.met) | beside
    missed = jnp.where(there_still, 0, jnp.minimum(missed, 126) + dynamic.astype(jnp.int8)).astype(jnp.int8)
    unmet = jnp.where(there_still, 0, jnp.minimum(unmet, 126) + look.unmet.astype(jnp.int8)).astype(jnp.int8)
    # looked at, and not found: what was seen but once or twice, beside a surface, was noise
    looked_through = dynamic | beside
    total = jnp.where(looked_through, params.fade * total, total)
    once = 1.0 / ((params.pixel_noise * look.depth**2) ** 2 + params.least_deviation**2)
    tired = dynamic & (missed.astype(dtype) >= params.patience)
    gone = exists & (tired | (looked_through & (total < params.least_information * once)))
    if body is not None:
        gone = gone | (exists & ~remove_body(Cloud(jnp.stack(points, axis=-1), exists), body, 1.0, -DEEP).mask)
    there = (exists | observed) & ~gone
    label = jnp.where(observed, STATIC, label)
    label = jnp.where(new, NEW, jnp.where(dynamic, DYNAMIC, label))
    total = jnp.minimum(total, params.memory / params.least_deviation**2)
    first_weight = typical_weight(layout, 0, params).astype(dtype)
    values = (*points, jnp.where(fresh, first_weight, alpha[0]))
    rows = base.rows
    for a, value in enumerate(values):
        rows = rows.at[entries.slot, a, entries.voxel].set(jnp.where(there, value, 0.0), mode="drop")

    def to_map(values: Array, some: Array) -> Array:
        some = jnp.where(there, some, 0).astype(values.dtype)
        return values.reshape(-1).at[index].set(some, mode="drop").reshape(values.shape)

    # weights of what has changed, and of the blocks about it
    move = jnp.zeros((layout.seen,), dtype).at[entries.row].max(moves, mode="drop")
    drift = state.drift.at[seen].get(mode="fill", fill_value=0) + move
    other = jnp.zeros((layout.seen,), bool).at[entries.row].max(fresh | gone, mode="drop")
    changed = (other | (drift > (params.drift * layout.spacing) ** 2)) & (seen < capacity)
    # what has drifted is fitted anew; where points came or went, what is about it too
    about = jnp.where(other[:, None] & (seen < capacity)[:, None], slots_around(base, place), capacity)
    drift = state.drift.at[seen].set(jnp.where(changed, 0.0, drift), mode="drop")
    rows_seen = rows.at[seen].get(mode="fill", fill_value=0)
    base = store(layout, 0, Level(base.slot, base.index, base.place, rows), seen, rows_seen)
    stale = state.stale[0].at[about].set(True, mode="drop")
    stale = stale.at[jnp.where(changed, seen, capacity)].set(True, mode="drop") & (base.place[:, 0] > 0)
    levels, extents, waiting = [base], [], [stale]
    below = Changed(place, rows_seen, jnp.zeros((layout.seen, VOXELS), dtype), changed)
    for k in range(1, layout.levels):
        level, extent, stale, more, below = update_coarse(
            layout, k, state.levels[k], state.extent[k - 1], state.stale[k], below, params
        )
        lost = lost + more
        levels.append(level)
        extents.append(extent)
        waiting.append(stale)
    levels, waiting, turn = refit(layout, tuple(levels), tuple(waiting), state.turn, params)

    def count(which: Bool[Array, "..."]) -> Int[Array, ""]:
        return jnp.sum(which, dtype=jnp.int32)

    report = FrameReport(
        points=count(there),
        blocks=count(levels[0].place[:, 0] > 0),
        new=count(new),
        dynamic=count(dynamic),
        removed=count(gone),
        waiting=count(waiting[0]),
        lost=lost,
        outside=count(wanted & ~inside),
        unseen=count(in_view) - count(seen < capacity),
        deferred=jnp.maximum(count(through) - CANDIDATES, 0),
        left_out=entries.left_out,
    )
    fused = FieldMap(
        levels=levels,
        extent=tuple(extents),
        stale=waiting,
        turn=turn,
        information=to_map(state.information, total),
        missed=to_map(state.missed, missed),
        unmet=to_map(state.unmet, unmet),
        label=to_map(state.label, label),
        drift=drift,
        frames=(state.frames + 1) % (1 << 16),
    )
    return fused, report
