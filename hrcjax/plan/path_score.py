"""The score by which the paper compares paths (Robotica 2025, table VIII)."""

import jax.numpy as jnp

from hrcjax.numerics import safe_divide
from hrcjax.typing import Array, Float, Scalar


def path_scores(
    length: Float[Array, "path"], bending_energy: Float[Array, "path"], omega1: Scalar = 0.5, omega2: Scalar = 0.5
) -> Float[Array, "path"]:
    """Weighted sum of length and bending energy, each scaled to [0, 1] over the candidates; the lower the better [1].

    A quantity that is the same for all candidates counts 0.

    Args:
        length: of each candidate [m].
        bending_energy: of each candidate [1/m].
        omega1: weight of the scaled length [1].
        omega2: weight of the scaled bending energy [1].
    """
    return jnp.asarray(omega1 * _scaled(length) + omega2 * _scaled(bending_energy))


def _scaled(x: Float[Array, "path"]) -> Float[Array, "path"]:
    low = jnp.min(x)
    return safe_divide(x - low, jnp.broadcast_to(jnp.max(x) - low, x.shape))
