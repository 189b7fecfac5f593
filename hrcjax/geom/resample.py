"""Waypoints at equal distances along a path."""

import jax.numpy as jnp

from hrcjax.numerics import require_floating, safe_divide, safe_norm
from hrcjax.typing import Array, Float


def resample_path(waypoints: Float[Array, "waypoint dim"], count: int) -> Float[Array, "count dim"]:
    """Points at equal distances along the broken line through the waypoints; both ends are kept exactly [m].

    Repeated waypoints are harmless. The derivative is that of the linear interpolation.

    Raises:
        ValueError: fewer than 2 waypoints in or out.
    """
    require_floating("resample_path", waypoints=waypoints)
    if waypoints.shape[0] < 2 or count < 2:
        raise ValueError(f"cannot resample {waypoints.shape[0]} waypoints to {count}; accepted are 2 or more")
    segments = jnp.diff(waypoints, axis=0)
    lengths = safe_norm(segments)
    ends = jnp.cumsum(lengths)
    at = ends[-1] * jnp.linspace(0, 1, count, dtype=waypoints.dtype)[1:-1]
    index = jnp.sum(ends[None, :] <= at[:, None], axis=1)  # segment that holds each point
    index = jnp.minimum(index, lengths.shape[0] - 1)
    part = safe_divide(at - (ends[index] - lengths[index]), lengths[index])
    inner = waypoints[index] + jnp.clip(part, 0, 1)[:, None] * segments[index]
    return jnp.concatenate([waypoints[:1], inner, waypoints[-1:]])
