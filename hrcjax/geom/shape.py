"""Exact signed distances of one point to solids: negative inside, continuous, with a full gradient on the surface."""

import math

import jax
import jax.numpy as jnp

from hrcjax.geom.segment import point_segment_distance
from hrcjax.numerics import safe_norm, safe_sqrt
from hrcjax.typing import Array, DistanceFn, Float, Scalar, Vector3

_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def sphere_distance(x: Vector3, center: Vector3, radius: Scalar) -> Float[Array, ""]:
    """Signed distance to a sphere [m]. Gradient 0 at its centre."""
    return safe_norm(x - center) - radius


def plane_distance(x: Vector3, normal: Vector3, offset: Scalar) -> Float[Array, ""]:
    """Height over the plane normal . x = offset [m], for a normal of length 1."""
    return x @ normal - offset


def capsule_point_distance(x: Vector3, a: Vector3, b: Vector3, radius: Scalar) -> Float[Array, ""]:
    """Signed distance to a capsule [m]. Gradient 0 on its axis."""
    return point_segment_distance(x, a, b) - radius


def _from_excess(excess: tuple[Array, ...]) -> Array:
    """Distance of an intersection of slabs at right angles from how far the point lies beyond each of them."""
    deepest = excess[0]
    square = jnp.maximum(excess[0], 0) ** 2
    for e in excess[1:]:
        deepest = jnp.maximum(deepest, e)
        square = square + jnp.maximum(e, 0) ** 2
    return jnp.where(deepest > 0, safe_sqrt(square), deepest)


def local_xy(x: Vector3, center: Vector3, yaw: Scalar) -> tuple[Array, Array]:
    """The horizontal offset from `center` along a body's own x and y axes, which are turned by yaw [m]."""
    c, s = jnp.cos(yaw), jnp.sin(yaw)
    dx, dy = x[0] - center[0], x[1] - center[1]
    return c * dx + s * dy, c * dy - s * dx


def box_distance(x: Vector3, center: Vector3, half: Vector3, yaw: Scalar = 0.0) -> Float[Array, ""]:
    """Signed distance to an upright box with half extents `half`, turned by yaw about the vertical [m, rad]."""
    px, py = local_xy(x, center, yaw)
    return _from_excess((jnp.abs(px) - half[0], jnp.abs(py) - half[1], jnp.abs(x[2] - center[2]) - half[2]))


def column_distance(x: Vector3, center: Vector3, radius: Scalar, half_height: Scalar) -> Float[Array, ""]:
    """Signed distance to an upright cylinder [m]. Gradient 0 on the axis where the mantle is nearest."""
    dx, dy = x[0] - center[0], x[1] - center[1]
    return _from_excess((safe_sqrt(dx * dx + dy * dy) - radius, jnp.abs(x[2] - center[2]) - half_height))


def segment_convex_distance(a: Vector3, b: Vector3, distance: DistanceFn, steps: int = 24) -> Float[Array, ""]:
    """Least value of a convex signed distance along the segment from a to b [m].

    Golden section: the signed distance of a convex solid is convex along any line, inside too. The error is at most
    |b - a| 0.618^steps. The place of the minimum carries no derivative, which leaves the derivative of the least value
    right (envelope theorem); its second derivative is not.
    """
    start, end = jax.lax.stop_gradient(a), jax.lax.stop_gradient(b)

    def at(s: Array) -> Array:
        return jax.lax.stop_gradient(distance(start + s * (end - start)))

    def shrink(_: Array, state: tuple[Array, ...]) -> tuple[Array, ...]:
        low, high, s, t, at_s, at_t = state
        left = at_s <= at_t
        low, high = jnp.where(left, low, s), jnp.where(left, t, high)
        fresh = jnp.where(left, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        value = at(fresh)
        s, t = jnp.where(left, fresh, t), jnp.where(left, s, fresh)
        at_s, at_t = jnp.where(left, value, at_t), jnp.where(left, at_s, value)
        return low, high, s, t, at_s, at_t

    zero = jnp.zeros_like(start[0])
    s, t = zero + (1 - _GOLDEN), zero + _GOLDEN
    state = (zero, zero + 1, s, t, at(s), at(t))
    _, _, s, t, at_s, at_t = jax.lax.fori_loop(0, steps, shrink, state)
    best, least = jnp.where(at_s <= at_t, s, t), jnp.minimum(at_s, at_t)
    best = jnp.where(at(zero) <= least, zero, jnp.where(at(zero + 1) <= least, zero + 1, best))
    best = jax.lax.stop_gradient(best)
    return distance(a + best * (b - a))
