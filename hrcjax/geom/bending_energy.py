"""Bending energy of a path given by waypoints."""

import jax
import jax.numpy as jnp

from hrcjax.numerics import require_floating, safe_divide, safe_norm
from hrcjax.typing import Array, Float, Int


def bending_energy(waypoints: Float[Array, "waypoint dim"]) -> Float[Array, ""]:
    """Integral of the squared curvature over the length of the path, eq. 5b of Robotica 2025 [1/m].

    The curvature at a waypoint is |T' - T| over the mean length of its two segments, T and T' their directions: exact
    for points evenly spaced on a circle. It holds for half a segment on both sides, to the very end at the first and
    the last corner. So an arc of radius R and angle a tends to a / R with the square of the spacing. Waypoints that
    coincide with the one before them, to rounding, are left out. A path with waypoints nearly coincident by noise has
    the large bending energy it shows: resample it first.

    Raises:
        ValueError: fewer than 3 waypoints.
    """
    require_floating("bending_energy", waypoints=waypoints)
    if waypoints.shape[0] < 3:
        raise ValueError(f"a path of {waypoints.shape[0]} waypoints does not bend; accepted are 3 or more")
    segments = jnp.diff(waypoints, axis=0)
    lengths = safe_norm(segments)
    rounding = 4 * jnp.finfo(waypoints.dtype).eps * jnp.max(jnp.abs(waypoints))
    real = lengths > rounding
    directions = safe_divide(segments, jnp.where(real, lengths, 0)[:, None])
    count = lengths.shape[0]
    latest = jax.lax.cummax(jnp.where(real, jnp.arange(count), 0))  # the last real segment up to each
    before: Int[Array, "corner"] = latest[:-1]
    corner = real[1:] & real[before]
    turn = directions[1:] - directions[before]
    spacing = jnp.where(corner, (lengths[1:] + lengths[before]) / 2, 0)
    energy = safe_divide(jnp.sum(turn * turn, axis=-1), spacing)  # curvature^2 x spacing
    squared_curvature = safe_divide(energy, spacing)
    first = jnp.argmax(corner)
    last = count - 2 - jnp.argmax(corner[::-1])
    ends = squared_curvature[first] * lengths[before[first]] + squared_curvature[last] * lengths[last + 1]
    return jnp.sum(energy) + ends / 2
