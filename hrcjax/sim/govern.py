"""The speed governor of a tick: no point of the arm approaches people or surfaces faster than it may."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import computed, safe_norm, safe_sqrt
from hrcjax.robot import Arm
from hrcjax.safety import (
    SafetyDecision,
    approach_rows,
    between_factor,
    direction_sine,
    governed,
    half_gaps,
    has_direction,
    speed_scale,
    surface_limit,
)
from hrcjax.sim.cell import Cell
from hrcjax.sim.params import Params
from hrcjax.sim.parts import Clearance
from hrcjax.typing import Array, Bool, Float, Joints

LOST = 5.0
"""A point nearer to a person than this, whose direction is not known, counts with its whole speed [m]."""


RETREAT_TURN = 0.5
"""No retreat is asked for that would need faster joints, together [rad/s]."""
OPPOSED = -0.9
"""Cosine of the angle from which on two surfaces are on opposite sides of a point: 154 degrees [1]."""
IN_A_GAP = 0.02
"""Speed at which a point may move between two surfaces, where the distance has no direction [m/s]."""


class Rows(eqx.Module):
    """Approach speeds as linear functions of the joint speeds: one row for each control point and near surface."""

    distance: Float[Array, "row"]
    """Distance to the surface; the surfaces of a point follow one another [m]."""
    reach: Float[Array, "row"]
    """The same from the centre of the point's sphere [m]."""
    share: Float[Array, "row"]
    """Share of a limit that the control point gets, so that the link between it and its neighbours keeps the whole [1]."""
    A: Float[Array, "row joint"]
    """Approach speed of the point per joint speed: -g . J; 0 without direction [m]."""
    lost: Bool[Array, "row"]
    """Where a near surface has no direction: the whole speed of the point counts."""
    g: Float[Array, "point surface 3"]
    """Gradients of the distances [1]."""
    J: Float[Array, "point 3 joint"]
    """Jacobians of the points [m]."""

    @staticmethod
    def towards(
        arm: Arm, distance: Float[Array, "point surface"], g: Float[Array, "point surface 3"],
        J: Float[Array, "point 3 joint"],
    ) -> "Rows":  # fmt: skip
        """The rows of control points towards surfaces.

        Args:
            distance: of the points' surfaces [m].
            g: gradients of these distances [1].
            J: Jacobians of the points [m].
        """
        dtype = distance.dtype
        radii, gaps = arm.control_radii, half_gaps(arm.control_links, arm.control_offsets)
        reach = distance + jnp.asarray(radii, dtype)[:, None]
        # a lower bound may be below 0; a sphere that touches is its radius away, and a limit that holds in a contact is for its link too
        touching = jnp.maximum(distance, 0.0) + jnp.asarray(radii, dtype)[:, None]
        share = between_factor(touching, jnp.asarray(gaps, dtype)[:, None])
        lost = ~has_direction(g) & (distance < LOST)
        return Rows(
            distance.reshape(-1), reach.reshape(-1), share.reshape(-1), approach_rows(J, g), lost.reshape(-1), g, J
        )

    def nearest(self) -> Float[Array, "row"]:
        """Of every row, the distance of its control point to the nearest of its surfaces [m]."""
        surfaces = self.g.shape[1]
        return jnp.repeat(jnp.min(self.distance.reshape(-1, surfaces), axis=1), surfaces)

    def speeds(self, qd: Joints) -> Float[Array, "row"]:
        """Approach speed of every row; negative for a retreat [m/s]."""
        whole = jnp.repeat(safe_norm(computed(jnp.sum(self.J * qd, axis=-1))), self.g.shape[1])
        return jnp.where(self.lost, whole, computed(jnp.sum(self.A * qd, axis=-1)))

    def across(self, qd: Joints) -> Float[Array, "row"]:
        """Speed of every row's point across its direction; without direction 0 [m/s]."""
        whole = jnp.repeat(jnp.sum(jnp.sum(self.J * qd, axis=-1) ** 2, axis=-1), self.g.shape[1])
        along = jnp.sum(self.A * qd, axis=-1)
        return jnp.where(has_direction(self.g).reshape(-1), safe_sqrt(computed(whole - along * along)), 0.0)

    def sines(self, decision: SafetyDecision) -> Float[Array, "row"]:
        """Sine of the angle by which the direction of every row may be off [1]."""
        aside = jnp.zeros_like(self.reach[0]) if decision.aside is None else decision.aside
        return direction_sine(self.reach, aside, 1.0 if decision.widest is None else decision.widest)

    def limits(self, limit: Float[Array, "row"]) -> Float[Array, "point surface"]:
        """The limits that control points get, so that the links between them keep the given ones; none for what is far and has no
        direction [m/s]."""
        counts = self.lost | has_direction(self.g).reshape(-1)
        # a retreat needs no share, and none is asked for that turns a joint fast
        turn = RETREAT_TURN * jnp.sqrt(jnp.sum(self.A * self.A, axis=-1) + 1e-12)
        given = jnp.where(limit < 0, jnp.maximum(limit, -turn), limit * self.share)
        given = jnp.where(counts, given, jnp.inf).reshape(self.g.shape[:2])
        # a point between two surfaces can't move away from both: it must not keep the others from it
        opposed = jnp.sum(self.g[:, :, None] * self.g[:, None, :], axis=-1) < OPPOSED
        squeezed = jnp.any(opposed & (given < 0)[:, :, None] & (given < 0)[:, None, :], axis=(1, 2))
        return jnp.where(squeezed[:, None], jnp.maximum(given, 0.0), given)


def govern(
    params: Params,
    cell: Cell,
    qd: Joints,
    people: Rows,
    limit: Float[Array, "row"],
    room: Clearance,
    top: Float[Array, ""],
) -> Joints:
    """The joint speeds nearest to those asked for with which every row keeps its limit [rad/s].

    Where the geometry of the path is fixed (`Cell.motion` "path") all joints are scaled alike instead. Otherwise what stands
    limits the speed too: the arm can stop before every surface that the field shows. In all ways no point is faster than `top`.

    Args:
        qd: joint speeds asked for [rad/s].
        limit: largest approach speed of every row [m/s].
        top: largest speed of any point in any direction [m/s].
    """
    if cell.motion == "path":
        qd = speed_scale(people.speeds(qd), jnp.maximum(limit, 0.0) * people.share) * qd
        return slowed(people.J, qd, top)
    standing = Rows.towards(cell.arm, room.standing_distance[:, None], room.standing_gradient[:, None], people.J)
    stop = surface_limit(standing.distance, params.motion.surface_brake, params.motion.surface_margin)
    g = jnp.concatenate([people.g, standing.g], axis=1)
    stop = jnp.where(standing.lost, jnp.maximum(stop, IN_A_GAP), stop)
    kept = governed(qd, people.J, g, jnp.concatenate([people.limits(limit), standing.limits(stop)], axis=1))
    return slowed(people.J, kept, top)


def fastest(J: Float[Array, "point 3 joint"], qd: Joints) -> Float[Array, ""]:
    """Speed of the fastest point [m/s]."""
    return jnp.max(safe_norm(jnp.sum(J * qd, axis=-1)))


def slowed(J: Float[Array, "point 3 joint"], qd: Joints, top: Float[Array, ""]) -> Joints:
    """The joint speeds, scaled down so that no point is faster than `top` [rad/s]."""
    return speed_scale(safe_norm(computed(jnp.sum(J * qd, axis=-1))), top) * qd
