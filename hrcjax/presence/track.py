"""Where a person may be, image by image: what is measured, what lies hidden behind it, and what was lost from sight.

A person who was measured and is not measured now stays, and spreads at the assumed speed through everything that no
camera sees, until it is seen through. Space that a camera sees to be free holds nobody. Pockets that do not hang together
with a person in view, are too small for a trunk, and are not hidden by a failing measurement hold nobody either.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.presence.detect import find_people
from hrcjax.presence.params import PresenceParams
from hrcjax.presence.sight import Sight, not_measured, seen_before, seen_behind, seen_free
from hrcjax.presence.voxels import Columns, VoxelLayout, count_voxels, grow, within
from hrcjax.sense import Camera
from hrcjax.typing import Array, Bool, Float, Int, UInt, Vector3

BODY = 2
"""Voxels from a measured one within which a part of a body may have moved, or hidden, since the last image."""
REACHED = 20
"""Voxels along which hidden space is followed back to a person in view, or to space for a body: more than an arm's length."""
CORE = 2
"""Hidden space may hold a whole person if some voxel of it is this far from its surface: 25 cm across, a trunk."""
LEAST_LOST = 8
"""Voxels of hidden space that may hold a hand: one litre."""
SURELY = 2.0
"""Voxels are watched if the settled picture shows them free with this many times the usual margin of noise: single images
then do, too."""
MOST_STEPS = 3
"""Voxels by which hidden space grows at one image, at most."""


class Empty(eqx.Module):
    """What the set-up knows of the empty cell."""

    settled: Float[Array, "camera height width"]
    """Depth of the empty cell; 0: not known [m]."""
    sight: Sight
    """Where the voxels appear in each image."""
    watched: Columns
    """Free when the cell was empty, and seen so by a stationary camera."""


class Track(eqx.Module):
    """Where people are, after some images."""

    stamp: Float[Array, "camera"]
    """Exposure of each camera's last good image, or the end of the set-up [s]."""
    time: Float[Array, ""]
    """Exposure of the last image, good or not [s]."""
    sums: Float[Array, "camera voxel 4"]
    """Points of each camera's last good image, by voxel; see `Found`."""
    occupied: UInt[Array, "camera x y"]
    """Voxels in which it showed somebody."""
    sure: UInt[Array, "camera x y"]
    """Those of them beside which somebody had been shown before: not flying pixels of one image."""
    before: UInt[Array, "camera x y"]
    """Voxels before what it measured; see `seen_before`."""
    shadow: UInt[Array, "camera x y"]
    """Voxels behind people whom it shows."""
    screened: UInt[Array, "camera x y"]
    """Voxels behind the robot."""
    blank: UInt[Array, "camera x y"]
    """Voxels on rays that measured nothing, though they did in the empty cell."""
    free: UInt[Array, "camera x y"]
    """Voxels that each camera's last good image saw through."""
    lost: Columns
    """Hidden voxels in which somebody may be who was measured before."""
    growth: Float[Array, ""]
    """Way that hidden space has yet to grow [m]."""
    missing: Bool[Array, ""]
    """True while a camera does not deliver."""
    unsure: Bool[Array, ""]
    """True while somebody may be in hidden space that is not behind people in view."""


def survey_empty(
    layout: VoxelLayout, params: PresenceParams, settled: Float[Array, "camera height width"], sight: Sight
) -> Empty:
    """What the stationary cameras watch, from their settled pictures of the empty cell."""
    watched = union(jax.vmap(lambda s, d: seen_free(layout, params, s, d, SURELY))(sight, settled))
    return Empty(settled, sight, watched)


def union(sets: UInt[Array, "camera x y"], of: Bool[Array, "camera"] | None = None) -> Columns:
    """Voxels that are in any of some sets."""
    chosen = sets if of is None else jnp.where(of[:, None, None], sets, 0)
    return jax.lax.reduce(chosen, jnp.uint32(0), jax.lax.bitwise_or, (0,))


def initial_track(layout: VoxelLayout, cameras: int, time: Float[Array, ""]) -> Track:
    """Nobody has been measured yet; the cameras have just been seen to work, in the set-up."""
    dtype = time.dtype
    return Track(
        stamp=jnp.full((cameras,), time, dtype),
        time=time,
        sums=jnp.zeros((cameras, layout.count, 4), dtype),
        occupied=jnp.zeros((cameras, *layout.shape[:2]), jnp.uint32),
        sure=jnp.zeros((cameras, *layout.shape[:2]), jnp.uint32),
        before=jnp.zeros((cameras, *layout.shape[:2]), jnp.uint32),
        shadow=jnp.zeros((cameras, *layout.shape[:2]), jnp.uint32),
        screened=jnp.zeros((cameras, *layout.shape[:2]), jnp.uint32),
        blank=jnp.zeros((cameras, *layout.shape[:2]), jnp.uint32),
        free=jnp.zeros((cameras, *layout.shape[:2]), jnp.uint32),
        lost=jnp.zeros(layout.shape[:2], jnp.uint32),
        growth=jnp.zeros((), dtype),
        missing=jnp.asarray(False),
        unsure=jnp.asarray(False),
    )


def live_cameras(params: PresenceParams, track: Track, now: Float[Array, ""], period: Array) -> Bool[Array, "camera"]:
    """Cameras whose last good image is not too old.

    Args:
        period: of each camera [s].
    """
    return now - track.stamp < params.late * period


def update_track(
    layout: VoxelLayout,
    params: PresenceParams,
    empty: Empty,
    track: Track,
    index: Int[Array, ""],
    cameras: Camera,
    period: Float[Array, "camera"],
    exposed: Float[Array, ""],
    good: Bool[Array, ""],
    depth: Float[Array, "height width"],
    robot: Float[Array, "height width"],
    box: tuple[Vector3, Vector3],
) -> Track:
    """The track after one image of one camera.

    Args:
        index: of the camera.
        cameras: all, stacked.
        period: of each camera [s].
        exposed: when the image was taken [s].
        good: False: the image is refused, or there is none; time passes all the same.
        depth: measured [m].
        robot: depth at which the robot is expected; infinity where it is not [m].
        box: least and greatest corner of what counts [m].
    """
    depth = jnp.where(jnp.isfinite(depth), depth, 0.0)  # what is not a number is not measured
    camera = jax.tree.map(lambda a: a[index], cameras)
    sight = jax.tree.map(lambda a: a[index], empty.sight)
    before = union(track.occupied)
    found = find_people(layout, params, camera, depth, empty.settled[index], robot, box, before)
    free, shadow = seen_free(layout, params, sight, depth), seen_behind(layout, sight, found.shown)
    robot_shadow = seen_behind(layout, sight, jnp.where(jnp.isfinite(robot), robot, 0.0))
    blank = not_measured(layout, sight, depth, empty.settled[index])
    ahead = seen_before(layout, sight, depth)
    near = grow(layout, before, BODY)
    stamp = track.stamp.at[index].set(jnp.where(good, exposed, track.stamp[index]))
    after = Track(
        stamp=stamp,
        time=exposed,
        sums=track.sums.at[index].set(jnp.where(good, found.sums, track.sums[index])),
        occupied=track.occupied.at[index].set(jnp.where(good, found.occupied, track.occupied[index])),
        sure=track.sure.at[index].set(jnp.where(good, found.occupied & near, track.sure[index])),
        before=track.before.at[index].set(jnp.where(good, ahead, track.before[index])),
        shadow=track.shadow.at[index].set(jnp.where(good, shadow, track.shadow[index])),
        screened=track.screened.at[index].set(jnp.where(good, robot_shadow, track.screened[index])),
        blank=track.blank.at[index].set(jnp.where(good, blank, track.blank[index])),
        free=track.free.at[index].set(jnp.where(good, free, track.free[index])),
        lost=track.lost,
        growth=track.growth,
        missing=track.missing,
        unsure=track.unsure,
    )
    live = live_cameras(params, after, exposed, period)
    missing = ~jnp.all(live)
    hidden = empty.watched & ~union(after.free, live)

    # what was measured and is neither measured nearby now, nor seen through
    reach = grow(layout, union(after.occupied, live), BODY)
    lost = track.lost | (grow(layout, union(track.sure) & ~reach, BODY))
    way = track.growth + params.speed * jnp.maximum(exposed - track.time, 0.0)
    steps = jnp.minimum(jnp.floor(way / layout.edge), MOST_STEPS)
    # behind people in view it does not spread: there they hide parts of themselves, which come into view as they move
    open_to = lost | (hidden & ~union(after.shadow, live))
    lost = jax.lax.fori_loop(
        0, steps.astype(jnp.int32), lambda _, known: grow(layout, known) & open_to & hidden, lost & hidden
    )
    # pockets that hang together with nobody, but through the space behind people in view, have no room for a body, and are
    # not hidden by a failing measurement
    shadow = union(after.shadow, live)
    pockets = lost & ~shadow
    screened = union(after.screened, live)
    body = jax.lax.fori_loop(0, CORE, lambda _, known: within(layout, known), pockets & ~screened)
    near = grow(layout, reach)
    failed = union(after.blank, live) & ~screened
    pockets = jax.lax.fori_loop(
        0, REACHED, lambda _, known: pockets & grow(layout, known), pockets & (near | body | failed)
    )
    behind = lost & shadow
    behind = jax.lax.fori_loop(0, REACHED, lambda _, known: behind & grow(layout, known), behind & (near | pockets))
    lost = pockets | behind
    growth = jnp.minimum(way - steps * layout.edge, layout.edge)
    unsure = count_voxels(pockets) >= LEAST_LOST
    return eqx.tree_at(lambda t: (t.lost, t.growth, t.missing, t.unsure), after, (lost, growth, missing, unsure))
