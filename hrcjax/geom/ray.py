"""Where one ray meets a solid, in closed form.

A ray is origin + t direction, t >= 0; the direction need not have length 1. Every function gives the least t at which the
ray is in the solid: 0 if it starts inside, infinity if it never meets it. Only what depends on the direction is repeated
when the directions of an image are mapped.
"""

import jax.numpy as jnp

from hrcjax.geom.shape import box_distance, capsule_point_distance, column_distance, local_xy, sphere_distance
from hrcjax.numerics import safe_sqrt
from hrcjax.typing import Array, Float, Scalar, Vector3

_TINY = 1e-12


def _dot(u: Array, v: Array) -> Array:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _first(inside: Array, hit: Array, t: Array) -> Array:
    return jnp.where(inside, 0, jnp.where(hit & (t >= 0), t, jnp.inf))


def _slab(origin: Array, direction: Array, half: Scalar) -> tuple[Array, Array]:
    """When the ray enters and leaves |coordinate| <= half; a direction along the slab gets one that hardly leaves it."""
    step = jnp.where(jnp.abs(direction) < _TINY, _TINY, direction)
    one, two = (-half - origin) / step, (half - origin) / step
    return jnp.minimum(one, two), jnp.maximum(one, two)


def ray_plane(origin: Vector3, direction: Vector3, normal: Vector3, offset: Scalar) -> Float[Array, ""]:
    """Entry into the half space normal . x <= offset."""
    height, rate = _dot(normal, origin) - offset, _dot(normal, direction)
    falls = rate < 0
    return _first(height <= 0, falls, -height / jnp.where(falls, rate, 1))


def ray_sphere(origin: Vector3, direction: Vector3, center: Vector3, radius: Scalar) -> Float[Array, ""]:
    """Entry into a sphere."""
    offset = origin - center
    a, b, c = _dot(direction, direction), _dot(direction, offset), _dot(offset, offset) - radius * radius
    square = b * b - a * c
    return _first(sphere_distance(origin, center, radius) <= 0, square >= 0, (-b - safe_sqrt(square)) / a)


def ray_box(origin: Vector3, direction: Vector3, center: Vector3, half: Vector3, yaw: Scalar = 0.0) -> Float[Array, ""]:
    """Entry into an upright box with half extents `half`, turned by yaw about the vertical."""
    ox, oy = local_xy(origin, center, yaw)
    ux, uy = local_xy(direction, jnp.zeros_like(center), yaw)
    x_in, x_out = _slab(ox, ux, half[0])
    y_in, y_out = _slab(oy, uy, half[1])
    z_in, z_out = _slab(origin[2] - center[2], direction[2], half[2])
    enter = jnp.maximum(jnp.maximum(x_in, y_in), z_in)
    leave = jnp.minimum(jnp.minimum(x_out, y_out), z_out)
    return _first(box_distance(origin, center, half, yaw) <= 0, enter <= leave, enter)


def ray_column(
    origin: Vector3, direction: Vector3, center: Vector3, radius: Scalar, half_height: Scalar
) -> Float[Array, ""]:
    """Entry into an upright cylinder."""
    dx, dy = origin[0] - center[0], origin[1] - center[1]
    a = direction[0] * direction[0] + direction[1] * direction[1]
    b = dx * direction[0] + dy * direction[1]
    c = dx * dx + dy * dy - radius * radius
    square = b * b - a * c
    upright = a < _TINY
    divisor, root = jnp.where(upright, 1, a), safe_sqrt(square)
    mantle_in = jnp.where(upright, -jnp.inf, (-b - root) / divisor)
    mantle_out = jnp.where(upright, jnp.inf, (-b + root) / divisor)
    z_in, z_out = _slab(origin[2] - center[2], direction[2], half_height)
    enter, leave = jnp.maximum(mantle_in, z_in), jnp.minimum(mantle_out, z_out)
    meets = jnp.where(upright, c <= 0, square >= 0)
    return _first(column_distance(origin, center, radius, half_height) <= 0, meets & (enter <= leave), enter)


def ray_capsule(origin: Vector3, direction: Vector3, a: Vector3, b: Vector3, radius: Scalar) -> Float[Array, ""]:
    """Entry into a capsule; infinity for a negative radius, which means no capsule.

    The capsule lies in the endless cylinder about its axis. Where the ray enters that beside the axis' segment, it enters
    the capsule; where it does so beyond an end, it can only enter through that end's ball.
    """
    axis, offset = b - a, origin - a
    aa, au, ao = _dot(axis, axis), _dot(axis, direction), _dot(axis, offset)
    uu, uo, oo = _dot(direction, direction), _dot(direction, offset), _dot(offset, offset)
    p, q, r = aa * uu - au * au, aa * uo - ao * au, aa * oo - ao * ao - radius * radius * aa
    square = q * q - p * r
    parallel = p <= 1e-6 * aa * uu
    t = (-q - safe_sqrt(square)) / jnp.where(parallel, 1, p)
    along = jnp.where(parallel, jnp.where(au > 0, -1, aa + 1), ao + t * au)
    meets = jnp.where(parallel, r <= 0, square >= 0)
    beside = (along > 0) & (along < aa)
    at_a = along <= 0
    ball_b = jnp.where(at_a, uo, uo - au)
    ball_c = jnp.where(at_a, oo, oo - 2 * ao + aa) - radius * radius
    ball = ball_b * ball_b - uu * ball_c
    t = jnp.where(beside, t, (-ball_b - safe_sqrt(ball)) / uu)
    exists = jnp.asarray(radius) >= 0
    inside = exists & (capsule_point_distance(origin, a, b, radius) <= 0)
    return _first(inside, exists & meets & (beside | (ball >= 0)), t)
