"""Square roots, norms and quotients whose value and derivative are finite everywhere."""

import jax.numpy as jnp

from hrcjax.typing import Array, Float, Scalar


def safe_sqrt(x: Float[Array, "..."]) -> Float[Array, "..."]:
    """Square root, element by element: 0 with derivative 0 where x <= 0. NaN stays NaN."""
    none = x <= 0
    return jnp.where(none, 0, jnp.sqrt(jnp.where(none, 1, x)))


def safe_norm(x: Float[Array, "... n"]) -> Float[Array, "..."]:
    """Euclidean norm over the last axis: 0 with derivative 0 at the origin. NaN stays NaN."""
    return safe_sqrt(jnp.sum(x * x, axis=-1))


def safe_divide(a: Float[Array, "..."], b: Float[Array, "..."], otherwise: Scalar = 0.0) -> Float[Array, "..."]:
    """a / b, element by element: `otherwise` with derivative 0 where b == 0."""
    zero = b == 0
    return jnp.where(zero, otherwise, a / jnp.where(zero, 1, b))


def unit(x: Float[Array, "... n"]) -> Float[Array, "... n"]:
    """The vector of length 1 along x over the last axis: 0 at the origin."""
    return safe_divide(x, safe_norm(x)[..., None])
