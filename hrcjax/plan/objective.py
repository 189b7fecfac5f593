"""What the path optimiser minimises, and its blocks of the Newton matrix: length and bending energy of equal steps."""

import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt
from hrcjax.typing import Array, Float, Scalar


def length_and_bending(waypoints: Float[Array, "waypoint dim"]) -> tuple[Array, Array, Array, Array]:
    """Length [m], bending energy [1/m], and at the waypoints between the ends their gradients (the second at constant
    length).

    For equal steps. The length is sqrt(N sum |step|^2), above the true one unless the steps are equal: so the minimum
    has equal steps. The bending energy is N^3 sum |bend|^2 / length^3.
    """
    count = waypoints.shape[0] - 1
    steps = jnp.diff(waypoints, axis=0)
    bends = jnp.diff(steps, axis=0)
    total = safe_sqrt(count * jnp.sum(steps * steps))
    scale = count**3 / total**3
    fourth = jnp.diff(jnp.pad(bends, ((1, 1), (0, 0))), n=2, axis=0)
    return total, scale * jnp.sum(bends * bends), -count / total * bends, 2 * scale * fourth


def with_bands(
    diagonal: Float[Array, "waypoint 3 3"], off: Float[Array, "pair 3 3"], a: Scalar, b: Scalar
) -> tuple[Float[Array, "waypoint 3 3"], Float[Array, "pair 3 3"]]:
    """The blocks with the second derivatives of a |differences|^2 / 2 + b |second differences|^2 / 2 added; the block
    two waypoints off is b I."""
    eye = jnp.eye(3, dtype=diagonal.dtype)
    edge = jnp.zeros(diagonal.shape[0], diagonal.dtype).at[0].add(1).at[-1].add(1)[:, None, None]
    return diagonal + (2 * a + (6 - edge) * b) * eye, off - (a + 4 * b) * eye
