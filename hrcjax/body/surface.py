"""Points against the surface of a body: signed distances, and their slopes by the joints, in closed form."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.body.skeleton import PARTS, part_capsules
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
    over_square = safe_divide(jnp.ones_like(capsules.radius), jnp.sum(axis * axis, axis=1))
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    least, part, along = jnp.full_like(x, jnp.inf), jnp.zeros(x.shape, jnp.int32), jnp.zeros_like(x)
    for k in range(len(PARTS)):  # vectors over the points, part after part: an argmin is no vector operation
        a, way = capsules.a[k], axis[k]
        ox, oy, oz = x - a[0], y - a[1], z - a[2]
        share = jnp.clip((ox * way[0] + oy * way[1] + oz * way[2]) * over_square[k], 0, 1)
        square = (ox - share * way[0]) ** 2 + (oy - share * way[1]) ** 2 + (oz - share * way[2]) ** 2
        signed = jnp.sqrt(jnp.maximum(square, 1e-12)) - capsules.radius[k]
        less = signed < least
        least, part, along = jnp.where(less, signed, least), jnp.where(less, k, part), jnp.where(less, share, along)
    gap = points - capsules.a[part] - along[:, None] * axis[part]
    size = safe_norm(gap)
    return Near(size - capsules.radius[part], part, along, safe_divide(gap, size[:, None]))


def distance_slopes(near: Near) -> Float[Array, "point 7"]:
    """Slopes of the distances by both ends of the nearest part, three coordinates each, and by its radius; `PART_UNKNOWNS` tells which
    unknowns these are.

    The nearest place of the axis may move along it, but to first order the distance does not change with that: the slope by an end
    of the axis is its share in the place times minus the normal.
    """
    along = near.along[:, None]
    return -jnp.concatenate([(1.0 - along) * near.normal, along * near.normal, jnp.ones_like(along)], axis=1)
