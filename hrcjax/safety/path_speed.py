"""How fast a clock may run where the geometry is fixed: the speed along one joint direction."""

import jax.numpy as jnp

from hrcjax.typing import Array, Float


def path_speed(
    qd_per_speed: Float[Array, "joint"], A: Float[Array, "row joint"], limit: Float[Array, "row"]
) -> Float[Array, ""]:
    """The largest v >= 0 with v (A . qd_per_speed) <= limit in every row [m/s].

    0 where a row that approaches has a limit of 0 or less, and where a number is not known; infinite where no row
    approaches. A retreat along the path is not slowed.

    Args:
        qd_per_speed: joint speeds at 1 m/s along the path [rad/m].
        A: speed of approach of every point to every surface near it, by the joint speeds; `approach_rows` [m].
        limit: its largest value [m/s].
    """
    slope = jnp.sum(A * qd_per_speed, axis=-1)
    towards = slope > 0
    ratio = jnp.where(towards, jnp.maximum(limit, 0.0) / jnp.where(towards, slope, 1.0), jnp.inf)
    known = jnp.isfinite(slope) & ~jnp.isnan(limit)
    return jnp.min(jnp.where(known, ratio, 0.0))
