"""Points against the surface of a body: signed distances, and their slopes by the joints, in closed form."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.body.skeleton import END_A, END_B, PART_RADIUS, RADIUS_NAMES, part_capsules
from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.typing import Array, Float, Int, Points


class Near(NamedTuple):
    """The nearest part of the body to every point."""

    distance: Float[Array, "point"]
    """Signed distance to its surface; negative inside [m]."""
    part: Int[Array, "point"]
    """Index into `PARTS`."""
    along: Float[Array, "point"]
    """Where on its axis the nearest place is, from 0 to 1 [1]."""
    normal: Float[Array, "point 3"]
    """Unit direction from there to the point; 0 on the axis [1]."""


def nearest_parts(joints: Float[Array, "joint 3"], radii: Float[Array, "radius"], points: Points) -> Near:
    """The part with the least signed distance, for every point."""
    capsules = part_capsules(joints, radii)
    axis = capsules.b - capsules.a
    length = jnp.sum(axis * axis, axis=1)
    # (point part) arrays, one coordinate at a time: they vectorise over points and parts
    off = [points[:, None, c] - capsules.a[None, :, c] for c in range(3)]
    share = off[0] * axis[:, 0] + off[1] * axis[:, 1] + off[2] * axis[:, 2]
    along = jnp.clip(safe_divide(share, length[None, :]), 0, 1)
    square = (
        (off[0] - along * axis[:, 0]) ** 2 + (off[1] - along * axis[:, 1]) ** 2 + (off[2] - along * axis[:, 2]) ** 2
    )
    signed = jnp.sqrt(jnp.maximum(square, 1e-12)) - capsules.radius
    part = jnp.argmin(signed, axis=1).astype(jnp.int32)
    rows = jnp.arange(points.shape[0])
    along = along[rows, part]
    gap = points - capsules.a[part] - along[:, None] * axis[part]
    size = safe_norm(gap)
    return Near(size - capsules.radius[part], part, along, safe_divide(gap, size[:, None]))


def distance_slopes(near: Near) -> Float[Array, "point unknown"]:
    """Slopes of the distances by all joints (joint 3), then by the radii.

    The nearest place of the axis may move along it, but to first order the distance does not change with that: the slope by an end
    of the axis is its share in the place times minus the normal.
    """
    dtype = near.distance.dtype
    a, b = jnp.asarray(END_A, dtype)[near.part], jnp.asarray(END_B, dtype)[near.part]
    share = a + near.along[:, None] * (b - a)
    of_joints = -share[:, :, None] * near.normal[:, None, :]
    radius = jnp.asarray(PART_RADIUS)[near.part]
    of_radii = -(radius[:, None] == jnp.arange(len(RADIUS_NAMES))).astype(dtype)
    return jnp.concatenate([of_joints.reshape(of_joints.shape[0], -1), of_radii], axis=1)
