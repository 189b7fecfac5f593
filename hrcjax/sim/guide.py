"""What the arm is asked to do in a tick, in one of three ways to move.

- "path": the joints follow the path as planned; only its clock reacts to people (the Robotica paper).
- "reactive": motion policies and potential alone lead the tool to the goal; there is no path.
- "both": the path is the reference of the motion policies, which may leave it and return.

A `Goal` in place of a route is the reference of this tick, in "reactive" and "both": something else leads the arm (`hrcjax.interact`).
"""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import safe_norm, unit
from hrcjax.plan import law_speed
from hrcjax.policy import JointLimits
from hrcjax.safety import ClockState, SafetyDecision, advance, path_speed
from hrcjax.sim.cell import Cell
from hrcjax.sim.govern import Rows
from hrcjax.sim.params import Params
from hrcjax.sim.parts import ArmMotion, Clearance, Goal
from hrcjax.sim.route import Route
from hrcjax.typing import Array, Bool, Float, Joints, Vector3


class Guidance(eqx.Module):
    """What the arm is asked to do in this tick."""

    asked: Joints
    """Joint acceleration asked for [rad/s^2]."""
    clock: ClockState
    """The path clock after the tick."""
    reference: Vector3
    """Reference position of the tool [m]."""


def guide(
    params: Params,
    cell: Cell,
    route: Route | Goal,
    clock: ClockState,
    arm: ArmMotion,
    room: Clearance,
    people: Rows,
    decision: SafetyDecision,
    hold: Bool[Array, ""],
    limits: JointLimits,
) -> Guidance:
    """The acceleration asked for, by the cell's way to move.

    Args:
        clock: the path clock before the tick.
        people: rows of the approach to people.
        decision: of the safety monitor.
        hold: stand still.

    Raises:
        ValueError: a goal, where the geometry of a path is fixed.
    """
    if isinstance(route, Goal):
        if cell.motion == "path":
            raise ValueError('a Goal leads the arm in the motions "both" and "reactive"; "path" follows a route')
        return Guidance(cell.policy(params.policy, arm, route, room, limits), clock, route.x[0])
    motion, dtype = params.motion, arm.q.dtype
    top = decision.speed_limit if decision.any_limit is None else decision.any_limit
    top = jnp.maximum(jnp.minimum(motion.speed, top), 0.0)
    if cell.motion == "reactive":
        return _towards_goal(params, cell, route, clock, arm, room, jnp.where(hold, 0.0, top), limits)

    s = clock.s
    place, tangent, bend = route.curve.point(s), route.curve.tangent(s), route.curve.curvature(s)
    law = law_speed(params.potential, route.length - s, route.ratio_at(s))
    off = safe_norm(place[:3] - arm.tool.x[0])
    if cell.motion == "path":
        pace = jnp.minimum(
            path_speed(tangent[9:], people.A, people.share * decision.point_limit), jnp.minimum(top, law)
        )
        pace = pace * jnp.exp(-((off / motion.lag) ** 2))
    else:
        pace = jnp.minimum(top, law) * jnp.exp(-((off / motion.leash) ** 2))
    after = advance(motion.clock, clock, pace.astype(dtype), route.length - s, cell.dt, hold)
    velocity, acceleration = tangent * clock.v, bend * clock.v**2 + tangent * after.a
    if cell.motion == "path":
        back = motion.track_kp * (place[9:] - arm.q) + motion.track_kd * (velocity[9:] - arm.qd)
        return Guidance(acceleration[9:] + back, after, place[:3])
    goal = Goal(
        place[:9].reshape(3, 3), velocity[:9].reshape(3, 3), acceleration[:9].reshape(3, 3), place[9:], route.end[0],
        params.potential,
    )  # fmt: skip
    return Guidance(cell.policy(params.policy, arm, goal, room, limits), after, place[:3])


def _towards_goal(
    params: Params,
    cell: Cell,
    route: Route,
    clock: ClockState,
    arm: ArmMotion,
    room: Clearance,
    top: Float[Array, ""],
    limits: JointLimits,
) -> Guidance:
    """The tool is drawn straight to the goal by the law of motion; its orientation to that at the goal."""
    x, end = arm.tool.x[0], route.end
    way = end[0] - x
    pace = jnp.minimum(law_speed(params.potential, safe_norm(way), 0.0), top)
    velocity = jnp.broadcast_to(pace * unit(way), (3, 3))
    goal = Goal(
        end + (x - end[0]), velocity, jnp.zeros_like(velocity), route.curve.point(route.length)[9:], end[0], params.potential
    )  # fmt: skip
    return Guidance(cell.policy(params.policy, arm, goal, room, limits), clock, x)
