"""Distance and gradient of a field in one pass over its training points.

The squared-exponential kernel has closed forms: with c the mean of the points under the weights alpha_i k_i,
grad(d^2 / 2) = x - c. They are held equal to autodiff of `distance` by a test. Written for one point; under `vmap`
keep the (query, training point) exponentials within the cache: some 100 to 1,000 queries at a time, for example
`jax.lax.map(f, x, batch_size=128)`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.field.gp import FAR, GPField, distance, has_digits, log_signed
from hrcjax.field.kernel import SQUARED_EXPONENTIAL, blended_root, blended_root_slope
from hrcjax.field.moments import kernel_moments
from hrcjax.typing import Array, Bool, Float, Matrix3, Vector3


class Part(eqx.Module):
    """What one field of squared exponentials says at a point."""

    log_occupancy: Float[Array, ""]
    """Logarithm of the occupancy [1]."""
    offset: Vector3
    """From the weighted mean of the training points to the query [m]."""
    some: Bool[Array, ""]
    """True where the field has points."""


def part(field: GPField, x: Vector3) -> Part:
    """Log-occupancy and mean offset of a field of squared exponentials at x."""
    mask = field.mask[:, None]
    count = jnp.maximum(jnp.sum(field.mask.astype(field.points.dtype)), 1.0)
    # Positions about the mean of the points: fewer digits lost in the moments. A constant: it cancels in all results.
    origin = jax.lax.stop_gradient(jnp.sum(jnp.where(mask, field.points, 0.0), axis=0) / count)
    points = jnp.where(mask, field.points - origin, 0.0)
    sets = [field.weights, jnp.abs(field.weights)] if field.signed else [field.weights]
    precision = 0.5 / field.length_scale**2
    nearest, sums, firsts = kernel_moments(x - origin, points, field.mask, jnp.stack(sets, axis=1), precision)
    log_sum, total, first = log_signed(sums[0], sums[-1]), sums[0], firsts[0]
    if field.signed:
        kept = has_digits(sums[0], sums[1])
        total, first = jnp.where(kept, total, sums[1]), jnp.where(kept, first, firsts[1])
    mean = first / jnp.where(total > 0, total, 1.0)
    return Part(log_sum - precision * nearest, x - origin - mean, jnp.any(field.mask))


def read(
    log_o: Float[Array, ""], offset: Vector3, some: Bool[Array, ""], length_scale: Float[Array, ""]
) -> tuple[Float[Array, ""], Vector3]:
    """Distance [m] and gradient [1] from the logarithm of the occupancy and its gradient, -offset / l^2."""
    v = -2.0 * log_o  # (d / l)^2
    d = length_scale * blended_root(v)
    g = (2.0 * blended_root_slope(v) / length_scale) * offset  # far from a surface (x - c) / d
    return jnp.where(some, d, FAR), jnp.where(some, g, 0.0)


def distance_and_gradient(field: GPField, x: Vector3) -> tuple[Float[Array, ""], Vector3]:
    """`distance` and its gradient at x in one pass [m], [1]. Any kernel; closed form for the squared exponential."""
    if field.kernel is not SQUARED_EXPONENTIAL:
        return jax.value_and_grad(distance, argnums=1)(field, x)
    one = part(field, x)
    return read(one.log_occupancy, one.offset, one.some, field.length_scale)


def hessian(field: GPField, x: Vector3) -> Matrix3:
    """Hessian of `distance` at x [1/m]: the derivative of the gradient of `distance_and_gradient`."""
    return jax.jacfwd(lambda at: distance_and_gradient(field, at)[1])(x)
