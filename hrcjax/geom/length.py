"""Length of a path given by waypoints."""

import jax.numpy as jnp

from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Float


def length(waypoints: Float[Array, "waypoint dim"]) -> Float[Array, ""]:
    """Length of the broken line through the waypoints [m].

    Raises:
        ValueError: fewer than 2 waypoints.
    """
    if waypoints.shape[0] < 2:
        raise ValueError(f"a path of {waypoints.shape[0]} waypoints has no length; accepted are 2 or more")
    return jnp.sum(safe_norm(jnp.diff(waypoints, axis=0)))
