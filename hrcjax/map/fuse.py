"""One frame into a map: what is seen is fused, what is seen through goes, what is hidden stays."""

import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.map.blocks import claim, slots_around, slots_in_turn, store, voxel_of, voxels_around
from hrcjax.map.coarse import follow, typical_weight
from hrcjax.map.layout import VOXELS, MapLayout
from hrcjax.map.level import Level, padded_place
from hrcjax.map.params import MapParams
from hrcjax.map.state import DYNAMIC, NEW, NONE, STATIC, FieldMap, FrameReport
from hrcjax.map.view import View
from hrcjax.map.visibility import blocks_in_view, look_along
from hrcjax.map.weigh import refit
from hrcjax.sense import Camera
from hrcjax.sense.points import remove_body
from hrcjax.typing import Array, Bool, Float, Int, Scalar

CANDIDATES = 1024
"""Points of one frame that are compared with their neighbourhood; beyond, what appears counts as new, and what is seen
through waits for a later frame."""
DEEP = 0.01
"""Points this far within the robot's surface go: no other thing can be there [m]."""


def _near_any(
    blocks: Level,
    marks: Bool[Array, "row voxel"],
    points: Float[Array, "row 3 voxel"],
    table: Int[Array, "slot"] | None,
    place: Int[Array, "n 3"],
    voxel: Int[Array, "n"],
    x: Float[Array, "n 3"],
    distance: Scalar,
) -> Bool[Array, "n"]:
    """Whether a marked point lies within a distance [m] of each point, in its voxel or the 26 about it.

    Args:
        marks, points: which voxels hold a point, and where; by slot, or by row of a table.
        table: row of every slot; None: rows are slots.
        place, voxel, x: padded place of each point's block, its voxel there, its coordinates [m].
    """
    slot, at = voxels_around(blocks, place, voxel)
    row = slot if table is None else table.at[slot].get(mode="fill", fill_value=marks.shape[0])
    there = marks.at[row, at].get(mode="fill", fill_value=False)
    other = points.at[row, :, at].get(mode="fill", fill_value=0)
    r2 = jnp.sum((other - x[:, None, :]) ** 2, axis=-1)
    return jnp.any(there & (r2 < jnp.asarray(distance, x.dtype) ** 2), axis=1)


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
    number = jnp.arange(layout.seen, dtype=jnp.int32)
    table = jnp.full((capacity,), layout.seen, jnp.int32).at[seen].set(number, mode="drop")
    row = table.at[slot].get(mode="fill", fill_value=layout.seen)
    weight = 1.0 / (view.variance + params.least_deviation**2)
    parts = jnp.concatenate([weight[:, None] * (view.points - camera.position), weight[:, None]], axis=1)
    sums = jnp.zeros((layout.seen * VOXELS, 4), dtype)
    sums = sums.at[row * VOXELS + voxel_of(layout, 0, view.points)].add(parts, mode="drop")
    sums = jnp.moveaxis(sums.reshape(layout.seen, VOXELS, 4), 2, 1)
    observed = sums[:, 3] > 0
    frame = camera.position[:, None] + sums[:, :3] / jnp.maximum(sums[:, 3:], 1.0)

    # fused with the map's
    rows = base.rows.at[seen].get(mode="fill", fill_value=0)
    information = state.information.at[seen].get(mode="fill", fill_value=0)
    missed = state.missed.at[seen].get(mode="fill", fill_value=0)
    label = state.label.at[seen].get(mode="fill", fill_value=0)
    place = base.place.at[seen].get(mode="fill", fill_value=1)
    exists = rows[:, 3] > 0
    gain = jnp.where(observed, jnp.minimum(sums[:, 3], 1.0 / params.least_deviation**2), 0.0)
    total = information + gain
    step = (gain / jnp.maximum(total, 1.0))[:, None] * (frame - rows[:, :3])
    points = jnp.where(exists[:, None], rows[:, :3] + step, frame)
    fresh = observed & ~exists
    move = jnp.max(jnp.where(exists & observed, jnp.sum(step * step, axis=1), 0.0), axis=1)

    def candidates(which: Bool[Array, "row voxel"]) -> tuple[Array, tuple[Array, Array, Array]]:
        index = jnp.nonzero(which.reshape(-1), size=CANDIDATES, fill_value=which.size)[0].astype(jnp.int32)
        r, v = jnp.minimum(index // VOXELS, layout.seen - 1), index % VOXELS
        return index, (place[r], v, points[r, :, v])

    # seen through, and nothing of this frame about: the frustum's own field is far from there
    look = look_along(params, camera, view, points[:, 0], points[:, 1], points[:, 2])
    through = exists & ~observed & look.past
    index, asked = candidates(through)
    clear = ~_near_any(base, observed, frame, table, *asked, params.clear_distance)
    nothing = jnp.zeros(through.size, bool)
    dynamic = nothing.at[index].set(clear, mode="drop").reshape(through.shape)
    beside = nothing.at[index].set(~clear, mode="drop").reshape(through.shape)
    index, asked = candidates(fresh)
    known = _near_any(base, base.rows[:, 3] > 0, base.rows[:, :3], None, *asked, params.new_distance)
    new = fresh & ~jnp.zeros(fresh.size, bool).at[index].set(known, mode="drop").reshape(fresh.shape)

    there_still = observed | (exists & look.met) | beside
    missed = jnp.where(there_still, 0, missed + dynamic.astype(jnp.int8)).astype(jnp.int8)
    # looked at, and not found: what was seen but once or twice, beside a surface, was noise
    total = jnp.where(through, params.fade * total, total)
    once = 1.0 / ((params.pixel_noise * look.depth**2) ** 2 + params.least_deviation**2)
    gone = exists & ((missed.astype(dtype) >= params.patience) | (through & (total < params.least_information * once)))
    if body is not None:
        within = ~remove_body(
            Cloud(jnp.moveaxis(points, 1, 2).reshape(-1, 3), exists.reshape(-1)), body, 1.0, -DEEP
        ).mask
        gone = gone | (exists & within.reshape(exists.shape))
    there = (exists | observed) & ~gone
    label = jnp.where(observed, STATIC, label)
    label = jnp.where(new, NEW, jnp.where(dynamic, DYNAMIC, label))
    label = jnp.where(there, label, NONE).astype(jnp.int8)
    most = params.memory / params.least_deviation**2
    information = jnp.where(there, jnp.minimum(total, most), 0.0)
    alpha = jnp.where(there, jnp.where(fresh, typical_weight(layout, 0, params).astype(dtype), rows[:, 3]), 0.0)
    rows = jnp.concatenate([jnp.where(there[:, None], points, 0.0), alpha[:, None]], axis=1)

    # weights of what has changed, and of the blocks about it
    drift = state.drift.at[seen].get(mode="fill", fill_value=0) + move
    changed = jnp.any(fresh | gone, axis=1) | (drift > (params.drift * layout.spacing) ** 2)
    changed = changed & (seen < capacity)
    about = jnp.where(changed[:, None], slots_around(base, place), capacity)
    drift = state.drift.at[seen].set(jnp.where(changed, 0.0, drift), mode="drop")
    base = store(layout, 0, base, seen, rows)
    stale = state.stale[0].at[about].set(True, mode="drop") & (base.place[:, 0] > 0)
    levels, waiting = [base], [stale]
    below, points_below, changed_below = place, rows, changed
    for k in range(1, layout.levels):
        level, stale, more, below, points_below, changed_below = follow(
            layout, k, state.levels[k], state.stale[k], below, points_below, changed_below, params
        )
        lost = lost + more
        levels.append(level)
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
    )
    fused = FieldMap(
        levels=levels,
        stale=waiting,
        turn=turn,
        information=state.information.at[seen].set(information, mode="drop"),
        missed=state.missed.at[seen].set(missed, mode="drop"),
        label=state.label.at[seen].set(label, mode="drop"),
        drift=drift,
        frames=(state.frames + 1) % (1 << 16),
    )
    return fused, report
