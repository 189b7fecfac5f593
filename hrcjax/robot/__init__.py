"""The UR5 and the UR5e: figures, kinematics, dynamics, shape."""

from hrcjax.geom.point_motion import PointMotion
from hrcjax.robot.body import COVER_MARGIN, Arm, arm_capsules, control_points, load_arm, tool_frame, with_tool
from hrcjax.robot.chain import Chain, chain_from_mujoco
from hrcjax.robot.dynamics import bias_force, forward_dynamics, inverse_dynamics, mass_matrix
from hrcjax.robot.from_model import arm_from_model
from hrcjax.robot.ik import inverse_kinematics
from hrcjax.robot.kinematics import link_frames, point_jacobians, point_motion, points_on_links
from hrcjax.robot.mjcf import ur_xml
from hrcjax.robot.step import ArmState, jit_for, limit_torque, step
from hrcjax.robot.tables import UR5, UR5E, ArmTable, arm_table

__all__ = [
    "COVER_MARGIN", "UR5", "UR5E", "Arm", "ArmState", "ArmTable", "Chain", "PointMotion", "arm_capsules", "arm_from_model", "arm_table", "bias_force",
    "chain_from_mujoco", "control_points", "forward_dynamics", "inverse_dynamics", "inverse_kinematics", "jit_for",
    "limit_torque", "link_frames", "load_arm", "mass_matrix", "point_jacobians", "point_motion", "points_on_links",
    "step", "tool_frame", "ur_xml", "with_tool",
]  # fmt: skip
