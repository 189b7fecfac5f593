"""Riemannian motion policies: leaves in task space, pulled back to the joints, added and resolved."""

from hrcjax.policy.collision import CollisionParams, collision
from hrcjax.policy.damping import DampingParams, damping
from hrcjax.policy.joint_limit import JointLimitParams, joint_limit
from hrcjax.policy.limits import JointLimits, limit_acceleration
from hrcjax.policy.moving_frame import MovingFrame, frame_at_rest, riding
from hrcjax.policy.orientation import OrientationParams, Turn, orientation, turn
from hrcjax.policy.params import PolicyParams, with_dtype
from hrcjax.policy.policy import combine, policy_acceleration
from hrcjax.policy.posture import PostureParams, posture
from hrcjax.policy.pullback import Pulled, add, pull, pullback, pullback_forces, pullback_joints, pullback_points
from hrcjax.policy.repulsion import Repel, RepulsionParams, repulsion
from hrcjax.policy.resolve import ResolveParams, resolve
from hrcjax.policy.self_collision import pairs_apart, self_collision
from hrcjax.policy.speed_cap import SpeedCapParams, speed_cap
from hrcjax.policy.target import TargetParams, target, to_goals

__all__ = [
    "CollisionParams", "DampingParams", "JointLimitParams", "JointLimits", "MovingFrame", "OrientationParams",
    "PolicyParams", "PostureParams", "Pulled", "Repel", "RepulsionParams", "ResolveParams", "SpeedCapParams",
    "TargetParams", "Turn", "add", "collision", "combine", "damping", "frame_at_rest", "joint_limit",
    "limit_acceleration", "orientation", "pairs_apart", "policy_acceleration", "posture", "pull", "pullback",
    "pullback_forces", "pullback_joints", "pullback_points", "repulsion", "resolve", "riding", "self_collision",
    "speed_cap", "target", "to_goals", "turn", "with_dtype",
]  # fmt: skip
