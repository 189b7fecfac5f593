"""The speed governor: joint speeds with which every point of the arm keeps its limit towards every surface near it."""

import jax
import jax.numpy as jnp

from hrcjax.numerics import safe_norm
from hrcjax.safety.governor import speed_scale
from hrcjax.safety.least_change import least_change
from hrcjax.typing import Array, Bool, Float

SHORTEST = 0.5
"""A gradient shorter than this has no direction [1]."""


def has_direction(g: Float[Array, "*point 3"]) -> Bool[Array, "*point"]:
    """Whether a gradient is long enough for a direction. NaN is: it must be noticed."""
    return ~(jnp.sum(g * g, axis=-1) < SHORTEST**2)


def unit_direction(g: Float[Array, "*point 3"]) -> Float[Array, "*point 3"]:
    """The gradient as a unit vector; 0 where it has no direction [1]."""
    some = has_direction(g)[..., None]
    return jnp.where(some, g, 0.0) / jnp.where(some, safe_norm(g)[..., None], 1.0)


def approach_rows(
    J: Float[Array, "point 3 joint"], g: Float[Array, "point surface 3"]
) -> Float[Array, "point*surface joint"]:
    """A = -g^T J: speed of approach of every point to every surface near it, by the joint speeds [m].

    Args:
        J: Jacobians of the points' positions [m].
        g: gradient of the distance to every surface near a point. Made unit; without direction the row is 0 [1].
    """
    x, y, z = jax.lax.split(unit_direction(g), (1, 1, 1), axis=2)  # in reverse mode a split is cheaper than indices
    along_x, along_y, along_z = jax.lax.split(J, (1, 1, 1), axis=1)
    return -(x * along_x + y * along_y + z * along_z).reshape(-1, J.shape[-1])


def governed(
    qd: Float[Array, "joint"],
    J: Float[Array, "point 3 joint"],
    g: Float[Array, "point surface 3"],
    limit: Float[Array, "point surface"],
    iterations: int = 24,
) -> Float[Array, "joint"]:
    """The joint speeds nearest to the ones asked for with which every point approaches every surface within its limit [rad/s].

    See `least_change`. Where a surface has a limit but no direction, as on the axis of a person, the whole speed of the
    point counts: then all is scaled. An infinite limit is none: that of a surface which does not exist.

    Args:
        qd: joint speeds asked for [rad/s].
        J: Jacobians of the points' positions [m].
        g: gradient of the distance to every surface near a point [1].
        limit: largest speed of approach [m/s].
        iterations: as `least_change`.
    """
    changed = least_change(qd, approach_rows(J, g), limit.reshape(-1), iterations)
    least = jnp.min(jnp.where(has_direction(g), jnp.inf, limit), axis=1)  # NaN if any is
    speed = safe_norm(jnp.sum(J * changed, axis=-1))
    return speed_scale(speed, least) * changed
