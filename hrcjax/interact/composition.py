"""The motion policy of all interactive functions: the leaves of `hrcjax.policy`, composed.

| leaf | on | keep away | follow | hand over | give way |
|---|---|---|---|---|---|
| target | tool point and two points that fix its axes, to a goal that moves | posture | hand + offset | hand + offset, or home | task, or refuge |
| distance | control spheres of the last link, against people | on | off | off | off |
| collision, repulsion | all control spheres, against everything | on | on | from the forearm on not against people, as far as `released` says | on |
| joint limit, speed cap, damping | joints | on | on | on | on |
| posture | joints | off | off | off | off |

What differs is where the goal comes from (`keep_away`, `follow`, `hand_over`, `give_way`): each a function from memory, what is seen and
the tool to memory and a frame that the tool is to ride on, without jumps. The safety layer comes after all of them.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.interact.keep_distance import KeepDistanceParams, keep_distance
from hrcjax.policy import JointLimits, PolicyParams, add, combine, pullback_points, resolve, with_dtype
from hrcjax.robot import Arm
from hrcjax.sim.default_parts import repelling
from hrcjax.sim.params import following_policy
from hrcjax.sim.parts import ArmMotion, Clearance, Goal, PolicyFn
from hrcjax.typing import Array, Bool, Float, Joints

FREE = 1.0
"""Distance that people seem to be farther from forearm, wrist and tool where these are released to them [m]."""


class InteractPolicyParams(eqx.Module):
    """The numbers of the leaves."""

    leaves: PolicyParams = eqx.field(default_factory=following_policy)
    """The cell's own."""
    keep: KeepDistanceParams = KeepDistanceParams(weight=0.0)
    """Distance that the last link keeps from people; off unless weighed."""
    released: Float[Array, ""] | float = 0.0
    """1: forearm, wrist and tool may come near people, as collision and repulsion do not know them there; the safety layer does [1]."""


FOREARM = 3
"""Links before the last one down to the forearm [1]."""


def last_link(arm: Arm) -> Bool[np.ndarray, "point"]:
    """Which control spheres are on the last link and its tool."""
    return np.asarray(arm.control_links) == arm.tool_link


def forearm(arm: Arm) -> Bool[np.ndarray, "point"]:
    """Which are on the forearm, the wrist, the last link and its tool. The pose of a tool beside a hand decides where these are: what pushed
    the forearm off would push the tool off its place."""
    return np.asarray(arm.control_links) >= arm.tool_link - FOREARM


def interactive_policy(arm: Arm) -> PolicyFn:
    """The `PolicyFn` of an arm; its parameters are `InteractPolicyParams`."""
    outer = forearm(arm)
    last = np.flatnonzero(last_link(arm))

    def ask(params: InteractPolicyParams, moved: ArmMotion, goal: Goal, clearance: Clearance, limits: JointLimits) -> Joints:  # fmt: skip
        room = released(clearance, outer, params.released)
        pulled = combine(
            params.leaves, moved.q, moved.qd, moved.tool, goal.x, goal.xd, goal.xdd, moved.body, room.distance, room.gradient, limits,
            goal.posture, repel=repelling(moved, goal, room),
        )  # fmt: skip
        keep = with_dtype(params.keep, moved.q.dtype)
        body = jax.tree.map(lambda leaf: leaf[last], moved.body)
        M, a = jax.vmap(lambda *point: keep_distance(keep, *point))(
            clearance.person_distance[last], clearance.person_gradient[last], body.xd
        )
        pulled = add(pulled, pullback_points(body.J, body.Jd_qd, M, jnp.asarray(a)))
        return resolve(with_dtype(params.leaves.resolve, moved.q.dtype), pulled)

    return ask


def released(clearance: Clearance, outer: Bool[np.ndarray, "point"], share: Float[Array, ""] | float) -> Clearance:
    """The distances as the leaves are to know them: with the share, people are farther from the outer points by `FREE`."""
    free = jnp.asarray(share, clearance.distance.dtype) * jnp.asarray(outer, clearance.distance.dtype) * FREE
    people = clearance.person_distance + free
    alone = jnp.asarray(outer) & (free > 0)
    nearer = alone & (people > clearance.standing_distance)
    return eqx.tree_at(
        lambda c: (c.distance, c.gradient, c.person_distance),
        clearance,
        (
            jnp.where(alone, jnp.minimum(jnp.maximum(clearance.distance, people), clearance.standing_distance), clearance.distance),
            jnp.where(nearer[:, None], clearance.standing_gradient, clearance.gradient),
            people,
        ),
    )  # fmt: skip
