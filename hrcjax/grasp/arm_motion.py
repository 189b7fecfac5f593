"""The arm brings the gripper to a grasp by its policies: from home to the begin of the approach, and along it.

In transit the goal runs along the straight line in joint space to the joints of the inverse kinematics: a pose alone leaves open
which way round the arm goes, and a wrong one ends where links touch. On the approach the goal is the grasp itself.
The dynamics are the arm's own (computed torque within the motors' limits, 125 Hz); speeds and accelerations of the joints are limited.
The policies know of the object what the field of distance says.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.rotation import rotation_z
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.hand_points import hand_points
from hrcjax.grasp.motion_policy import MotionPolicyParams, motion_acceleration
from hrcjax.numerics import safe_norm
from hrcjax.policy import JointLimits, MovingFrame, limit_acceleration, turn
from hrcjax.robot import Arm, ArmState, inverse_dynamics, limit_torque, step, tool_frame
from hrcjax.robot.ik import rotation_error
from hrcjax.safety import guard
from hrcjax.typing import Array, Bool, DistanceFn, Float, Joints, Matrix3, Scalar, Vector3

RATE = 125.0
"""Control periods in a second [Hz]."""
SECONDS = 8.0
"""Time for the whole motion [s]."""
SUBSTEPS = 2
"""Steps of the arm's dynamics in a control period."""
PACE = 0.1
"""Of the goal along the approach [m/s]."""
CLOSE, STRAIGHT = 0.005, float(np.deg2rad(3.0))
"""Errors of a pose that counts as reached [m], [rad]."""
PEAK = 1.875
"""Greatest speed on a line with the least jerk, over its mean [1]."""
HASTE = 0.5
"""Greatest joint speed of the reference in transit, over its limit [1]."""
GAIN = 40.0
"""Velocity feedback of the joint servo [1/s]."""


class Moved(eqx.Module):
    """A motion, by control period."""

    q: Float[Array, "*time joint"]
    """Joints [rad]."""
    R: Float[Array, "*time 3 3"]
    """Axes of the gripper, as columns [1]."""
    p: Float[Array, "*time 3"]
    """Tool point [m]."""
    way: Float[Array, "*time"]
    """How far the goal has come along the approach [m]."""
    off: Float[Array, "*time"]
    """Distance of the tool point from the grasp [m]."""
    twist: Float[Array, "*time"]
    """Angle of the gripper from the grasp [rad]."""
    speed: Float[Array, "*time"]
    """Greatest joint speed over its limit [1]."""
    finite: Bool[Array, "*time"]
    """Whether the policies' command was a finite number."""


def move_to_grasp(
    arm: Arm, gripper: Gripper, params: MotionPolicyParams, clearance: DistanceFn, R: Matrix3, p: Vector3,
    opening: Scalar, approach: Scalar, q_before: Joints,
) -> Moved:  # fmt: skip
    """The motion from home to a grasp.

    Args:
        arm: of `arm_with_gripper`.
        clearance: point -> distance to what must not be touched [m].
        R: axes of the gripper at the grasp; it may arrive turned by half a turn, as its fingers are alike.
        p: tool point at the grasp [m].
        opening: between the pads [m].
        approach: length of the approach [m].
        q_before: joints at its begin, by the inverse kinematics [rad].
    """
    dtype = p.dtype
    limits = JointLimits(*(jnp.asarray(v, dtype) for v in (arm.q_min, arm.q_max, arm.qd_max, arm.qdd_max)))
    known, _ = tool_frame(arm, q_before)
    half = jnp.where(jnp.sum(known[:, 1] * R[:, 1]) < 0, jnp.pi, 0.0).astype(dtype)
    wanted = R @ rotation_z(half)
    hand = hand_points(gripper, opening, dtype)
    still = jnp.zeros(3, dtype)
    dt = 1 / RATE
    home = jnp.asarray(arm.home, dtype)
    seconds = jnp.maximum(1.0, PEAK * jnp.max(jnp.abs(q_before - home) / limits.qd_max) / HASTE)

    def tick(carry: tuple[ArmState, Array], time: Scalar) -> tuple[tuple[ArmState, Array], Moved]:
        state, way = carry
        line, line_speed = straight_joints(home, q_before, time / seconds, seconds)
        arriving = time >= seconds
        R_now, p_now = tool_frame(arm, state.q)
        at = p - (approach - way) * wanted[:, 2]
        twist = safe_norm(rotation_error(wanted, R_now))
        there = (safe_norm(at - p_now) < CLOSE) & (twist < STRAIGHT) & arriving
        pace = jnp.where(there & (way < approach), PACE, 0.0).astype(dtype)
        last = MovingFrame(wanted, at, pace * wanted[:, 2], still, still, still)
        goal = jax.tree.map(lambda end, on: jnp.where(arriving, end, on), last, carried_frame(arm, line, line_speed))
        near = (way > 0).astype(dtype)
        asked = motion_acceleration(
            params, arm, state.q, state.qd, goal, hand, clearance, near, limits, line, line_speed
        )
        brake = limit_acceleration(-state.qd / dt, state.q, state.qd, limits, dt)[0]
        safe, bad = guard(asked, brake)
        qdd = limit_acceleration(safe, state.q, state.qd, limits, dt)[0]
        record = Moved(
            state.q, R_now, p_now, way, safe_norm(p - p_now), twist, jnp.max(jnp.abs(state.qd) / limits.qd_max), ~bad
        )
        after = tracked(arm, state, qdd, dt)
        return (after, jnp.minimum(way + pace * dt, approach)), record

    start = (ArmState(home, jnp.zeros_like(home)), jnp.zeros((), dtype))
    return jax.lax.scan(tick, start, jnp.arange(round(SECONDS * RATE), dtype=dtype) * dt)[1]


def straight_joints(start: Joints, end: Joints, share: Scalar, seconds: Scalar) -> tuple[Joints, Joints]:
    """Joints [rad] and their speeds [rad/s] on a straight line with the least jerk, at rest at both ends (Flash and Hogan 1985).

    Args:
        start, end: of the line [rad].
        share: of the time that is over; past 1 it stays at the end [1].
        seconds: for the whole line [s].
    """
    s = jnp.clip(share, 0.0, 1.0)
    done, pace = s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2 / seconds
    return start + done * (end - start), pace * (end - start)


def carried_frame(arm: Arm, q: Joints, qd: Joints) -> MovingFrame:
    """The tool's frame and its velocity at joints that move; its acceleration is left out."""
    frame = turn(lambda at: tool_frame(arm, at)[0], q, qd)
    p, v = jax.jvp(lambda at: tool_frame(arm, at)[1], (q,), (qd,))
    still = jnp.zeros_like(p)
    return MovingFrame(frame.R, p, v, frame.omega, still, still)


def tracked(arm: Arm, state: ArmState, qdd: Joints, dt: float) -> ArmState:
    """The arm one control period later, under computed torque within the motors' limits."""
    h, start = dt / SUBSTEPS, state.qd
    for k in range(SUBSTEPS):
        asked = qdd + GAIN * (start + qdd * (k * h) - state.qd)
        tau, _ = limit_torque(arm, inverse_dynamics(arm.chain, state.q, state.qd, asked))
        state = step(arm, state, tau, h)
    return state
