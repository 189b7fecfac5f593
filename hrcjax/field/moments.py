"""Sums of squared-exponential kernels and of their positions: one exponential per pair, and a cheap derivative.

This is the hot spot of the package. Written for one query point; under `vmap` over queries that share their training
points, the sums become one matrix product of the (query, training point) exponentials with a few columns. Derivatives
with respect to the query and to the length scale need only further columns of the same product, so that forward and
reverse mode cost little more than the value.
"""

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero

from hrcjax.typing import Array, Float, Mask, Points, Vector3

ELSEWHERE = 1e3
"""Where points that do not exist are put, on every axis: cheaper than a mask on each pair [m]."""

LEAST_EXPONENT = -60.0
"""Exponents are cut off here: e^-60 is nothing beside 1 in either precision, and denormal numbers are slow [1]."""


def _kernels(
    x: Vector3, points: Points, mask: Mask, precision: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, "point"]]:
    """Smallest squared distance [m^2], taken as a constant, and the kernels divided by the largest of them [1]."""
    placed = jnp.where(mask[:, None], points, ELSEWHERE)
    # component by component: an array of (query, point, 3) would be several times slower
    dx, dy, dz = placed[:, 0] - x[0], placed[:, 1] - x[1], placed[:, 2] - x[2]
    r2 = dx * dx + dy * dy + dz * dz
    nearest = jax.lax.stop_gradient(jnp.min(r2))
    return nearest, jnp.exp(jnp.maximum(precision * (nearest - r2), LEAST_EXPONENT))


def _sums(
    k: Float[Array, "point"], weights: Float[Array, "point w"], columns: Float[Array, "point column"]
) -> Float[Array, "w column"]:
    """Weighted sums of columns. The weights go to the kernels, so that columns which queries and settings share are one factor of
    a product of matrices, whatever the weights are."""
    return jnp.stack([(k * weights[:, i]) @ columns for i in range(weights.shape[1])])


def _with_one(points: Points) -> Float[Array, "point 4"]:
    return jnp.concatenate([jnp.ones_like(points[:, :1]), points], axis=1)


def _squares(points: Points) -> Float[Array, "point 9"]:
    return (points[:, :, None] * points[:, None, :]).reshape(-1, 9)


def kernel_moments_plain(
    x: Vector3, points: Points, mask: Mask, weights: Float[Array, "point w"], precision: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, "w"], Float[Array, "w 3"]]:
    """The definition of `kernel_moments`, without its derivative."""
    nearest, k = _kernels(x, points, mask, precision)
    sums = _sums(k, weights, _with_one(points))
    return nearest, sums[:, 0], sums[:, 1:]


@jax.custom_jvp
def kernel_moments(
    x: Vector3, points: Points, mask: Mask, weights: Float[Array, "point w"], precision: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, "w"], Float[Array, "w 3"]]:
    """Sums over the training points of w_i k_i and of w_i k_i x_i, with k_i = exp(precision (nearest - r_i^2)).

    Args:
        x: query [m], near the origin of the points: the second moment loses digits with the square of the distance.
        points: training points [m].
        mask: which of them exist.
        weights: some sets of weights, 0 where the mask is False [1].
        precision: 1 / (2 l^2) [1/m^2].

    Returns:
        nearest: smallest r_i^2 [m^2]; over a million if no point exists. Its derivative is 0 by definition: it is a
            shift that cancels in whatever is made of the sums, if exp(-precision nearest) is put back.
        sums, first moments: [1], [m].
    """
    return kernel_moments_plain(x, points, mask, weights, precision)


def _kernel_moments_jvp(primals, tangents):
    x, points, mask, weights, precision = primals
    x_dot, points_dot, _, weights_dot, precision_dot = tangents
    nearest, k = _kernels(x, points, mask, precision)
    sums = _sums(k, weights, _with_one(points))
    s0, s1 = sums[:, 0], sums[:, 1:]

    # what the sums need is apart from this, so that a value alone does not compute it
    d0, d1 = jnp.zeros_like(s0), jnp.zeros_like(s1)
    if not isinstance(x_dot, SymbolicZero):  # dk = -2 precision k (x - x_i) . dx
        s2 = _sums(k, weights, _squares(points)).reshape(-1, 3, 3)
        along = jnp.sum(x * x_dot)
        d0 = d0 - 2.0 * precision * (s0 * along - jnp.sum(s1 * x_dot, axis=-1))
        d1 = d1 - 2.0 * precision * (s1 * along - jnp.sum(s2 * x_dot, axis=-1))
    if not isinstance(precision_dot, SymbolicZero):  # dk = k (nearest - r^2) dprecision, r^2 by its definition
        away = jnp.sum((jnp.where(mask[:, None], points, 0.0) - x) ** 2, axis=1)
        change = _sums(k * (nearest - away), weights, _with_one(points))
        d0, d1 = d0 + precision_dot * change[:, 0], d1 + precision_dot * change[:, 1:]
    if not isinstance(weights_dot, SymbolicZero):
        change = _sums(k, weights_dot, _with_one(points))
        d0, d1 = d0 + change[:, 0], d1 + change[:, 1:]
    if not isinstance(points_dot, SymbolicZero):  # dk = 2 precision k (x - x_i) . dx_i
        towards = 2.0 * precision * (jnp.sum(points_dot * x, axis=1) - jnp.sum(points_dot * points, axis=1))
        change = _sums(k * towards, weights, _with_one(points))
        d0 = d0 + change[:, 0]
        d1 = d1 + change[:, 1:] + _sums(k, weights, points_dot)
    return (nearest, s0, s1), (jnp.zeros_like(nearest), d0, d1)


kernel_moments.defjvp(_kernel_moments_jvp, symbolic_zeros=True)
