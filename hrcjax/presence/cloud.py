"""The points that stand for people: what is measured, and the surface of what may be hidden."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.segment import FAR
from hrcjax.presence.params import PresenceParams
from hrcjax.presence.track import BODY, Empty, Track, live_cameras, union
from hrcjax.presence.voxels import VoxelLayout, centres, count_voxels, grow, unpack_columns, within
from hrcjax.sense.points import remove_body
from hrcjax.typing import Array, Bool, Float

CANDIDATES = 3072
"""Voxels among which the nearest to the robot's base are chosen."""


class Presence(eqx.Module):
    """Points of people after an image."""

    cloud: Cloud
    """Mean points of the occupied voxels, and middles of the hidden ones."""
    beyond: Float[Array, "*frame"]
    """Everything that has no point in the cloud is farther from the robot's base than this [m]."""
    lost: Bool[Array, "*frame"]
    """True while somebody may be hidden who was measured before."""


def presence_cloud(
    layout: VoxelLayout,
    params: PresenceParams,
    empty: Empty,
    track: Track,
    period: Float[Array, "camera"],
    robot: Capsules,
    capacity: int,
) -> Presence:
    """The cloud of people, the nearest points to the robot's base first.

    Args:
        robot: the arm, which fills the space that it takes.
        capacity: of the cloud.
    """
    dtype = track.time.dtype
    live = live_cameras(params, track, track.time, period)
    people = union(track.occupied, live)
    behind = grow(layout, people, BODY) & ~union(track.free, live) & empty.watched
    hidden = behind | track.lost
    shell = hidden & ~within(layout, hidden | people) & ~people
    wanted = people | shell

    chosen = jnp.nonzero(unpack_columns(layout, wanted), size=CANDIDATES, fill_value=layout.count)[0]
    there = chosen < layout.count
    rows = track.sums.at[:, chosen].get(mode="fill", fill_value=0)
    row = jnp.sum(jnp.where(live[:, None, None], rows, 0.0), axis=0)
    middle = centres(layout, dtype).at[chosen].get(mode="fill", fill_value=0)
    mean = row[:, 1:] / jnp.maximum(row[:, :1], 1.0)
    occupied = unpack_columns(layout, people).at[chosen].get(mode="fill", fill_value=False)
    points = jnp.where(occupied[:, None], mean, middle)
    # the robot's own space holds nobody
    there = there & (occupied | remove_body(Cloud(points, there), robot, 1.0, 0.0).mask)
    square = jnp.where(there, jnp.sum(points * points, axis=1), jnp.inf)
    negative, best = jax.lax.top_k(-square, min(capacity + 1, CANDIDATES))
    mask = jnp.isfinite(negative[:capacity])
    kept = jnp.where(mask[:, None], points[best[:capacity]], 0.0)
    over = count_voxels(wanted) > CANDIDATES
    beyond = jnp.where(over, 0.0, jnp.sqrt(jnp.where(jnp.isfinite(negative[-1]), -negative[-1], FAR * FAR)))
    return Presence(Cloud(kept, mask), beyond.astype(dtype), jnp.any(track.lost != 0))
