"""Covariance functions of a distance field, in log form, and their inverses.

With r the distance between two points and l the length scale, v = (r / l)^2. A kernel is written as log k(v), so that
sums of kernels are log-sum-exps that neither overflow nor underflow, and its inverse takes the logarithm of the
occupancy to a distance in length scales.

| kernel | k(r) | distance from the occupancy o |
|---|---|---|
| squared exponential | exp(-r^2 / 2 l^2) | l sqrt(-2 ln o) |
| rational quadratic | (1 + r^2 / (2 b l^2))^-b | l sqrt(2 b (o^(-1/b) - 1)) |
| Matern 1/2 | exp(-r / l) | -l ln o |
| Matern 3/2 | (1 + t) e^-t, t = sqrt(3) r / l | l t / sqrt(3), t = -1 - W(-o / e), W of branch -1 |
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt
from hrcjax.typing import Array, Float

ROOT_BLEND = 0.2
"""The square root of the inverses is bent to 0 below this many length scales [1]."""


@dataclass(frozen=True)
class Kernel:
    """A covariance function of the distance: two pure functions, nothing else."""

    name: str
    """Name for messages."""
    log: Callable[[Float[Array, "..."]], Float[Array, "..."]]
    """Squared distance over squared length scale [1] -> logarithm of the covariance [1]."""
    distance: Callable[[Float[Array, "..."]], Float[Array, "..."]]
    """Logarithm of the occupancy [1] -> distance over length scale [1]; 0 where the occupancy is 1 or more."""


def blended_root(v: Float[Array, "..."]) -> Float[Array, "..."]:
    """Square root of v [1], exact above ROOT_BLEND^2, below it the parabola through 0 with the same value and slope.

    The slope stays at most 1.5 / ROOT_BLEND, so that the gradient of a distance goes to 0 at a surface instead of
    growing without bound. Never above sqrt(v). 0 with slope 0 where v <= 0.
    """
    exact = v > ROOT_BLEND**2
    t = jnp.clip(v / ROOT_BLEND**2, 0.0, 1.0)
    below = ROOT_BLEND * t * (1.5 - 0.5 * t)
    return jnp.where(v <= 0, 0.0, jnp.where(exact, jnp.sqrt(jnp.where(exact, v, 1.0)), below))


def blended_root_slope(v: Float[Array, "..."]) -> Float[Array, "..."]:
    """Derivative of `blended_root` [1]."""
    exact = v > ROOT_BLEND**2
    below = (1.5 - v / ROOT_BLEND**2) / ROOT_BLEND
    slope = jnp.where(exact, 0.5 / jnp.sqrt(jnp.where(exact, v, 1.0)), below)
    return jnp.where(v <= 0, 0.0, slope)


def _rounded(v: Float[Array, "..."]) -> Float[Array, "..."]:
    """|v| without its kink: sqrt(v^2 + e^2), e = ROOT_BLEND^2 / 2 [1]. v itself where e does not count."""
    plain = v > 1e3
    near = jnp.where(plain, 0.0, v)
    return jnp.where(plain, v, jnp.sqrt(near * near + 0.25 * ROOT_BLEND**4))


def positive_part(v: Float[Array, "..."]) -> Float[Array, "..."]:
    """v where it is well above 0, and positive with a positive slope everywhere: (v + sqrt(v^2 + e^2)) / 2 [1]."""
    above, root = v > 0, _rounded(v)
    # of two equal forms the one that does not cancel
    return 0.5 * jnp.where(above, v + root, 0.25 * ROOT_BLEND**4 / jnp.where(above, 1.0, root - v))


def raised_root(v: Float[Array, "..."]) -> Float[Array, "..."]:
    """Square root of v [1], to half a per cent above 2 ROOT_BLEND^2; below it never 0, and nowhere of slope 0: where the
    occupancy is over 1, as in a hollow, a distance still points away. 0.1 at v = 0."""
    return jnp.sqrt(positive_part(v))


def raised_root_slope(v: Float[Array, "..."]) -> Float[Array, "..."]:
    """Derivative of `raised_root` [1]."""
    return 0.5 * raised_root(v) / _rounded(v)


def _se_log(v: Float[Array, "..."]) -> Float[Array, "..."]:
    return -0.5 * v


def _se_distance(log_o: Float[Array, "..."]) -> Float[Array, "..."]:
    return blended_root(-2.0 * log_o)


def _matern12_log(v: Float[Array, "..."]) -> Float[Array, "..."]:
    return -safe_sqrt(v)


def _matern12_distance(log_o: Float[Array, "..."]) -> Float[Array, "..."]:
    return jnp.where(log_o < 0, -log_o, 0.0)


def _matern32_log(v: Float[Array, "..."]) -> Float[Array, "..."]:
    # log(1 + t) - t cancels for small t: there it is its series -t^2/2 + t^3/3 - ..., written in v = t^2 / 3.
    v3 = 3.0 * v
    near = v3 < 0.01
    t = safe_sqrt(v3)
    far_t = jnp.where(near, 1.0, t)
    series = -v3 * (0.5 - t * (1 / 3 - t * (0.25 - t * (0.2 - t * (1 / 6 - t / 7)))))
    return jnp.where(near, series, jnp.log1p(far_t) - far_t)


@jax.custom_jvp
def _depth_by_newton(y: Float[Array, "..."]) -> Float[Array, "..."]:
    """The t of t - ln(1 + t) = y for y not near 0 [1]."""
    root = jnp.sqrt(2.0 * y)
    t = jnp.where(y < 1.0, root + y * (2 / 3), y + jnp.log1p(y + root))  # first guess
    for _ in range(4):
        t = t - (t - jnp.log1p(t) - y) * (1.0 + t) / t
    return t


@_depth_by_newton.defjvp
def _depth_by_newton_jvp(primals, tangents):
    t = _depth_by_newton(*primals)
    return t, tangents[0] * (1.0 + t) / t


def lambert_depth(y: Float[Array, "..."]) -> Float[Array, "..."]:
    """The t >= 0 of t - ln(1 + t) = y [1], that is -1 - W(-exp(-1 - y)) with W the branch -1 of Lambert's function.

    The logarithm of the argument is the input: nothing underflows, whatever y. Below y = 0.08 the series in
    s = sqrt(2 y) about the branch point, above it Newton's method; 0 with slope 0 where y <= 0. The root s is
    `blended_root`, so that t is too small near 0.
    """
    near = y < 0.08
    s = blended_root(2.0 * y)
    tail = s**4 * (-1 / 270 + s * (1 / 4320 + s * (1 / 17010 - s * 139 / 5443200)))
    series = s * (1.0 + s * (1 / 3 + s / 36)) + tail
    return jnp.where(near, series, _depth_by_newton(jnp.where(near, 1.0, y)))


def _matern32_distance(log_o: Float[Array, "..."]) -> Float[Array, "..."]:
    return lambert_depth(-log_o) / math.sqrt(3.0)


SQUARED_EXPONENTIAL = Kernel("squared exponential", _se_log, _se_distance)
"""k = exp(-r^2 / 2 l^2): the kernel with the fast closed forms."""

MATERN12 = Kernel("Matern 1/2", _matern12_log, _matern12_distance)
"""k = exp(-r / l)."""

MATERN32 = Kernel("Matern 3/2", _matern32_log, _matern32_distance)
"""k = (1 + t) exp(-t), t = sqrt(3) r / l, with the exact inverse."""


@functools.cache
def rational_quadratic(b: float = 75.0) -> Kernel:
    """k = (1 + r^2 / (2 b l^2))^-b; b in use: 50 to 100 [1]. The same b gives the same object.

    Raises:
        ValueError: b is not positive.
    """
    if not b > 0:
        raise ValueError(f"rational_quadratic: b = {b}, must be positive")

    def log(v: Float[Array, "..."]) -> Float[Array, "..."]:
        return -b * jnp.log1p(v / (2.0 * b))

    def distance(log_o: Float[Array, "..."]) -> Float[Array, "..."]:
        return blended_root(2.0 * b * jnp.expm1(-log_o / b))

    return Kernel(f"rational quadratic, b = {b:g}", log, distance)
