"""The arm brings the gripper to a grasp by its policies: from home to the begin of the approach, and along it.

The dynamics are the arm's own (computed torque within the motors' limits, 125 Hz); speeds and accelerations of the joints are limited.
The policies know of the object what the map knows.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.field import GPField, distance
from hrcjax.geom.rotation import rotation_z
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.hand_points import hand_points
from hrcjax.grasp.motion_policy import MotionPolicyParams, motion_acceleration
from hrcjax.policy import JointLimits, MovingFrame, limit_acceleration
from hrcjax.robot import Arm, ArmState, inverse_dynamics, limit_torque, step, tool_frame
from hrcjax.robot.ik import rotation_error
from hrcjax.safety import guard
from hrcjax.numerics import safe_norm

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
GAIN = 40.0
"""Velocity feedback of the joint servo [1/s]."""


class Moved(NamedTuple):
    """A motion, by control period."""

    q: jax.Array
    """Joints (time, joint) [rad]."""
    R: jax.Array
    """Axes of the gripper (time, 3, 3)."""
    p: jax.Array
    """Tool point (time, 3) [m]."""
    way: jax.Array
    """How far the goal has come along the approach (time) [m]."""
    off: jax.Array
    """Distance of the tool point from the grasp (time) [m]."""
    twist: jax.Array
    """Angle of the gripper from the grasp (time) [rad]."""
    speed: jax.Array
    """Greatest joint speed over its limit (time) [1]."""
    finite: jax.Array
    """Whether the policies' command was a finite number (time)."""


@partial(jax.jit, static_argnums=(0, 1))
def move(
    arm: Arm, gripper: Gripper, params: MotionPolicyParams, field: GPField, R: jax.Array, p: jax.Array, opening: jax.Array,
    approach: jax.Array, q_before: jax.Array,
) -> Moved:  # fmt: skip
    """The motion from home to a grasp.

    Args:
        arm: of `arm_with_gripper`.
        field: of the object's points; the table is z = 0.
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

    def clearance(x: jax.Array) -> jax.Array:
        return jnp.minimum(distance(field, x), x[2])

    def tick(carry: tuple[ArmState, jax.Array], _: None) -> tuple[tuple[ArmState, jax.Array], Moved]:
        state, way = carry
        R_now, p_now = tool_frame(arm, state.q)
        at = p - (approach - way) * wanted[:, 2]
        twist = safe_norm(rotation_error(wanted, R_now))
        there = (safe_norm(at - p_now) < CLOSE) & (twist < STRAIGHT)
        pace = jnp.where(there & (way < approach), PACE, 0.0).astype(dtype)
        goal = MovingFrame(wanted, at, pace * wanted[:, 2], still, still, still)
        near = (way > 0).astype(dtype)
        asked = motion_acceleration(params, arm, state.q, state.qd, goal, hand, clearance, near, limits, q_before)
        brake, _ = limit_acceleration(-state.qd / dt, state.q, state.qd, limits, dt)
        safe, bad = guard(asked, brake)
        qdd, _ = limit_acceleration(safe, state.q, state.qd, limits, dt)
        record = Moved(
            state.q, R_now, p_now, way, safe_norm(p - p_now), twist, jnp.max(jnp.abs(state.qd) / limits.qd_max), ~bad
        )
        after = tracked(arm, state, qdd, dt)
        return (after, jnp.minimum(way + pace * dt, approach)), record

    home = jnp.asarray(arm.home, dtype)
    start = (ArmState(home, jnp.zeros_like(home)), jnp.zeros((), dtype))
    return jax.lax.scan(tick, start, length=round(SECONDS * RATE))[1]


def tracked(arm: Arm, state: ArmState, qdd: jax.Array, dt: float) -> ArmState:
    """The arm one control period later, under computed torque within the motors' limits."""
    h, start = dt / SUBSTEPS, state.qd
    for k in range(SUBSTEPS):
        asked = qdd + GAIN * (start + qdd * (k * h) - state.qd)
        tau, _ = limit_torque(arm, inverse_dynamics(arm.chain, state.q, state.qd, asked))
        state = step(arm, state, tau, h)
    return state


def summary(moved: Moved) -> dict[str, NDArray]:
    """What is stored of a motion: its end, and its tool poses from the begin of the approach on."""
    m = Moved(*(np.asarray(a) for a in moved))
    arrived = (m.off < CLOSE) & (m.twist < STRAIGHT)
    return {
        "q": m.q.astype(np.float32), "R": m.R.astype(np.float32), "p": m.p.astype(np.float32), "way": m.way,
        "off": m.off[-1], "twist": m.twist[-1], "top_speed": m.speed.max(), "finite": m.finite.all(),
        "seconds": np.argmax(arrived) / RATE if arrived.any() else np.nan,
    }  # fmt: skip
