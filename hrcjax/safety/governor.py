"""Scaling a joint command so that no point of the arm approaches the person faster than it may."""

import jax.numpy as jnp

from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Bool, Float


def approach_speeds(
    qd: Float[Array, "joint"], J: Float[Array, "point 3 joint"], g: Float[Array, "point 3"]
) -> Float[Array, "point"]:
    """Speed of every control point towards the person; negative for a retreat [m/s].

    Args:
        qd: joint speeds [rad/s].
        J: Jacobians of the points' positions [m].
        g: unit gradient of the distance to the person at every point: it points away [1]. Where it has no direction
            (shorter than 1/2, as on the person's axis), the whole speed of the point counts as approach.
    """
    velocity = jnp.sum(J * qd, axis=-1)
    along = -jnp.sum(g * velocity, axis=-1)
    return jnp.where(jnp.sum(g * g, axis=-1) < 0.25, safe_norm(velocity), along)


SLOWEST = 1e-9
"""Approaches over their limit count as at least so fast: the square of their inverse stays finite in derivatives [m/s]."""


def speed_scale(
    approach: Float[Array, "point"], speed_limit: Float[Array, "point"] | Float[Array, ""]
) -> Float[Array, ""]:
    """beta in [0, 1]: the largest factor with beta * approach <= limit at every point [1].

    1 where every point retreats, or less where an approach below `SLOWEST` is still too fast. 0 where a speed or a limit is not a number, or an approach meets a limit of 0.
    """
    limit = jnp.broadcast_to(jnp.maximum(speed_limit, 0.0), approach.shape)  # keeps a NaN
    over = approach > limit
    ratio = jnp.where(over, limit / jnp.where(over, jnp.maximum(approach, SLOWEST), 1.0), 1.0)
    known = jnp.isfinite(approach) & ~jnp.isnan(limit)
    return jnp.min(jnp.where(known, ratio, 0.0))


def governor(
    qd_command: Float[Array, "joint"],
    J: Float[Array, "point 3 joint"],
    g: Float[Array, "point 3"],
    speed_limit: Float[Array, "point"] | Float[Array, ""],
) -> Float[Array, ""]:
    """beta in [0, 1] with max_k(-g_k . J_k qd) beta <= limit: beta * qd_command approaches within the limit [1].

    Scaling all joints alike keeps the direction of motion, so a path is not left. A retreat is not slowed.

    Args:
        qd_command: joint speeds asked for [rad/s].
        J: Jacobians of the points' positions [m].
        g: unit gradient of the distance to the person at every point [1].
        speed_limit: largest approach speed, of every point or of all [m/s].
    """
    return speed_scale(approach_speeds(qd_command, J, g), speed_limit)


def guard(
    command: Float[Array, "joint"], fallback: Float[Array, "joint"]
) -> tuple[Float[Array, "joint"], Bool[Array, ""]]:
    """The command, or the fallback where any of its entries is not finite; and whether that was so."""
    bad = ~jnp.all(jnp.isfinite(command))
    return jnp.where(bad, fallback, command), bad
