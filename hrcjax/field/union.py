"""Two fields read at once: everything, and the moving part alone, from one exponential per pair of points."""

import jax
import jax.numpy as jnp

from hrcjax.field.closed_form import distance_and_gradient, part, read
from hrcjax.field.gp import FAR, GPField, log_occupancy
from hrcjax.field.kernel import SQUARED_EXPONENTIAL, Kernel
from hrcjax.typing import Array, Float, Vector3


def _same_kernel(a: GPField, b: GPField) -> Kernel:
    if a.kernel is not b.kernel:
        raise ValueError(f"union: kernels {a.kernel.name!r} and {b.kernel.name!r}; accepted: two fields of one kernel")
    return a.kernel


def union_distance(a: GPField, b: GPField, x: Vector3) -> Float[Array, ""]:
    """Distance to the surfaces of both fields, whose occupancies add [m]. Both must have the length scale of `a`.

    Raises:
        ValueError: the kernels differ.
    """
    kernel = _same_kernel(a, b)
    some = jnp.any(a.mask) | jnp.any(b.mask)
    log_o = jnp.where(some, jnp.logaddexp(log_occupancy(a, x), log_occupancy(b, x)), -1.0)
    return jnp.where(some, a.length_scale * kernel.distance(log_o), FAR)


def union_distance_and_gradient(
    static: GPField, moving: GPField, x: Vector3
) -> tuple[Float[Array, ""], Vector3, Float[Array, ""], Vector3]:
    """Distance and gradient of both fields together, and of the moving one alone, from one exponential per pair.

    The two must have been fitted with one kernel and one length scale; their occupancies add, so that where both are
    near the union is nearer than either. A field without points adds nothing.

    Returns:
        d_all, g_all: distance to everything [m] and its gradient [1].
        d_moving, g_moving: the same for the moving part.

    Raises:
        ValueError: the kernels differ.
    """
    if _same_kernel(static, moving) is not SQUARED_EXPONENTIAL:
        d_all, g_all = jax.value_and_grad(union_distance, argnums=2)(static, moving, x)
        return d_all, g_all, *distance_and_gradient(moving, x)
    s, m = part(static, x), part(moving, x)
    log_all = jnp.logaddexp(s.log_occupancy, m.log_occupancy)
    share_s, share_m = jnp.exp(s.log_occupancy - log_all), jnp.exp(m.log_occupancy - log_all)
    offset = share_s * s.offset + share_m * m.offset
    d_all, g_all = read(log_all, offset, s.some | m.some, static.length_scale)
    d_moving, g_moving = read(m.log_occupancy, m.offset, m.some, moving.length_scale)
    return d_all, g_all, d_moving, g_moving
