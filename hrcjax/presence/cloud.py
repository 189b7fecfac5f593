"""The points that stand for people: what is measured, and the surface of what may be hidden."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.segment import FAR
from hrcjax.presence.params import PresenceParams
from hrcjax.presence.track import Empty, Track, live_cameras, union
from hrcjax.presence.voxels import Columns, VoxelLayout, beside, centres, pack_columns, unpack_columns, voxel_of, within
from hrcjax.sense.points import remove_body
from hrcjax.typing import Array, Bool, Float

COARSE_FROM = 1.1
"""Distance from the robot's base beyond which 2 x 2 x 2 voxels share a point, farther than the arm reaches [m]."""
ALONG = 9
"""Points along the axis of each capsule of the robot at which hidden space is looked for."""
NEAR_CANDIDATES, FAR_CANDIDATES = 1536, 1024
"""Fine and coarse points, among which the nearest to the base are chosen."""

ON_LATTICE = 0.01
"""A coordinate is that of a voxel's middle up to this share of half an edge [1]."""


class Presence(eqx.Module):
    """Points of people after an image."""

    cloud: Cloud
    """Mean points of the occupied voxels, and middles of the hidden ones."""
    beyond: Float[Array, "*frame"]
    """Everything that has no point in the cloud is farther from the robot's base than this [m]."""
    lost: Bool[Array, "*frame"]
    """True while somebody may be hidden, not only behind people in view, who was measured before."""


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
    behind = beside(layout, people) & ~union(track.before, live) & empty.watched
    hidden = behind | track.lost
    shell = hidden & ~within(layout, hidden | people) & ~people
    near = pack_columns(layout, jnp.sum(centres(layout, dtype) ** 2, axis=1) < COARSE_FROM**2)
    fine = _points(layout, track, live, people, (people | shell) & near, 1, NEAR_CANDIDATES)
    coarse = _points(layout, track, live, people, (people | shell) & ~near, 2, FAR_CANDIDATES)
    points, occupied, there, space = (jnp.concatenate(pair) for pair in zip(fine[:4], coarse[:4], strict=True))
    over = fine[4] | coarse[4]
    # the robot's own space holds nobody
    there = there & (occupied | remove_body(Cloud(points, there), robot, 1.0, 0.0).mask)
    square = jnp.where(there, jnp.sum(points * points, axis=1), jnp.inf)
    negative, best = jax.lax.top_k(-square, min(capacity, square.size))
    mask = jnp.isfinite(negative)
    kept = jnp.where(mask[:, None], points[best], 0.0)
    # whoever has no point is somewhere in the voxels that have none
    beyond = jnp.min(jnp.where(there.at[best].set(False), space, FAR), initial=FAR)
    # within hidden space the nearest of its surface would be the way out
    share = jnp.linspace(0.0, 1.0, ALONG).astype(dtype)[:, None, None]
    axes = robot.a + share * (robot.b - robot.a)
    inside = unpack_columns(layout, track.lost).at[voxel_of(layout, axes)].get(mode="fill", fill_value=False)
    inside = jnp.any(inside & (robot.radius >= 0))
    over = over | (inside & track.unsure)
    return Presence(Cloud(kept, mask), jnp.where(over, 0.0, beyond).astype(dtype), track.unsure)


def were_measured(layout: VoxelLayout, points: Float[Array, "point 3"]) -> Bool[Array, "point"]:
    """Which points of a cloud were measured. Hidden space has the middles of its voxels; a mean of pixels is there by a rare chance."""
    halves = (points - jnp.asarray(layout.lower, points.dtype)) * (2.0 / layout.edge)
    return jnp.any(jnp.abs(halves - jnp.round(halves)) > ON_LATTICE, axis=-1)


def _points(
    layout: VoxelLayout, track: Track, live: Array, people: Columns, wanted: Columns, merge: int, most: int
) -> tuple[Array, Array, Array, Array, Array]:
    """A point for each cube of `merge` voxels of a set: the mean of what was measured in it, else its middle.

    Returns:
        the points [m], whether they were measured, whether they exist, the distance of their cubes from the robot's base [m],
        and whether there were more than `most`.
    """
    dtype, shape = track.time.dtype, layout.shape

    def cubes(columns: Columns) -> Bool[Array, "i j k"]:
        grid = unpack_columns(layout, columns).reshape(shape)
        split = grid.reshape(shape[0] // merge, merge, shape[1] // merge, merge, shape[2] // merge, merge)
        return jnp.any(split, axis=(1, 3, 5))

    filled = cubes(wanted)
    x, y, z = jnp.nonzero(filled, size=most, fill_value=-1)
    there = x >= 0
    corner = jnp.stack([x, y, z], axis=-1) * merge
    steps = jnp.stack(jnp.meshgrid(*[jnp.arange(merge)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cell = jnp.maximum(corner[:, None] + steps, 0)
    index = (cell[..., 0] * shape[1] + cell[..., 1]) * shape[2] + cell[..., 2]
    shown = unpack_columns(layout, people)[index]
    rows = jnp.sum(jnp.where(live[:, None, None, None], track.sums[:, index], 0.0), axis=0)
    row = jnp.sum(jnp.where(shown[..., None], rows, 0.0), axis=1)
    measured = there & (row[:, 0] > 0)
    middle = jnp.asarray(layout.lower, dtype) + layout.edge * (corner.astype(dtype) + 0.5 * merge)
    points = jnp.where(measured[:, None], row[:, 1:] / jnp.maximum(row[:, :1], 1.0), middle)
    nearest = jnp.maximum(jnp.abs(middle) - 0.5 * merge * layout.edge, 0.0)
    return points, measured, there, jnp.sqrt(jnp.sum(nearest * nearest, axis=1)), jnp.sum(filled) > most
