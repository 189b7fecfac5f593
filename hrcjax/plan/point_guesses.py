"""First guesses of a point's path: several at once, as which side of an obstacle is the right one is not known."""

import math

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.resample import resample_path
from hrcjax.numerics import safe_norm, unit
from hrcjax.typing import Array, Float, Vector3

BOWS = 6
"""Bows of half a wave, all round the straight line."""
_HEIGHT = 0.3
"""Height of a bow over the length of the straight line [1]."""
_SPREAD = (0.25, 0.12)
"""Standard deviations of the half and the whole wave of a seeded detour over that length [1]."""


def detours(count: int, seed: int = 0) -> np.ndarray:
    """Detours from the straight line over its length, (guess wave side): half and whole wave, to two sides [1].

    The first is none, the next BOWS are bows, the others are drawn.
    """
    angles = 2 * np.pi * np.arange(BOWS) / BOWS
    known = np.zeros((1 + BOWS, 2, 2))
    known[1:, 0] = _HEIGHT * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    drawn = np.random.default_rng(seed).standard_normal((max(count - len(known), 0), 2, 2))
    return np.concatenate([known, drawn * np.array(_SPREAD)[None, :, None]])[:count]


def sides(start: Vector3, goal: Vector3) -> Float[Array, "2 3"]:
    """Two unit vectors at right angles to the line and to each other; 0 if start and goal coincide."""
    along = unit(goal - start)
    least = jnp.eye(3, dtype=along.dtype)[jnp.argmin(jnp.abs(along))]  # never parallel to the line
    first = unit(jnp.cross(along, least))
    return jnp.stack([jnp.cross(first, along), first])


def detour_guesses(
    start: Vector3, goal: Vector3, lower: Vector3, upper: Vector3, detours: Float[Array, "guess 2 2"], waypoints: int
) -> Float[Array, "guess waypoint 3"]:
    """The straight line with detours in proportion to its length, within the bounds; ends stay, spacing is equal [m].

    Args:
        detours: as of `detours` [1].
    """
    dtype = start.dtype
    t = jnp.linspace(0, 1, waypoints, dtype=dtype)
    waves = jnp.stack([jnp.sin(math.pi * t), jnp.sin(2 * math.pi * t)])
    aside = jnp.einsum("wt,gws,sk->gtk", waves, detours, sides(start, goal)) * safe_norm(goal - start)
    bent = jnp.clip(start + t[:, None] * (goal - start) + aside, lower, upper)
    bent = bent.at[:, 0].set(start).at[:, -1].set(goal)
    return jax.vmap(lambda guess: resample_path(guess, waypoints))(bent)
