"""The speed governor of a tick: no point of the arm approaches people or surfaces faster than it may."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.geom.point_motion import PointMotion
from hrcjax.numerics import safe_norm
from hrcjax.robot import Arm
from hrcjax.safety import between_factor, half_gaps, least_change, speed_scale, surface_limit
from hrcjax.sim.cell import Cell
from hrcjax.sim.params import Params
from hrcjax.sim.parts import Clearance
from hrcjax.typing import Array, Bool, Float, Joints

LOST = 1.0
"""A point nearer to a person than this, whose direction is not known, counts with its whole speed [m]."""


class Rows(eqx.Module):
    """Approach speeds as linear functions of the joint speeds: one row for each control point and near surface."""

    distance: Float[Array, "row"]
    """Distance to the surface [m]."""
    share: Float[Array, "row"]
    """Share of a limit that the control point gets, so that the link between it and its neighbours keeps the whole [1]."""
    A: Float[Array, "row joint"]
    """Approach speed of the point per joint speed: -g . J [m]."""
    J: Float[Array, "row 3 joint"]
    """Jacobian of the point [m]."""
    lost: Bool[Array, "row"]
    """Where the direction is not known: the whole speed of the point counts."""

    @staticmethod
    def towards(
        arm: Arm, distance: Float[Array, "point surface"], g: Float[Array, "point surface 3"], body: PointMotion
    ) -> "Rows":
        """The rows of control points towards surfaces; the nearest surface of all points first.

        Args:
            distance: of the points' surfaces [m].
            g: gradients of these distances [1].
            body: motion of the points.
        """
        dtype = distance.dtype
        radii, gaps = arm.control_radii, half_gaps(arm.control_links, arm.control_offsets)
        share = between_factor(distance + jnp.asarray(radii, dtype)[:, None], jnp.asarray(gaps, dtype)[:, None])
        A = -jnp.sum(g[..., None] * body.J[:, None], axis=-2)
        lost = (jnp.sum(g * g, axis=-1) < 0.25) & (distance < LOST)
        J = jnp.broadcast_to(body.J[:, None], (*distance.shape, *body.J.shape[1:]))

        def rows(x: Array) -> Array:
            return jnp.swapaxes(x, 0, 1).reshape(-1, *x.shape[2:])

        return Rows(rows(distance), rows(share), rows(A), rows(J), rows(lost))

    def speeds(self, qd: Joints) -> Float[Array, "row"]:
        """Approach speed of every row; negative for a retreat [m/s]."""
        whole = safe_norm(jnp.sum(self.J * qd, axis=-1))
        return jnp.where(self.lost, whole, jnp.sum(self.A * qd, axis=-1))


def govern(
    params: Params, cell: Cell, qd: Joints, people: Rows, limit: Float[Array, "row"], room: Clearance, body: PointMotion
) -> Joints:
    """The joint speeds nearest to those asked for with which every row keeps its limit [rad/s].

    Where the geometry of the path is fixed (`Cell.motion` "path") all joints are scaled alike instead. Otherwise what stands
    limits the speed too: the arm can stop before every surface that the field shows.

    Args:
        qd: joint speeds asked for [rad/s].
        limit: largest approach speed of every row [m/s].
    """
    limit = limit * people.share
    if cell.motion == "path":
        return speed_scale(people.speeds(qd), limit) * qd
    whole = jnp.where(people.lost, people.speeds(qd), 0.0)
    qd = speed_scale(whole, limit) * qd
    standing = Rows.towards(cell.arm, room.distance[:, None], room.gradient[:, None], body)
    stop = surface_limit(standing.distance, params.motion.surface_brake, params.motion.surface_margin)
    A = jnp.concatenate([jnp.where(people.lost[:, None], 0.0, people.A), standing.A])
    return least_change(qd, A, jnp.concatenate([limit, stop * standing.share]))
