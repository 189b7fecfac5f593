"""What one frame says about the voxels it concerns: its own points there, what the map holds, and its free space."""

from typing import Any, NamedTuple

import jax.numpy as jnp

from hrcjax.map.blocks import slots_in_turn, voxel_of
from hrcjax.map.direction import LEVELS
from hrcjax.map.entries import Entries, make_entries, near_any
from hrcjax.map.layout import VOXELS, MapLayout
from hrcjax.map.level import Level
from hrcjax.map.params import MapParams
from hrcjax.map.state import FieldMap
from hrcjax.map.view import View
from hrcjax.map.visibility import Look, look_along
from hrcjax.numerics import safe_divide, safe_sqrt
from hrcjax.sense import Camera
from hrcjax.typing import Array, Bool, Float, Int, Scalar

CANDIDATES = 1024
"""Points of one frame that are compared with their neighbourhood; beyond, what appears counts as new, and points in
free space are checked by a later frame."""

Coordinates = tuple[Float[Array, "entry"], ...]
"""x, y and z of all entries [m]."""


class Working(NamedTuple):
    """The blocks of level 0 that a frame works on, at most `MapLayout.seen`."""

    slots: Int[Array, "row"]
    """Their slots; the capacity: none."""
    place: Int[Array, "row 3"]
    """Their padded places."""
    table: Int[Array, "slot"]
    """Row of every slot; `seen`: none."""


class Observed(NamedTuple):
    """What the frame measured, entry by entry."""

    there: Bool[Array, "entry"]
    """Whether it measured a point in the voxel."""
    points: Coordinates
    """Mean of its points, weighed by their inverse variances [m]."""
    information: Float[Array, "entry"]
    """Sum of these [1/m^2]."""


class Known(NamedTuple):
    """What the map holds, entry by entry."""

    exists: Bool[Array, "entry"]
    """Whether there is a point in the voxel."""
    points: Coordinates
    """Where [m]."""
    weight: Float[Array, "entry"]
    """Of the kernel [1]."""
    toward: Coordinates
    """Mean direction to the sensors that saw it [1]."""
    information: Float[Array, "entry"]
    """Inverse variance [1/m^2]."""
    missed: Int[Array, "entry"]
    """`FieldMap.missed`."""
    unmet: Int[Array, "entry"]
    """`FieldMap.unmet`."""
    label: Int[Array, "entry"]
    """`FieldMap.label`."""


class Fused(NamedTuple):
    """Both together, entry by entry."""

    points: Coordinates
    """Mean of the map's point and the frame's, or the one there is [m]."""
    information: Float[Array, "entry"]
    """Sum of both [1/m^2]."""
    toward: Coordinates
    """Mean direction to the sensors, weighed as the points are [1]."""
    fresh: Bool[Array, "entry"]
    """Points where the map had none."""
    moves: Float[Array, "entry"]
    """Square of the way that a point of the map moved [m^2]."""


class Sight(NamedTuple):
    """How the frame's own image bears on the points, entry by entry."""

    look: Look
    """What lies along the ray to the point."""
    through: Bool[Array, "entry"]
    """Points of the map in the free space of the image."""
    dynamic: Bool[Array, "entry"]
    """Of these, those with no point of the frame near."""
    beside: Bool[Array, "entry"]
    """Of these, those with a point of the frame near: the edge of a surface, or noise in front of it."""
    new: Bool[Array, "entry"]
    """Points of the frame with no point of the map near."""


def working_blocks(
    layout: MapLayout, base: Level, in_view: Bool[Array, "slot"], slot: Int[Array, "tile"], frames: Int[Array, ""]
) -> Working:
    """The blocks that the frame adds points to, then those that may be in its free space; of each kind round robin, so that
    blocks that found no room have their turn in later frames.

    Args:
        in_view: blocks within the camera's frustum.
        slot: block of every measured point; the capacity: none.
        frames: taken in so far.
    """
    capacity = layout.capacity
    hit = jnp.zeros((capacity,), bool).at[slot].set(True, mode="drop") & in_view
    turn = (frames * (layout.seen // 2)) % capacity
    first, then = (slots_in_turn(which, layout.seen, turn) for which in (hit, in_view & ~hit))
    count_hit = jnp.sum(hit, dtype=jnp.int32)
    order = jnp.arange(layout.seen, dtype=jnp.int32)
    slots = jnp.where(order < count_hit, first, then[jnp.maximum(order - count_hit, 0)])
    table = jnp.full((capacity,), layout.seen, jnp.int32).at[slots].set(order, mode="drop")
    return Working(slots, base.place.at[slots].get(mode="fill", fill_value=1), table)


def observe(
    layout: MapLayout, params: MapParams, base: Level, work: Working, camera: Camera, view: View, slot: Array
) -> tuple[Entries, Observed]:
    """Entries for the voxels that hold a point or get one, and the frame's mean point in each.

    Args:
        slot: block of every measured point; the capacity: none.
    """
    row = work.table.at[slot].get(mode="fill", fill_value=layout.seen)
    own = row * VOXELS + voxel_of(layout, 0, view.points)
    held = base.rows.at[work.slots, 3].get(mode="fill", fill_value=0) > 0
    got = jnp.zeros((held.size,), bool).at[own].set(True, mode="drop")
    entries = make_entries(layout, work.slots, held | got.reshape(held.shape))
    most = entries.slot.shape[0]

    weight = 1.0 / (view.variance + params.least_deviation**2)
    parts = jnp.concatenate([weight[:, None] * (view.points - camera.position), weight[:, None]], axis=1)
    entry = entries.of.reshape(-1).at[own].get(mode="fill", fill_value=most)
    sums = jnp.zeros((most, 4), view.points.dtype).at[entry].add(parts, mode="drop")
    there = sums[:, 3] > 0
    scale = jnp.where(there, 1.0 / jnp.where(there, sums[:, 3], 1.0), 0.0)
    points = tuple(camera.position[a] + scale * sums[:, a] for a in range(3))
    return entries, Observed(there, points, sums[:, 3])


def recall(state: FieldMap, base: Level, entries: Entries) -> Known:
    """What the map holds in the entries' voxels."""
    points, weight = (
        tuple(base.rows.at[entries.slot, a, entries.voxel].get(mode="fill", fill_value=0) for a in which)
        for which in ((0, 1, 2), (3,))
    )
    index = entries.slot * VOXELS + entries.voxel

    def of_map(values: Array) -> Array:
        return values.reshape(-1).at[index].get(mode="fill", fill_value=0)

    kept = (of_map(a) for a in (state.information, state.missed, state.unmet, state.label))
    toward = tuple(
        base.toward.at[entries.slot, a, entries.voxel].get(mode="fill", fill_value=0).astype(points[0].dtype) / LEVELS
        for a in range(3)
    )
    return Known(weight[0] > 0, points, weight[0], toward, *kept)


def merge(params: MapParams, camera: Camera, view: View, known: Known, seen: Observed) -> Fused:
    """Points of the map moved to the mean of both, weighed by their inverse variances. A view that nothing is seen through may be
    from anywhere: it tells no direction to the sensor."""
    gain = jnp.where(seen.there, jnp.minimum(seen.information, 1.0 / params.least_deviation**2), 0.0)
    total = known.information + gain
    share = gain / jnp.where(total > 0, total, 1.0)
    both = zip(known.points, seen.points, strict=True)
    points = tuple(jnp.where(known.exists, o + share * (f - o), f) for o, f in both)
    way = sum((p - o) ** 2 for p, o in zip(points, known.points, strict=True))
    moves = jnp.where(known.exists & seen.there, way, 0.0)
    way = tuple(camera.position[a] - points[a] for a in range(3))
    from_where = jnp.any(view.depth > 0)
    length = safe_sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    news = jnp.where(from_where, jnp.where(known.exists, share, 1.0), 0.0)
    toward = tuple(o + news * (safe_divide(w, length) - o) for o, w in zip(known.toward, way, strict=True))
    return Fused(points, total, toward, seen.there & ~known.exists, moves)


def look_at(
    params: MapParams,
    base: Level,
    work: Working,
    entries: Entries,
    camera: Camera,
    view: View,
    known: Known,
    seen: Observed,
    fused: Fused,
) -> Sight:
    """Which points are in free space with no point of the frame near, or beside a surface, and which are new."""
    most = entries.slot.shape[0]

    def near(which: Bool[Array, "entry"], marks: Bool[Array, "entry"], x: Coordinates, distance: Scalar) -> Any:
        """Which entries of `which` were compared, and whether a marked x lies near their points."""
        asked = jnp.nonzero(which, size=CANDIDATES, fill_value=most)[0].astype(jnp.int32)
        return asked, near_any(base, work.table, entries, marks, x, asked, fused.points, distance)

    look = look_along(params, camera, view, *fused.points)
    through = known.exists & ~seen.there & look.past
    nothing = jnp.zeros((most,), bool)
    asked, covered = near(through, seen.there, seen.points, params.clear_distance)
    dynamic = nothing.at[asked].set(~covered, mode="drop")
    beside = nothing.at[asked].set(covered, mode="drop")
    asked, familiar = near(fused.fresh, known.exists, known.points, params.new_distance)
    new = fused.fresh & ~nothing.at[asked].set(familiar, mode="drop")
    return Sight(look, through, dynamic, beside, new)
