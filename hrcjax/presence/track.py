"""Where a person may be, image by image: what is measured, what lies hidden behind it, and what was lost from sight.

A person who was measured and is not measured now stays, and spreads at the assumed speed through everything that no
camera sees, until it is seen through. Space that a camera sees to be free holds nobody. Hidden pockets that hang together
neither with a person in view nor with the outside, and are too small for a whole person, hold nobody either.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.presence.detect import find_people
from hrcjax.presence.params import PresenceParams
from hrcjax.presence.sight import Sight, seen_free
from hrcjax.presence.voxels import VoxelLayout, grow
from hrcjax.sense import Camera
from hrcjax.typing import Array, Bool, Float, Int, Vector3

BODY = 2
"""Voxels by which a body is taken to reach behind and beside its measured surface, where no camera sees that it does not."""
REACHED = 12
"""Voxels along which a hidden pocket is followed back to a person in view or to the outside."""
MOST_STEPS = 3
"""Voxels by which hidden space grows at one image, at most."""


class Empty(eqx.Module):
    """What the set-up knows of the empty cell."""

    settled: Float[Array, "camera height width"]
    """Depth of the empty cell; 0: not known [m]."""
    sight: Sight
    """Where the voxels appear in each image."""
    watched: Bool[Array, "voxel"]
    """Free when the cell was empty, and seen so by a stationary camera."""
    outside: Bool[Array, "voxel"]
    """Not watched, and joined to the sides of the box: people come from there."""


class Track(eqx.Module):
    """Where people are, after some images."""

    stamp: Float[Array, "camera"]
    """Exposure of each camera's last good image; minus infinity: none [s]."""
    time: Float[Array, ""]
    """Exposure of the last image, good or not [s]."""
    sums: Float[Array, "camera voxel 4"]
    """Points of each camera's last good image, see `Found`."""
    free: Bool[Array, "camera voxel"]
    """Voxels that each camera's last good image saw through."""
    lost: Bool[Array, "voxel"]
    """Hidden voxels in which somebody may be who was measured before."""
    growth: Float[Array, ""]
    """Way that hidden space has yet to grow [m]."""
    missing: Bool[Array, ""]
    """True while a camera does not deliver."""


def survey_empty(
    layout: VoxelLayout, params: PresenceParams, settled: Float[Array, "camera height width"], sight: Sight
) -> Empty:
    """What the stationary cameras watch, from their settled pictures of the empty cell."""
    watched = jnp.any(jax.vmap(lambda s, d: seen_free(layout, params, s, d))(sight, settled), axis=0)
    grid = jnp.zeros(layout.shape, bool)
    for axis in (0, 1):
        side = jnp.ones_like(jax.lax.slice_in_dim(grid, 0, 1, axis=axis))
        rest = jnp.zeros_like(jax.lax.slice_in_dim(grid, 0, -2, axis=axis))
        grid = grid | jnp.concatenate([side, rest, side], axis=axis)
    sides = grid.reshape(-1)

    def flood(known: tuple[Array, Array]) -> tuple[Array, Array]:
        more = grow(layout, known[0]) & ~watched
        return more, jnp.any(more != known[0])

    outside, _ = jax.lax.while_loop(lambda known: known[1], flood, (sides & ~watched, jnp.asarray(True)))
    # a person at the border of the box is outside, too
    return Empty(settled, sight, watched, outside | (sides & watched))


def initial_track(layout: VoxelLayout, cameras: int, time: Float[Array, ""]) -> Track:
    """Nobody has been measured yet, and no image is there."""
    dtype = time.dtype
    return Track(
        stamp=jnp.full((cameras,), -jnp.inf, dtype),
        time=time,
        sums=jnp.zeros((cameras, layout.count, 4), dtype),
        free=jnp.zeros((cameras, layout.count), bool),
        lost=jnp.zeros((layout.count,), bool),
        growth=jnp.zeros((), dtype),
        missing=jnp.asarray(False),
    )


def measured(track: Track, live: Bool[Array, "camera"]) -> Bool[Array, "voxel"]:
    """Voxels in which a live camera's last image shows somebody."""
    return jnp.any((track.sums[:, :, 0] > 0) & live[:, None], axis=0)


def beside(layout: VoxelLayout, people: Bool[Array, "voxel"]) -> Bool[Array, "voxel"]:
    """The measured voxels with those `BODY` voxels about them."""
    for _ in range(BODY):
        people = grow(layout, people)
    return people


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
    camera = jax.tree.map(lambda a: a[index], cameras)
    sight = jax.tree.map(lambda a: a[index], empty.sight)
    ever = jnp.isfinite(track.stamp)
    before = measured(track, ever)
    found = find_people(layout, params, camera, depth, empty.settled[index], robot, box, before)
    free = seen_free(layout, params, sight, depth)
    stamp = track.stamp.at[index].set(jnp.where(good, exposed, track.stamp[index]))
    after = Track(
        stamp=stamp,
        time=exposed,
        sums=track.sums.at[index].set(jnp.where(good, found.sums, track.sums[index])),
        free=track.free.at[index].set(jnp.where(good, free, track.free[index])),
        lost=track.lost,
        growth=track.growth,
        missing=track.missing,
    )
    live = live_cameras(params, after, exposed, period)
    clear = jnp.any(after.free & live[:, None], axis=0)
    people = measured(after, live)
    missing = ~jnp.all(live)
    hidden = empty.watched & ~clear

    # what was measured and is neither measured nearby now, nor seen through
    reach = beside(layout, people)
    lost = track.lost | (before & ~reach)
    # while a camera is missing, somebody may come in where the others do not look
    lost = lost | (missing & empty.outside)
    growth = track.growth + params.speed * jnp.maximum(exposed - track.time, 0.0)
    for _ in range(MOST_STEPS):
        step = growth >= layout.edge
        lost = lost | (step & grow(layout, lost))
        growth = jnp.where(step, growth - layout.edge, growth)
    lost = lost & hidden
    # hidden pockets that hang together with nobody
    anchored = lost & (grow(layout, reach) | grow(layout, empty.outside))
    for _ in range(REACHED):
        anchored = lost & grow(layout, anchored)
    large = jnp.sum(lost, dtype=exposed.dtype) > params.whole
    lost = lost & (anchored | large)
    return eqx.tree_at(
        lambda t: (t.lost, t.growth, t.missing), after, (lost, jnp.minimum(growth, layout.edge), missing)
    )
