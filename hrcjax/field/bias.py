"""How far a Gaussian-process field over-estimates the distance of convex bodies, and a distance that does not.

Derived for dense samples of a sphere and the squared-exponential kernel; measured on samples in the tests.
"""

import jax.numpy as jnp

from hrcjax.numerics import require_floating, safe_divide, safe_sqrt
from hrcjax.typing import Array, Float, Scalar


def _number(value: Scalar, like: Array) -> Float[Array, ""]:
    return jnp.asarray(value, like.dtype)


def convex_bias(d: Float[Array, ""], radius: Scalar, length_scale: Scalar) -> Float[Array, ""]:
    """By how much the field reads more than the true distance d from a sphere [m]: the unsafe side.

    d_hat^2 = d^2 + 2 l^2 ln(1 + d / R). For a cylinder half of the added term, for a plane none: the smallest radius
    of a body bounds the bias of all of it. To 1 mm for l < R / 3; for longer length scales the law is above what fields
    of spheres read, and its half below what fields of cylinders read (9.5 mm read against 8.1 mm at R = 4 cm,
    l = 3.1 cm, d = 2 cm).

    Args:
        d: true distance, 0 or more [m].
        radius: radius of the sphere R [m].
        length_scale: of the field, l [m].
    """
    require_floating("convex_bias", d=d)
    R, scale = _number(radius, d), _number(length_scale, d)
    return safe_sqrt(d * d + 2.0 * scale**2 * jnp.log1p(d / R)) - d


def lower_bound(d_hat: Float[Array, ""], radius: Scalar, length_scale: Scalar) -> Float[Array, ""]:
    """The true distance d at which the field of a sphere reads d_hat [m]: no convex body of radius R or more is nearer.

    The inverse of d -> d + `convex_bias`, by Newton's method from above, and so differentiable; 0 with derivative 0
    where d_hat <= 0. The law leaves out sampling: points further apart than the length scale need
    a margin of their own.

    Args:
        d_hat: distance read from the field [m].
        radius: smallest radius of curvature R of the body [m].
        length_scale: of the field, l [m].
    """
    require_floating("lower_bound", d_hat=d_hat)
    R, scale = _number(radius, d_hat), _number(length_scale, d_hat)
    d_hat = jnp.maximum(d_hat, 0.0)
    d = d_hat
    for _ in range(8):
        excess = d * d + 2.0 * scale**2 * jnp.log1p(d / R) - d_hat * d_hat
        slope = 2.0 * d + 2.0 * scale**2 / (R + d)
        d = jnp.maximum(d - safe_divide(excess, slope), 0.0)
    return d
