"""Features of a hand that do not change with its place, size, turn in the image and side."""

import jax.numpy as jnp
import numpy as np

from hrcjax.hand.landmarks import CLOSED, FINGERS, NONE, OPEN, PAIRS, POINTING, WRIST
from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Float, Int

FIRST, SECOND = np.asarray(PAIRS).T
STRETCHED = 1.15
"""A finger counts as extended if its tip is this much farther from the wrist than its middle joint [1]."""


def pair_distances(x: Float[Array, "landmark 2"]) -> Float[Array, "pair"]:
    """Distances between all pairs of landmarks, over their root mean square [1].

    Distances know neither place nor turn nor mirror, and determine the figure up to these: left and right hands look alike,
    whatever an interface calls them. All landmarks in one place: zeros. Not finite if: a landmark is not.

    Args:
        x: landmarks in the image, in pixels or any unit that is the same along both axes.
    """
    d = safe_norm(x[FIRST] - x[SECOND])
    size = jnp.sqrt(jnp.mean(d**2))
    return d / jnp.where(size > 0, size, 1.0)


def extended_fingers(x: Float[Array, "landmark 2"]) -> Array:
    """Whether index, middle, ring and little finger are extended: the tip is farther from the wrist than the middle joint."""
    four = [FINGERS[name] for name in ("index", "middle", "ring", "little")]
    tip, joint = (safe_norm(x[np.asarray([f[k] for f in four])] - x[WRIST]) for k in (3, 1))
    return tip > STRETCHED * joint


def rule_gesture(x: Float[Array, "landmark 2"]) -> Int[Array, ""]:
    """The gesture by counting extended fingers: all four open, none closed, the index alone pointing, else none; also where a landmark is not finite."""
    out = extended_fingers(x)
    count = jnp.sum(out)
    found = jnp.where(count == 4, OPEN, jnp.where(count == 0, CLOSED, NONE))
    found = jnp.where((count == 1) & out[0], POINTING, found)
    return jnp.where(jnp.all(jnp.isfinite(x)), found, NONE).astype(jnp.int32)
