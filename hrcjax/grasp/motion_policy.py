"""The policy that brings the gripper to a pose past what a field of distance knows: the leaves of `hrcjax.policy`, composed.

| leaf | on | metric |
|---|---|---|
| target | tool point, to a frame that may move | 3 at the goal |
| orientation on SO(3) | axes of the gripper | 0.3 m^2 |
| collision | control spheres of the links but the last, on which the gripper is | from 10 cm on |
| collision | spheres of fingers and palm | from 4 cm on, on the approach from 6 mm on |
| self-collision | spheres of links three joints apart or more | from 2 cm on |
| joint limit, speed cap, damping | joints | |
| posture | joints, to a reference that may move | 0.3 in transit, where it decides which way round; small on the approach |
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.point_motion import PointMotion
from hrcjax.grasp.hand_points import HandPoints, riding_points
from hrcjax.policy import (
    CollisionParams,
    DampingParams,
    JointLimitParams,
    JointLimits,
    MovingFrame,
    OrientationParams,
    PostureParams,
    Pulled,
    ResolveParams,
    SpeedCapParams,
    TargetParams,
    add,
    collision,
    damping,
    joint_limit,
    orientation,
    pairs_apart,
    posture,
    pullback,
    pullback_joints,
    pullback_points,
    resolve,
    self_collision,
    speed_cap,
    target,
    turn,
    with_dtype,
)
from hrcjax.robot import Arm, point_motion, tool_frame
from hrcjax.typing import Array, DistanceFn, Float, Joints, Scalar

SELF_APART = 3
"""Joints between links that must not touch: nearer ones overlap as spheres [1]."""


class MotionPolicyParams(eqx.Module):
    """The numbers of the leaves; our choice where no source is named."""

    target: TargetParams = TargetParams(kp=10.0, kd=20.0, eps=0.1, ramp=1000.0, metric_max=3.0)
    """As of the cell's arm, stiff and critically damped; at most kp / kd, 0.5 m/s."""
    orientation: OrientationParams = OrientationParams(kp=25.0, kd=10.0, weight=0.3)
    """Stiff and critically damped too."""
    links: CollisionParams = CollisionParams(k_rep=6.0, weight=6.0, r_act=0.1, s_rep=0.03)
    """Between links and what the field knows."""
    hand: CollisionParams = CollisionParams(k_rep=6.0, weight=6.0, r_act=0.04, s_rep=0.01, s_damp=0.05)
    """Between fingers and palm and what the field knows, in transit."""
    near: CollisionParams = CollisionParams(k_rep=1.0, weight=0.5, r_act=0.006, s_rep=0.002, s_damp=0.003, d_min=0.001)
    """The same on the approach, whose clearance is some millimetres by the choice of the grasp."""
    own: CollisionParams = CollisionParams(k_rep=2.0, r_act=0.02, s_rep=0.01, s_damp=0.01)
    """Between links among themselves."""
    joint_limit: JointLimitParams = JointLimitParams()
    speed_cap: SpeedCapParams = SpeedCapParams()
    damping: DampingParams = DampingParams()
    transit: PostureParams = PostureParams(weight=0.3, kp=10.0, kd=7.0)
    """Pull to the joints of the reference, in transit."""
    posture: PostureParams = PostureParams(weight=0.002, kp=10.0, kd=7.0)
    """The same on the approach, where it must not hold the tool back."""
    resolve: ResolveParams = ResolveParams()


def motion_acceleration(
    params: MotionPolicyParams,
    arm: Arm,
    q: Joints,
    qd: Joints,
    goal: MovingFrame,
    hand: HandPoints,
    clearance: DistanceFn,
    near: Scalar,
    limits: JointLimits,
    rest: Joints,
    rest_speed: Joints,
) -> Joints:
    """The joint acceleration that the leaves together ask for; not limited: see `hrcjax.policy.limit_acceleration` [rad/s^2].

    Args:
        arm: of `arm_with_gripper`.
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        goal: frame that tool point and axes are drawn to.
        hand: the gripper as it is opened.
        clearance: point -> distance to what must not be touched [m].
        near: 0 in transit, 1 on the approach: which numbers the collision leaf of the hand and the posture have [1].
        limits: of the joints; only the range is used here.
        rest: joint positions that decide what the tool leaves open [rad].
        rest_speed: and their speeds [rad/s].

    Not finite if: the distance or its gradient is not.
    """
    p = with_dtype(params, q.dtype)
    links = np.array([link != arm.tool_link for link in arm.control_links])
    places = (*arm.control_links, arm.tool_link)
    moving = point_motion(arm.chain, q, qd, places, np.concatenate([arm.control_offsets, arm.tool_offset[None]]))
    body, tool = jax.tree.map(lambda a: a[:-1], moving), jax.tree.map(lambda a: a[-1], moving)
    frame = turn(lambda at: tool_frame(arm, at)[0], q, qd)
    M, a = target(p.target, tool.x, tool.xd, goal.p, goal.v, goal.a)
    total = pullback(tool.J, tool.Jd_qd, M, a)
    M, a = orientation(p.orientation, frame.R, frame.omega, goal.R, goal.omega, goal.alpha)
    total = add(total, pullback(frame.J, frame.Jd_qd, M, a))
    share = jnp.asarray(near, q.dtype)
    fingers, held = jax.tree.map(
        lambda far, close: far + share * (close - far), (p.hand, p.transit), (p.near, p.posture)
    )
    radii = jnp.asarray(arm.control_radii, q.dtype)
    outer = jax.tree.map(lambda leaf: leaf[links], body)
    total = add(total, off_surfaces(p.links, outer, radii[links], clearance))
    total = add(total, off_surfaces(fingers, riding_points(tool, frame, hand.offsets), hand.radii, clearance))
    total = add(total, self_collision(p.own, body, radii, *pairs_apart(arm.control_links, SELF_APART)))
    m_low, a_low = jax.vmap(lambda x, xd: joint_limit(p.joint_limit, x, xd))(q - limits.q_min, qd)
    m_high, a_high = jax.vmap(lambda x, xd: joint_limit(p.joint_limit, x, xd))(limits.q_max - q, -qd)
    for m, a in (
        (m_low, a_low),
        (m_high, -a_high),
        jax.vmap(lambda v: speed_cap(p.speed_cap, v))(qd),
        jax.vmap(lambda v: damping(p.damping, v))(qd),
        posture(held, q, qd - rest_speed, rest),
    ):
        total = add(total, pullback_joints(m, a))
    return resolve(p.resolve, total)


def off_surfaces(params: CollisionParams, body: PointMotion, radii: Float[Array, "point"], distance: DistanceFn) -> Pulled:  # fmt: skip
    """The pullback of the collision leaf of spheres against a field of distance.

    Args:
        body: motion of their centres.
        radii: of the spheres [m].
        distance: point -> distance [m].
    """
    d, g = jax.vmap(jax.value_and_grad(distance))(body.x)
    M, a = jax.vmap(lambda *point: collision(params, *point))(d - radii, g, body.xd)
    return pullback_points(body.J, body.Jd_qd, M, jnp.asarray(a))
