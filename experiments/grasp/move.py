"""The arm goes to a grasp past what the map knows of the object, and what is stored of it."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.field import GPField, distance
from hrcjax.grasp.arm_motion import CLOSE, RATE, STRAIGHT, Moved, move_to_grasp
from hrcjax.grasp.candidates import Grasps
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.motion_policy import MotionPolicyParams
from hrcjax.robot import Arm


@partial(jax.jit, static_argnums=(0, 1))
def move(
    arm: Arm, gripper: Gripper, params: MotionPolicyParams, field: GPField, grasp: Grasps, approach: jax.Array, q_before: jax.Array
) -> Moved:  # fmt: skip
    """The motion from home to one grasp.

    Args:
        arm: of `arm_with_gripper`.
        field: of the object's points; the table is z = 0.
        approach: length of the approach [m].
        q_before: joints at its begin, by the inverse kinematics [rad].
    """

    def clearance(x: jax.Array) -> jax.Array:
        return jnp.minimum(distance(field, x), x[2])

    return move_to_grasp(arm, gripper, params, clearance, grasp.R, grasp.p, grasp.opening, approach, q_before)


def summary(moved: Moved) -> dict[str, Any]:
    """What is stored of a motion: its end, and its tool poses from the begin of the approach on."""
    m = jax.tree.map(np.asarray, moved)
    arrived = (m.off < CLOSE) & (m.twist < STRAIGHT)
    return {
        "q": m.q.astype(np.float32), "R": m.R.astype(np.float32), "p": m.p.astype(np.float32), "way": m.way,
        "off": m.off[-1], "twist": m.twist[-1], "top_speed": m.speed.max(), "finite": m.finite.all(),
        "seconds": np.argmax(arrived) / RATE if arrived.any() else np.nan,
    }  # fmt: skip
