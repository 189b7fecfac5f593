"""Points that ride on the gripper, whose fingers open: their motion from that of its frame, whatever the opening."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.point_motion import PointMotion
from hrcjax.grasp.gripper import Gripper
from hrcjax.policy import Turn
from hrcjax.typing import Array, Float, Scalar


class HandPoints(eqx.Module):
    """Spheres that stand for the gripper, in its frame."""

    offsets: Float[Array, "point 3"]
    """Centres [m]."""
    radii: Float[Array, "point"]
    """Their radii [m]."""


def hand_points(gripper: Gripper, opening: Scalar, dtype: jnp.dtype) -> HandPoints:
    """The spheres of fingers and palm, of the palm its back too.

    Args:
        opening: between the pads [m].
    """
    centres, moved, radii = gripper.spheres()
    palm = moved == 0
    back = centres[palm] - [0, 0, 2 * gripper.palm[2] - gripper.palm[0]]
    sides = np.concatenate([moved, np.zeros(len(back))])
    aside = jnp.asarray(np.outer(sides / 2, [0, 1, 0]), dtype) * jnp.asarray(opening, dtype)
    offsets = jnp.asarray(np.concatenate([centres, back]), dtype) + aside
    return HandPoints(offsets, jnp.asarray(np.concatenate([radii, radii[palm]]), dtype))


def riding_points(point: PointMotion, frame: Turn, offsets: Float[Array, "point 3"]) -> PointMotion:
    """The motion of points that are fixed in a frame.

    Args:
        point: of the frame's origin, as a single point.
        frame: of its axes.
        offsets: of the points, in the frame [m].
    """
    arm = offsets @ frame.R.T
    spin = jnp.cross(frame.omega[None], arm)
    J = jnp.swapaxes(jnp.cross(frame.J.T[None], arm[:, None]), 1, 2)
    return PointMotion(
        x=point.x + arm,
        xd=point.xd + spin,
        J=point.J[None] + J,
        Jd_qd=point.Jd_qd + jnp.cross(frame.Jd_qd[None], arm) + jnp.cross(frame.omega[None], spin),
    )
