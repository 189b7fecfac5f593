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


def _outer(a: Float[Array, "point m"], b: Float[Array, "point n"]) -> Float[Array, "point m*n"]:
    return (a[:, :, None] * b[:, None, :]).reshape(a.shape[0], -1)


def kernel_moments_plain(
    x: Vector3, points: Points, mask: Mask, weights: Float[Array, "point w"], precision: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, "w"], Float[Array, "w 3"]]:
    """The definition of `kernel_moments`, without its derivative."""
    nearest, k = _kernels(x, points, mask, precision)
    w = weights.shape[1]
    sums = k @ jnp.concatenate([weights, _outer(weights, points)], axis=1)
    return nearest, sums[:w], sums[w:].reshape(w, 3)


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
    w = weights.shape[1]
    nearest, k = _kernels(x, points, mask, precision)

    def total(columns: Array) -> Array:
        return k @ columns

    wp = _outer(weights, points)
    columns = [weights, wp, _outer(wp, points)]
    scaled = not isinstance(precision_dot, SymbolicZero)
    if scaled:
        square = jnp.sum(points * points, axis=1)[:, None]
        columns += [weights * square, wp * square]
    sums = total(jnp.concatenate(columns, axis=1))
    # moments of order 0, 1 and 2
    s0, s1, s2 = sums[:w], sums[w : 4 * w].reshape(w, 3), sums[4 * w : 13 * w].reshape(w, 3, 3)

    d0, d1 = jnp.zeros_like(s0), jnp.zeros_like(s1)
    if not isinstance(x_dot, SymbolicZero):  # dk = -2 precision k (x - x_i) . dx
        along = jnp.sum(x * x_dot)
        d0 = d0 - 2.0 * precision * (s0 * along - jnp.sum(s1 * x_dot, axis=-1))
        d1 = d1 - 2.0 * precision * (s1 * along - jnp.sum(s2 * x_dot, axis=-1))
    if scaled:  # dk = k (nearest - r^2) dprecision
        q0, q1 = sums[13 * w : 14 * w], sums[14 * w :].reshape(w, 3)  # of order 0 and 1, weighted by |x_i|^2
        shift = nearest - jnp.sum(x * x)
        d0 = d0 + precision_dot * (shift * s0 + 2.0 * jnp.sum(s1 * x, axis=-1) - q0)
        d1 = d1 + precision_dot * (shift * s1 + 2.0 * jnp.sum(s2 * x, axis=-1) - q1)
    if not isinstance(weights_dot, SymbolicZero):
        change = total(jnp.concatenate([weights_dot, _outer(weights_dot, points)], axis=1))
        d0, d1 = d0 + change[:w], d1 + change[w:].reshape(w, 3)
    if not isinstance(points_dot, SymbolicZero):  # dk = 2 precision k (x - x_i) . dx_i
        wpd = _outer(weights, points_dot)
        along_points = weights * jnp.sum(points * points_dot, axis=1)[:, None]
        change = total(
            jnp.concatenate([wpd, along_points, _outer(wp, points_dot), _outer(along_points, points)], axis=1)
        )
        c1, c0 = change[: 3 * w].reshape(w, 3), change[3 * w : 4 * w]
        c2, cq = change[4 * w : 13 * w].reshape(w, 3, 3), change[13 * w :].reshape(w, 3)
        d0 = d0 + 2.0 * precision * (jnp.sum(c1 * x, axis=-1) - c0)
        d1 = d1 + c1 + 2.0 * precision * (jnp.sum(c2 * x, axis=-1) - cq)
    return (nearest, s0, s1), (jnp.zeros_like(nearest), d0, d1)


kernel_moments.defjvp(_kernel_moments_jvp, symbolic_zeros=True)
