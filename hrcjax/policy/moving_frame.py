"""Goals that ride on a moving frame, such as a hand: what the target leaf needs to stay on them."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.typing import Array, Float, Matrix3, Vector3


class MovingFrame(eqx.Module):
    """A frame and its motion, in the world."""

    R: Matrix3
    """Its axes as columns [1]."""
    p: Vector3
    """Its origin [m]."""
    v: Vector3
    """Velocity of the origin [m/s]."""
    omega: Vector3
    """Angular velocity [rad/s]."""
    a: Vector3
    """Acceleration of the origin [m/s^2]."""
    alpha: Vector3
    """Angular acceleration [rad/s^2]."""


def frame_at_rest(R: Matrix3, p: Vector3) -> MovingFrame:
    """A frame that does not move."""
    still = jnp.zeros_like(p)
    return MovingFrame(R, p, still, still, still, still)


def riding(
    frame: MovingFrame, offsets: Float[Array, "goal 3"]
) -> tuple[Float[Array, "goal 3"], Float[Array, "goal 3"], Float[Array, "goal 3"]]:
    """Places [m], velocities [m/s] and accelerations [m/s^2] of points that the frame carries.

    Args:
        offsets: of the points, in the frame [m].
    """
    arm = offsets @ frame.R.T
    spin = jnp.cross(frame.omega[None], arm)
    return (
        frame.p + arm,
        frame.v + spin,
        frame.a + jnp.cross(frame.alpha[None], arm) + jnp.cross(frame.omega[None], spin),
    )
