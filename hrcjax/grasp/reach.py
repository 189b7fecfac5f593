"""Whether the arm brings the gripper to a grasp and to the begin of its approach."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.rotation import rotation_z
from hrcjax.grasp.gripper import Gripper
from hrcjax.robot import Arm, control_points, inverse_kinematics, tool_frame, with_tool
from hrcjax.typing import Array, Bool, Float, Joints, Matrix3, Scalar, Vector3

OFF, TURNED = 1e-3, 0.01
"""Errors of a pose that counts as reached [m], [rad]."""
SWINGS = (0.0, 0.5, -0.5)
"""Turns of the shoulder from pointing at the grasp, from which a solution is sought [rad]."""


class Reach(eqx.Module):
    """Joints for a grasp."""

    q: Joints
    """At the grasp [rad]."""
    q_before: Joints
    """At the begin of the approach [rad]."""
    ok: Bool[Array, ""]
    """True if both are reached within the joint limits, with the arm above the table."""


def arm_with_gripper(arm: Arm, gripper: Gripper) -> Arm:
    """The arm whose tool point and axes are those of the gripper on its flange; the tool's capsule is the palm's height wide."""
    return with_tool(arm, gripper.length + 2 * gripper.palm[2], gripper.palm[2])


def reach(arm: Arm, R: Matrix3, p: Vector3, approach: Scalar, table: Scalar = 0.0, least: Scalar = 0.01) -> Reach:
    """Seeks joints from several guesses; the gripper may be turned by half a turn about its approach, as its fingers are alike.

    Args:
        arm: of `arm_with_gripper`.
        R: axes of the gripper in the world.
        p: its tool point at the grasp [m].
        approach: length of the approach [m].
        table: height of the table [m].
        least: how far links before the gripper stay above it [m].
    """
    dtype = p.dtype
    q_min, q_max = (jnp.asarray(a, dtype) for a in (arm.q_min, arm.q_max))
    home = jnp.asarray(arm.home, dtype)
    radii = jnp.asarray(arm.control_radii, dtype)
    tool = np.array([link == arm.tool_link for link in arm.control_links])
    pan = jnp.arctan2(p[1], p[0]) - jnp.arctan2(*_tool_at_home(arm, dtype))
    pan = jnp.arctan2(jnp.sin(pan), jnp.cos(pan))  # the short way round

    def sought(swing: Array, half: Array) -> Reach:
        guess = home.at[0].set(home[0] + pan + swing)
        turned = R @ rotation_z(half)
        q, off, twist = inverse_kinematics(arm, turned, p, guess)
        before, off_before, twist_before = inverse_kinematics(arm, turned, p - approach * R[:, 2], q, 20)
        good = (jnp.maximum(off, off_before) < OFF) & (jnp.maximum(twist, twist_before) < TURNED)
        for joints in (q, before):
            height = control_points(arm, joints)[:, 2] - radii
            good = good & jnp.all((joints > q_min) & (joints < q_max))
            good = good & jnp.all(jnp.asarray(tool) | (height > table + least))
        return Reach(q, before, good)

    swings = jnp.asarray([s for s in SWINGS for _ in range(2)], dtype)
    halves = jnp.asarray([0.0, np.pi] * len(SWINGS), dtype)
    tried = jax.vmap(sought)(swings, halves)
    first = jnp.argmax(tried.ok)
    return jax.tree.map(lambda leaf: leaf[first], tried)


def _tool_at_home(arm: Arm, dtype: jnp.dtype) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """y and x of the tool in the home posture [m]."""
    _, p = tool_frame(arm, jnp.asarray(arm.home, dtype))
    return p[1], p[0]
