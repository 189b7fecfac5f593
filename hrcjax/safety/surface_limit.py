"""How fast an arm may approach a surface that stands, so that it still stops before it."""

import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt
from hrcjax.typing import Array, Float, Scalar


def surface_limit(
    d: Float[Array, "*point"], brake: Scalar, margin: Scalar, reaction: Scalar = 0.008, floor: Scalar = 0.0
) -> Float[Array, "*point"]:
    """The largest v with v T + v^2 / 2 a <= d - margin: what is left suffices for the reaction and to stop [m/s].

    v = 2 e / (T + sqrt(T^2 + 2 e / a)) with e = d - margin: sqrt(2 a e) far from the margin, e / T at it, so that its
    derivative stays finite. 0 with derivative 0 below the margin. Without T it is sqrt(2 a e).

    Args:
        d: distance of the point's surface [m].
        brake: deceleration of the point a [m/s^2].
        margin: distance to keep [m].
        reaction: time T that passes until it brakes; one control period by default [s].
        floor: the limit is not less than this, also in contact [m/s].

    Not finite if: d is not. Infinite slope at the margin if: the reaction is 0.
    """
    left = jnp.maximum(d - margin, 0.0)
    some = left > 0
    e = jnp.where(some, left, 1.0)
    T = jnp.asarray(reaction, d.dtype)
    v = 2 * e / (T + safe_sqrt(T * T + 2 * e / brake))
    return jnp.maximum(jnp.where(some, v, jnp.where(jnp.isnan(d), d, 0.0)), floor)
