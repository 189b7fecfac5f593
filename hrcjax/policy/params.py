"""The numbers of the motion policy, together."""

from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.policy.collision import CollisionParams
from hrcjax.policy.damping import DampingParams
from hrcjax.policy.joint_limit import JointLimitParams
from hrcjax.policy.posture import PostureParams
from hrcjax.policy.repulsion import RepulsionParams
from hrcjax.policy.resolve import ResolveParams
from hrcjax.policy.speed_cap import SpeedCapParams
from hrcjax.policy.target import TargetParams

Tree = TypeVar("Tree")


class PolicyParams(eqx.Module):
    """Every number of the policy. Each is a leaf of the pytree: swept and tuned without recompiling."""

    target: TargetParams = TargetParams()
    """Pull of the tool points to their goals."""
    collision: CollisionParams = CollisionParams()
    """Push of the control points off obstacles."""
    repulsion: RepulsionParams = RepulsionParams()
    """The planner's potential as a push on the control points, where surfaces that repel are given."""
    joint_limit: JointLimitParams = JointLimitParams()
    """Push of the joints off the ends of their ranges."""
    speed_cap: SpeedCapParams = SpeedCapParams()
    """Brake of the joints near their top speed."""
    damping: DampingParams = DampingParams()
    """Drag on every joint."""
    posture: PostureParams = PostureParams()
    """Pull of the joints to a posture; off by default."""
    resolve: ResolveParams = ResolveParams()
    """Solution of the combined policy."""


def with_dtype(params: Tree, dtype: jnp.dtype) -> Tree:
    """The same numbers as scalars of one type, so that a sweep in float64 still runs a float32 policy in float32."""
    return jax.tree.map(lambda number: jnp.asarray(number, dtype), params)
