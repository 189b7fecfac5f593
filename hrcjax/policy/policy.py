"""The motion policy of an arm: all leaves together, resolved to one joint acceleration."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp

from hrcjax.geom.point_motion import PointMotion
from hrcjax.policy.collision import collision
from hrcjax.policy.damping import damping
from hrcjax.policy.joint_limit import joint_limit
from hrcjax.policy.limits import JointLimits
from hrcjax.policy.params import PolicyParams, with_dtype
from hrcjax.policy.posture import posture as posture_leaf
from hrcjax.policy.pullback import Pulled, add, pullback_forces, pullback_joints, weighed
from hrcjax.policy.repulsion import Repel, repulsion
from hrcjax.policy.resolve import resolve
from hrcjax.policy.speed_cap import speed_cap
from hrcjax.policy.target import to_goals
from hrcjax.typing import Array, Float, Joints


def policy_acceleration(
    params: PolicyParams,
    q: Joints,
    qd: Joints,
    tool: PointMotion,
    goal: Float[Array, "goal 3"],
    goal_velocity: Float[Array, "goal 3"],
    goal_acceleration: Float[Array, "goal 3"],
    body: PointMotion,
    d: Float[Array, "point"],
    g: Float[Array, "point 3"],
    limits: JointLimits,
    posture: Joints,
    *,
    repel: Sequence[Repel] | None = None,
) -> Joints:
    """The joint acceleration that all leaves together ask for [rad/s^2]. Not limited: see `limit_acceleration`.

    Arguments, Raises, Not finite if: as `combine`.
    """
    pulled = combine(
        params, q, qd, tool, goal, goal_velocity, goal_acceleration, body, d, g, limits, posture, repel=repel
    )
    return resolve(with_dtype(params.resolve, q.dtype), pulled)


def combine(
    params: PolicyParams,
    q: Joints,
    qd: Joints,
    tool: PointMotion,
    goal: Float[Array, "goal 3"],
    goal_velocity: Float[Array, "goal 3"],
    goal_acceleration: Float[Array, "goal 3"],
    body: PointMotion,
    d: Float[Array, "point"],
    g: Float[Array, "point 3"],
    limits: JointLimits,
    posture: Joints,
    *,
    repel: Sequence[Repel] | None = None,
) -> Pulled:
    """The sum of all leaves at the joints. Leaves of one's own are added to it by `add(combine(...), pull(...))`.

    Args:
        params: every number of the policy.
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        tool: motion of the points that have goals; usually the tool point and two points 0.5 m along its x and y axes.
        goal: where these should be [m].
        goal_velocity: velocities of the goals; 0 for goals at rest [m/s].
        goal_acceleration: their accelerations; 0 for goals at rest [m/s^2].
        body: motion of the control points.
        d: clearance of the control points: their distances less the radii of their spheres [m].
        g: gradients of the distance there [1].
        limits: of the joints; only the range is used here.
        posture: joint positions to draw to, where the posture leaf is on [rad].
        repel: sets of surfaces that repel the control points by the planner's potential, such as what stands and people; None: none.

    Not finite if: an input is not, or a length, an eps or a gate of params is 0.
    Raises: ValueError if the number of points or joints differs between arguments.
    """
    _check(q, tool, goal, goal_velocity, goal_acceleration, body, d, g)
    p = with_dtype(params, q.dtype)
    M_goal, a_goal = to_goals(p.target, tool.x, tool.xd, goal, goal_velocity, goal_acceleration)
    M_body, a = jax.vmap(lambda *point: collision(p.collision, *point))(d, g, body.xd)
    force = weighed(M_body, a - body.Jd_qd)
    for one in repel or ():
        k_rep = jnp.asarray(one.k_rep, q.dtype)
        push = jax.vmap(lambda *point, k_rep=k_rep: repulsion(p.repulsion, k_rep, *point))
        M, a = push(one.reach, one.fade, one.d, one.g, body.xd)
        M_body, force = M_body + M, force + weighed(M, a - body.Jd_qd)
    # One pullback of all points compiles in half the time of two.
    total = pullback_forces(
        jnp.concatenate([tool.J, body.J]),
        jnp.concatenate([M_goal, M_body]),
        jnp.concatenate([weighed(M_goal, a_goal - tool.Jd_qd), force]),
    )
    limit = jax.vmap(lambda x, xd: joint_limit(p.joint_limit, x, xd))
    m_low, a_low = limit(q - limits.q_min, qd)
    m_high, a_high = limit(limits.q_max - q, -qd)
    for m, a in (
        (m_low, a_low),
        (m_high, -a_high),
        jax.vmap(lambda v: speed_cap(p.speed_cap, v))(qd),
        jax.vmap(lambda v: damping(p.damping, v))(qd),
        posture_leaf(p.posture, q, qd, posture),
    ):
        total = add(total, pullback_joints(m, a))
    return total


def _check(
    q: Joints, tool: PointMotion, goal: Array, goal_velocity: Array, goal_acceleration: Array, body: PointMotion,
    d: Array, g: Array,
) -> None:  # fmt: skip
    if not goal.shape == goal_velocity.shape == goal_acceleration.shape == tool.x.shape:
        raise ValueError(
            f"each of the {tool.x.shape[0]} tool points wants one goal, goal velocity and goal acceleration of 3 "
            f"numbers; got {goal.shape}, {goal_velocity.shape} and {goal_acceleration.shape}"
        )
    if d.shape != body.x.shape[:1] or g.shape != body.x.shape:
        raise ValueError(
            f"each of the {body.x.shape[0]} control points wants one distance d and one gradient g of 3 numbers; "
            f"got {d.shape} and {g.shape}"
        )
    if not tool.J.shape[-1] == body.J.shape[-1] == q.shape[0]:
        raise ValueError(
            f"the Jacobians of tool and body want {q.shape[0]} joints, as q has; "
            f"got {tool.J.shape[-1]} and {body.J.shape[-1]}"
        )
