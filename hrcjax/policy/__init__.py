"""Riemannian motion policies: leaves in task space, pulled back to the joints, added and resolved."""

from hrcjax.policy.collision import CollisionParams, collision
from hrcjax.policy.damping import DampingParams, damping
from hrcjax.policy.joint_limit import JointLimitParams, joint_limit
from hrcjax.policy.limits import JointLimits, limit_acceleration
from hrcjax.policy.params import PolicyParams, with_dtype
from hrcjax.policy.policy import combine, policy_acceleration
from hrcjax.policy.posture import PostureParams, posture
from hrcjax.policy.pullback import Pulled, add, pull, pullback, pullback_forces, pullback_joints, pullback_points
from hrcjax.policy.repulsion import Repel, RepulsionParams, repulsion
from hrcjax.policy.resolve import ResolveParams, resolve
from hrcjax.policy.speed_cap import SpeedCapParams, speed_cap
from hrcjax.policy.target import TargetParams, target, to_goals

__all__ = [
    "CollisionParams", "DampingParams", "JointLimitParams", "JointLimits", "PolicyParams", "PostureParams", "Pulled",
    "Repel", "RepulsionParams", "ResolveParams", "SpeedCapParams", "TargetParams", "add", "collision", "combine",
    "damping", "joint_limit", "limit_acceleration", "policy_acceleration", "posture", "pull", "pullback",
    "pullback_forces", "pullback_joints", "pullback_points", "repulsion", "resolve", "speed_cap", "target", "to_goals",
    "with_dtype",
]  # fmt: skip
