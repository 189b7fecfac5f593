"""Grasps of a two-finger gripper, from the points of an object: contacts with normals, antipodal pairs, approaches, reach."""

from hrcjax.grasp.antipodal import Pair, antipodal
from hrcjax.grasp.approach import body_clearance, gripper_axes
from hrcjax.grasp.arm_motion import Moved, move_to_grasp
from hrcjax.grasp.candidates import Grasps, best_pairs, grasp_candidates
from hrcjax.grasp.contacts import Contacts, NormalFn, by_hessian, by_nearest, by_plane, contacts
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.gripper_mjcf import gripper_xml
from hrcjax.grasp.hand_points import HandPoints, hand_points, riding_points
from hrcjax.grasp.motion_policy import MotionPolicyParams, motion_acceleration, off_surfaces
from hrcjax.grasp.params import GraspParams
from hrcjax.grasp.reach import Reach, arm_with_gripper, reach
from hrcjax.grasp.seen_points import SeenPoints, seen_points

__all__ = [
    "Contacts", "GraspParams", "Grasps", "Gripper", "HandPoints", "MotionPolicyParams", "Moved", "NormalFn", "Pair",
    "Reach", "SeenPoints", "antipodal", "arm_with_gripper", "best_pairs", "body_clearance", "by_hessian", "by_nearest",
    "by_plane", "contacts", "grasp_candidates", "gripper_axes", "gripper_xml", "hand_points", "motion_acceleration",
    "move_to_grasp", "off_surfaces", "reach", "riding_points", "seen_points",
]  # fmt: skip
