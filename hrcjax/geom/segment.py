"""Distances between points, segments and capsules, in closed form.

Written out in scalars, so that `vmap` turns each into one vector over the batch.
"""

import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.numerics import safe_divide, safe_sqrt
from hrcjax.typing import Array, Float, Scalar, Vector3

FAR = 10.0
"""Distance given for what does not exist [m]: finite, so that sums and derivatives stay finite."""

_Triple = tuple[Array, Array, Array]


def _minus(u: Vector3, v: Vector3) -> _Triple:
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


def _dot(u: _Triple, v: _Triple) -> Array:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _square_to_segment(from_a: _Triple, along: _Triple) -> Array:
    """Squared distance to the segment from 0 to `along` of a point at `from_a`."""
    s = jnp.clip(safe_divide(_dot(from_a, along), _dot(along, along)), 0, 1)
    gap = (from_a[0] - s * along[0], from_a[1] - s * along[1], from_a[2] - s * along[2])
    return _dot(gap, gap)


def point_segment_distance(x: Vector3, a: Vector3, b: Vector3) -> Float[Array, ""]:
    """Distance of a point to the segment from a to b [m]; a and b may coincide. Derivative 0 on the segment itself."""
    return safe_sqrt(_square_to_segment(_minus(x, a), _minus(b, a)))


def segment_segment_distance(a: Vector3, b: Vector3, c: Vector3, d: Vector3) -> Float[Array, ""]:
    """Distance between the segments from a to b and from c to d [m].

    The squared distance is a convex quadratic of the two positions along the segments: its minimum over the unit square
    is the free one, if that lies inside, or lies on an edge, which is a distance of an end to a segment. So it is the
    least of five numbers; parallel and vanishing segments leave only the edges.
    """
    u, v, w = _minus(b, a), _minus(d, c), _minus(a, c)
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    determinant = uu * vv - uv * uv
    crossing = determinant > 1e-6 * uu * vv
    denominator = jnp.where(crossing, determinant, 1)
    s = (uv * vw - vv * uw) / denominator
    t = (uu * vw - uv * uw) / denominator
    inside = crossing & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    gap = (w[0] + s * u[0] - t * v[0], w[1] + s * u[1] - t * v[1], w[2] + s * u[2] - t * v[2])
    edges = jnp.minimum(
        jnp.minimum(_square_to_segment(w, v), _square_to_segment(_minus(b, c), v)),
        jnp.minimum(_square_to_segment(_minus(c, a), u), _square_to_segment(_minus(d, a), u)),
    )
    return safe_sqrt(jnp.where(inside, jnp.minimum(_dot(gap, gap), edges), edges))


def capsule_distance(
    a: Vector3, b: Vector3, radius: Scalar, c: Vector3, d: Vector3, other_radius: Scalar
) -> Float[Array, ""]:
    """Distance between the surfaces of two capsules [m]; negative: they overlap by that much along the line of centres."""
    return segment_segment_distance(a, b, c, d) - radius - other_radius


def capsules_distances(first: Capsules, second: Capsules) -> Float[Array, "capsule other"]:
    """Surface distance of every capsule of one set to every one of another [m]; FAR where either does not exist."""
    n, m = first.radius.shape[0], second.radius.shape[0]
    i, j = jnp.repeat(jnp.arange(n), m), jnp.tile(jnp.arange(m), n)
    apart = jax.vmap(segment_segment_distance)(first.a[i], first.b[i], second.a[j], second.b[j])
    distance = apart - first.radius[i] - second.radius[j]
    exists = (first.radius[i] >= 0) & (second.radius[j] >= 0)
    return jnp.where(exists, distance, FAR).reshape(n, m)


def separation(first: Capsules, second: Capsules) -> Float[Array, ""]:
    """Least surface distance between two sets of capsules [m], as between an arm and a person; FAR if either is empty."""
    return jnp.min(capsules_distances(first, second), initial=FAR)
