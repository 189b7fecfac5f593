"""Joints that follow a path of the tool."""

import jax

from hrcjax.robot import Arm, inverse_kinematics, tool_frame
from hrcjax.typing import Array, Float, Joints, Vector3

FOLLOWING = 8
"""Steps of the inverse kinematics from one waypoint to the next."""


def joints_along(arm: Arm, q_start: Joints, waypoints: Float[Array, "waypoint 3"]) -> Float[Array, "waypoint joint"]:
    """Joint positions that take the tool through waypoints with the orientation of the start, one after another [rad]."""
    R, _ = tool_frame(arm, q_start)

    def one(q: Joints, x: Vector3) -> tuple[Joints, Joints]:
        q, _, _ = inverse_kinematics(arm, R, x, q, FOLLOWING)
        return q, q

    return jax.lax.scan(jax.checkpoint(one), q_start, waypoints)[1]
