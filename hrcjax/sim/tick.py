"""One control period: field reading, safety decision, policy, guards, joint servo."""

from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.bits import pack
from hrcjax.body import BodyFit
from hrcjax.geom.point_motion import PointMotion
from hrcjax.numerics import computed
from hrcjax.policy import JointLimits, limit_acceleration
from hrcjax.robot import COVER_MARGIN, ArmState, point_motion
from hrcjax.safety import (
    APPROACH_TOLERANCE,
    COMMANDED,
    STOP,
    ClockState,
    SafetyDecision,
    guard,
    initial_clock,
    speed_scale,
    steep_limit,
    worst_approach,
)
from hrcjax.sim.body_rows import body_rows
from hrcjax.sim.cell import Cell
from hrcjax.sim.contact import contact_mobility_rows
from hrcjax.sim.govern import Rows, fastest, govern
from hrcjax.sim.guide import Guidance, guide
from hrcjax.sim.params import Params
from hrcjax.sim.parts import ArmMotion, BodyRows, Clearance, Fields, Goal, Separation, all_finite, unit_where_long
from hrcjax.sim.route import Route
from hrcjax.sim.servo import servo
from hrcjax.typing import Array, Bool, Float, Int, Joints, Scalar

NOT_FINITE_COMMAND = 1
TORQUE_LIMITED = 2
NOT_FINITE_TORQUE = 4
NOT_FINITE_READING = 8
STOP_COMMANDED = 16
STATUS_WORDS = {
    NOT_FINITE_COMMAND: "command not finite",
    TORQUE_LIMITED: "torque limited",
    NOT_FINITE_TORQUE: "torque not finite",
    NOT_FINITE_READING: "reading of the person or speed limit not finite",
    STOP_COMMANDED: "stopped by command",
}
"""Bit of a tick's status -> text, for `hrcjax.bits.words`."""
FULL_SPEED = 1.05
"""The time to stop from at least this speed is how far ahead the parts of a body are looked at [m/s]."""


class TickState(eqx.Module):
    """State carried from one control period to the next."""

    arm: ArmState
    """The measured state of the arm."""
    clock: ClockState
    """Progress of the reference along the path."""
    safety: Any
    """Memory of the safety monitor."""


class Sensed(eqx.Module):
    """Sensed data at one tick."""

    fields: Fields
    """Fitted fields; of the moving ones the row of the newest frame."""
    age: Float[Array, ""]
    """Age of that frame; infinite: there is none [s]."""
    valid: Bool[Array, ""]
    """False where the map of the scene exceeded a capacity."""
    guarded: Bool[Array, ""]
    """True where a camera is missing, or somebody may be hidden: see `Frames.guarded`."""
    faults: Int[Array, ""]
    """What is wrong with the cameras, see `Record.cameras`."""
    stop: Bool[Array, ""] | None = None
    """Whether somebody's command stops the arm, as `hrcjax.hand.CommandState.stopped`; None: commands are not read."""
    body: BodyFit | None = None
    """The body of a person in the newest frame; None: it is not followed."""


class Record(eqx.Module):
    """Record of one tick; an episode stacks them over time."""

    q: Float[Array, "*time joint"]
    """Joint positions at the start of the tick [rad]."""
    qd: Float[Array, "*time joint"]
    """Joint speeds [rad/s]."""
    qdd: Float[Array, "*time joint"]
    """Joint accelerations commanded [rad/s^2]."""
    tau: Float[Array, "*time joint"]
    """Motor torques at the start of the tick [N m]."""
    tool: Float[Array, "*time 3"]
    """Tool point [m]."""
    reference: Float[Array, "*time 3"]
    """Reference position of the tool, from the path clock [m]."""
    travelled: Float[Array, "*time"]
    """Arc length of the reference [m]."""
    separation: Float[Array, "*time"]
    """Lower bound of the distance from arm to person, from the field [m]."""
    field_clearance: Float[Array, "*time"]
    """Distance from arm to the nearest surface, from the field [m]."""
    approach: Float[Array, "*time"]
    """Largest speed of a control point towards the person [m/s]."""
    speed_limit: Float[Array, "*time"]
    """Speed towards the person allowed by the safety monitor; limits towards a head alone are not in it [m/s]."""
    zone: Int[Array, "*time"]
    """0 green, 1 yellow, 2 red, 3 stop."""
    reasons: Int[Array, "*time"]
    """Bits of the reasons for a stop, the monitor's or a command; 0 exactly where the zone is not stop. Text: `hrcjax.safety.describe`."""
    cameras: Int[Array, "*time"]
    """What is wrong with the cameras' latest images: the bits of camera k, `hrcjax.sense.HEALTH_REASONS`, times 256^k."""
    status: Int[Array, "*time"]
    """Bits of guard interventions; text in `STATUS_WORDS`."""


def joint_limits(cell: Cell, dtype: jnp.dtype) -> JointLimits:
    """Limits of the cell's arm."""
    arm = cell.arm
    return JointLimits(*(jnp.asarray(v, dtype) for v in (arm.q_min, arm.q_max, arm.qd_max, arm.qdd_max)))


def initial_state(cell: Cell, q: Joints) -> TickState:
    """Standing at q, at the start of the path."""
    return TickState(ArmState(q, jnp.zeros_like(q)), initial_clock(q.dtype), cell.safety.start(q.dtype))


def tick(
    params: Params, cell: Cell, route: Route | Goal, sensed: Sensed, state: TickState
) -> tuple[TickState, Record]:  # fmt: skip
    """One control period of `cell.dt`.

    Order: kinematics of the control points; field reading at each; safety monitor; path clock and command, by `cell.motion`: the
    motion policy, or the path as it is; the guards, which belong to no part: joint limits, speed governor, replacement of values
    that are not finite, and a hold where a reading of the person or a limit of the monitor is not finite, or a command says stop;
    joint servo.

    Args:
        route: the reference motion of tool and joints; or the goal of this very tick, where something else leads the arm.
    """
    q, qd = state.arm.q, state.arm.qd
    dt = cell.dt
    body, tool = computed(control_motion(cell, q, qd))
    room, towards_people = computed(read_room(params, cell, sensed.fields, body))
    approach = computed(towards_people.speeds(qd))
    mobility = contact_mobility_rows(cell, q, tool, towards_people)
    followed = None
    if cell.body is not None and sensed.body is not None:
        ssm = cell.safety.yardstick(params.safety)
        stops = ssm.reaction_time + jnp.maximum(fastest(towards_people.J, qd), FULL_SPEED) / ssm.brake
        followed = computed(body_rows(cell.body, sensed.body, body.x, towards_people, sensed.age, stops))
    separation = Separation(
        towards_people.distance, approach, sensed.age, sensed.valid, sensed.guarded, dt, mobility, towards_people.nearest(), followed
    )  # fmt: skip
    memory, decision = computed(cell.safety.decide(params.safety, state.safety, separation))
    if decision.point_limit.shape != approach.shape:
        raise ValueError(
            f"the monitor returns point_limit of shape {decision.point_limit.shape}; accepted: {approach.shape}"
        )
    any_limit = decision.speed_limit if decision.any_limit is None else decision.any_limit
    bounds = [b for b in (decision.aside, decision.widest, decision.gain, decision.head_limit) if b is not None]
    unread = ~all_finite(
        towards_people.distance, approach, room.standing_distance, decision.speed_limit, decision.point_limit, any_limit, *bounds
    )  # fmt: skip
    hold = decision.hold | unread
    zone, reasons = decision.zone, decision.reasons
    if sensed.stop is not None:
        hold = hold | sensed.stop
        zone = jnp.where(sensed.stop, STOP, zone)
        reasons = reasons | pack({COMMANDED: sensed.stop})
    if followed is not None:
        towards_people, decision = with_head(cell, towards_people, followed, decision)

    limits = joint_limits(cell, q.dtype)
    arm = ArmMotion(q, qd, tool, body)
    guidance: Guidance = computed(
        guide(params, cell, route, state.clock, arm, room, towards_people, decision, hold, limits)
    )
    if guidance.asked.shape != q.shape:
        raise ValueError(
            f"the policy returns shape {guidance.asked.shape}; accepted: {q.shape}, an acceleration of each joint"
        )
    brake = full_brake(qd, limits, dt)
    safe, bad = guard(guidance.asked, brake)
    limited, _ = limit_acceleration(safe, q, qd, limits, dt)
    asked = computed(qd + limited * dt)
    ahead = computed(steered(params, cell, asked, qd, towards_people, decision, room, any_limit))
    limited, _ = limit_acceleration((ahead - qd) / dt, q, qd, limits, dt)
    after = computed(approaching(qd + limited * dt, towards_people, decision))
    governed = jnp.where(hold, brake, (after - qd) / dt)
    limited, _ = limit_acceleration(governed, q, qd, limits, dt)
    qdd, unbounded = guard(limited, brake)
    bad = bad | unbounded

    moved, tau, torque_limited, torque_bad = servo(params.motion.servo_gain, cell, state.arm, qdd)
    status = pack(
        {
            NOT_FINITE_COMMAND: bad,
            TORQUE_LIMITED: torque_limited,
            NOT_FINITE_TORQUE: torque_bad,
            NOT_FINITE_READING: unread,
            **({} if sensed.stop is None else {STOP_COMMANDED: sensed.stop}),
        }
    )
    record = Record(
        q=q,
        qd=qd,
        qdd=qdd,
        tau=tau,
        tool=tool.x[0],
        reference=guidance.reference,
        travelled=state.clock.s,
        separation=jnp.min(room.person_distance),
        field_clearance=jnp.min(room.distance),
        approach=jnp.max(approach),
        speed_limit=decision.speed_limit,
        zone=zone,
        reasons=reasons,
        cameras=sensed.faults,
        status=status,
    )
    return TickState(moved, guidance.clock, memory), record


def with_head(cell: Cell, people: Rows, followed: BodyRows, decision: SafetyDecision) -> tuple[Rows, SafetyDecision]:
    """Rows and limits of people, and beside them those of every control point towards the head, if the monitor has given some.

    The direction to the head is that of the fit alone: the distance that is kept from it is our choice, and no bound that would have to hold in
    every direction.
    """
    if decision.head_limit is None:
        return people, decision
    count = followed.head_distance.shape[0]

    def beside(of_people: Array, of_head: Array) -> Array:
        return jnp.concatenate([of_people.reshape(count, -1), of_head[:, None]], axis=1)

    g = jnp.concatenate([people.g, followed.head_gradient[:, None]], axis=1)
    rows = Rows.towards(cell.arm, beside(people.distance, followed.head_distance), g, people.J)
    limit = beside(decision.point_limit, decision.head_limit).reshape(-1)
    aside = decision.aside
    if aside is not None:
        every = jnp.broadcast_to(aside, decision.point_limit.shape)
        aside = beside(every, jnp.zeros_like(followed.head_distance)).reshape(-1)
    return rows, replace(decision, point_limit=limit, aside=aside)


def steered(
    params: Params,
    cell: Cell,
    asked: Joints,
    qd: Joints,
    people: Rows,
    decision: SafetyDecision,
    room: Clearance,
    top: Float[Array, ""],
) -> Joints:
    """The joint speeds nearest to those asked for that the decision allows [rad/s].

    Args:
        asked: joint speeds asked for [rad/s].
        qd: present joint speeds [rad/s].
        top: largest speed of any point in any direction [m/s].
    """
    limit = steep_limit(decision.point_limit, people.across(qd), people.sines(decision))
    if decision.gain is not None and cell.motion != "path":  # there the clock alone sets the pace
        top = jnp.minimum(top, fastest(people.J, qd) + decision.gain)
    return govern(params, cell, asked, people, limit, room, top)


def approaching(qd: Joints, people: Rows, decision: SafetyDecision) -> Joints:
    """The joint speeds, scaled down so that no row approaches faster than it may, wherever the person may be by now [rad/s].

    A joint at the end of its range may not do what the others counted on, and a retreat that is given up in part may not make up for
    motion across.
    """
    speeds = worst_approach(people.speeds(qd), people.across(qd), people.sines(decision))
    return speed_scale(speeds, jnp.maximum(decision.point_limit, 0.0) * people.share + APPROACH_TOLERANCE) * qd


def read_room(params: Params, cell: Cell, fields: Fields, body: PointMotion) -> tuple[Clearance, Rows]:
    """The distances of all control spheres, and the rows of their approach to people."""
    radii = jnp.asarray(cell.arm.control_radii, body.x.dtype)
    seen = jax.vmap(lambda x: cell.field.read(params.field, fields, x))(body.x)
    if seen.distance.shape != radii.shape or seen.person_gradient.shape[-1:] != (3,):
        raise ValueError(
            "the field reads no Reading of one point; accepted: distances of shape (), gradients of shape (3,)"
        )
    distance = seen.person_distance.reshape(*radii.shape, -1)
    away = seen.person_gradient.reshape(*distance.shape, 3)
    away = unit_where_long(away) if cell.field.unit_gradients else away
    distance = distance - (radii + COVER_MARGIN)[:, None]  # the margin makes it a bound for the arm's surface
    stands, off = seen.distance, seen.gradient
    if seen.standing_distance is not None and seen.standing_gradient is not None:
        stands, off = seen.standing_distance, seen.standing_gradient
    room = Clearance(
        seen.distance - radii, seen.gradient, distance[:, 0], away[:, 0], stands - radii, unit_where_long(off)
    )
    return room, Rows.towards(cell.arm, distance, away, body.J)


def full_brake(qd: Joints, limits: JointLimits, dt: Scalar) -> Joints:
    """Acceleration to standstill within one period, or the largest one towards it; finite for any measurement [rad/s^2].

    All joints brake in proportion, so that the arm keeps its direction; a joint whose speed is not finite is not commanded.
    """
    stop = -jnp.where(jnp.isfinite(qd), qd, 0.0) / dt
    return stop / jnp.maximum(jnp.max(jnp.abs(stop) / limits.qdd_max), 1.0)


def control_motion(cell: Cell, q: Joints, qd: Joints) -> tuple[PointMotion, PointMotion]:
    """Motion of the control points of the body, and of the three tool points, in one pass over the chain."""
    arm = cell.arm
    links = (*arm.control_links, *(arm.tool_link,) * 3)
    motion = point_motion(arm.chain, q, qd, links, cell.control_offsets)
    parts, shape = jax.tree.flatten(motion)
    split = [jax.lax.split(a, (len(arm.control_links), 3)) for a in parts]  # in reverse mode cheaper than slices
    return jax.tree.unflatten(shape, [a for a, _ in split]), jax.tree.unflatten(shape, [b for _, b in split])
