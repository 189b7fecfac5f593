"""The motion policy in NumPy: test oracle and serial baseline.

Leaves take one point or joint, or many along leading axes.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lapack

from hrcjax.geom.point_motion import PointMotion
from hrcjax.policy import (
    CollisionParams,
    DampingParams,
    JointLimitParams,
    JointLimits,
    PolicyParams,
    PostureParams,
    Repel,
    RepulsionParams,
    ResolveParams,
    SpeedCapParams,
    TargetParams,
)
from hrcjax.reference.motion import Limits, Motion

Numbers = NDArray[np.floating]


def target(
    params: TargetParams,
    x: Numbers,
    xd: Numbers,
    goal: Numbers,
    goal_velocity: Numbers,
    goal_acceleration: Numbers,
) -> tuple[Numbers, Numbers]:
    """Metric [1] and acceleration [m/s^2] of a point with a goal."""
    delta = goal - x
    distance = np.sqrt((delta * delta).sum(axis=-1, keepdims=True))
    pull = np.minimum(params.ramp * distance, 1.0) * params.kp
    a = pull * delta / (distance + params.eps) + params.kd * (goal_velocity - xd) + goal_acceleration
    bell = np.exp(-(distance**2) / (2 * params.length**2))
    w = ((1 - params.alpha_min) * bell + params.alpha_min)[..., None]
    along = delta / np.where(distance > 0, distance, 1.0)
    M = w * params.metric_max * np.identity(3)
    return M + (1 - w) * params.metric_min * (along[..., :, None] * along[..., None, :]), a


def to_goals(
    params: TargetParams,
    x: Numbers,
    xd: Numbers,
    goal: Numbers,
    goal_velocity: Numbers,
    goal_acceleration: Numbers,
) -> tuple[Numbers, Numbers]:
    """Metrics [1] and accelerations [m/s^2] of the tool point, first, and of those that fix its orientation."""
    M, a = target(params, x, xd, goal, goal_velocity, goal_acceleration)
    M[1:] *= params.orientation_weight
    return M, a


def collision(params: CollisionParams, d: ArrayLike, g: Numbers, xd: Numbers) -> tuple[Numbers, Numbers]:
    """Metric [1] and acceleration [m/s^2] of a control point."""
    clearance = np.maximum(np.asarray(d)[..., None] - params.margin, 0.0)
    receding = (g * xd).sum(axis=-1, keepdims=True)
    gate = 1 / (1 + np.exp(receding / params.v_gate))
    a = params.k_rep * np.exp(-clearance / params.s_rep) * g
    moving = params.isotropy * xd + (1 - params.isotropy) * receding * g
    a = a - gate * params.k_damp * moving / (clearance / params.s_damp + params.eps)
    ratio = params.r_act / np.sqrt(clearance**2 + params.d_min**2)
    w = params.weight * (gate * np.maximum(ratio - 1, 0.0) ** 2)[..., None]
    outer = g[..., :, None] * g[..., None, :]
    return w * (params.isotropy * np.identity(3) + (1 - params.isotropy) * outer), a


def repulsion(
    params: RepulsionParams, k_rep: float, reach: ArrayLike, fade: ArrayLike, d: ArrayLike, g: Numbers, xd: Numbers
) -> tuple[Numbers, Numbers]:
    """Metric [1] and acceleration [m/s^2] of a control point that surfaces at d repel."""
    d, reach = np.asarray(d, np.float64), np.asarray(reach, np.float64)
    inside, least = (d < reach) & (reach > 0), params.rho_min
    d_far, reach_some = np.maximum(d, least), np.where(reach > 0, reach, 1.0)
    slope = 1 / d_far**2
    inverse = 1 / d_far + (d_far - d) * slope  # the tangent at the least distance goes on
    asked = params.rate * k_rep * np.where(inside, inverse - 1 / reach_some, 0.0) * slope * fade
    v = asked * params.speed_max / (params.speed_max + asked)
    ramp = np.where(inside, 1 - d / reach_some, 0.0)
    w = np.asarray(params.weight * ramp**2 * v / (v + params.speed_half), np.float64)
    towards = np.maximum(-(g * xd).sum(axis=-1), 0.0)
    a = np.asarray(params.gain * (v + towards**2 / (towards + params.v_smooth)), np.float64)
    return w[..., None, None] * (g[..., :, None] * g[..., None, :]), a[..., None] * g


def joint_limit(params: JointLimitParams, x: ArrayLike, xd: ArrayLike) -> tuple[Numbers, Numbers]:
    """Metric [1] and acceleration [rad/s^2] of the distance to one joint limit."""
    room, xd = np.maximum(np.asarray(x, np.float64), 0.0), np.asarray(xd, np.float64)
    gate = 0.5 * (1 - np.tanh(0.5 * xd / params.v_gate))
    M = gate * params.metric / (room / params.metric_length + params.metric_eps)
    return M, params.kp / ((room / params.length) ** 2 + params.eps) - params.kd * xd


def speed_cap(params: SpeedCapParams, qd: ArrayLike) -> tuple[Numbers, Numbers]:
    """Metric [1] and acceleration [rad/s^2] of one joint."""
    over = np.abs(qd) - (params.v_max - params.region)
    ratio = np.minimum(np.maximum(over, 0.0) / params.region, params.ratio_max)
    M = (over > 0) * params.weight / (1 - ratio * ratio)
    return M, -params.k * np.maximum(over, 0.0) * np.sign(qd)


def damping(params: DampingParams, qd: ArrayLike) -> tuple[float, Numbers]:
    """Metric, the same for all joints [1], and their accelerations [rad/s^2]."""
    return params.weight, -params.k * np.asarray(qd)


def posture(params: PostureParams, q: Numbers, qd: Numbers, goal: Numbers) -> tuple[float, Numbers]:
    """Metric, the same for all joints [1], and their accelerations [rad/s^2]."""
    delta = goal - q
    distance = np.sqrt(delta @ delta)
    if distance > params.reach:
        delta = delta * params.reach / distance
    return params.weight, params.kp * delta - params.kd * qd


def resolve(params: ResolveParams, M: Numbers, f: Numbers) -> Numbers:
    """The joint acceleration of the combined policy [rad/s^2]; NaN where the system is singular."""
    s = max(1.0, params.scale * np.abs(M).max())
    _, x, info = lapack.dposv(  # pyright: ignore[reportAttributeAccessIssue]  # made at import
        M / s + params.regularisation * np.identity(len(f)), f / s
    )
    return x if info == 0 else np.full_like(f, np.nan)


class Push(NamedTuple):
    """Surfaces that repel, as `hrcjax.policy.Repel`, of NumPy arrays."""

    k_rep: float
    reach: Numbers
    fade: Numbers
    d: Numbers
    g: Numbers


def policy_acceleration(
    params: PolicyParams,
    q: ArrayLike,
    qd: ArrayLike,
    tool: PointMotion | Motion,
    goal: ArrayLike,
    goal_velocity: ArrayLike,
    goal_acceleration: ArrayLike,
    body: PointMotion | Motion,
    d: ArrayLike,
    g: ArrayLike,
    limits: JointLimits | Limits,
    posture_goal: ArrayLike,
    *,
    repel: Sequence[Repel | Push] | None = None,
) -> Numbers:
    """As `hrcjax.policy.policy_acceleration`, for NumPy arrays [rad/s^2]."""
    q, qd, d, g = np.asarray(q), np.asarray(qd), np.asarray(d), np.asarray(g)
    goal, goal_velocity, goal_acceleration = map(np.asarray, (goal, goal_velocity, goal_acceleration))
    q_min, q_max = np.asarray(limits.q_min), np.asarray(limits.q_max)
    at, speed, to_goal, to_goal_bias = map(np.asarray, (tool.x, tool.xd, tool.J, tool.Jd_qd))
    drift, off_obstacle, off_obstacle_bias = map(np.asarray, (body.xd, body.J, body.Jd_qd))

    M_goal, a_goal = to_goals(params.target, at, speed, goal, goal_velocity, goal_acceleration)
    M_push, a_push = collision(params.collision, d, g, drift)
    J = np.concatenate([to_goal, off_obstacle])
    metric = np.concatenate([M_goal, M_push])
    wanted = np.concatenate([a_goal - to_goal_bias, a_push - off_obstacle_bias])
    for one in repel or ():
        reach, fade, room, away = map(np.asarray, (one.reach, one.fade, one.d, one.g))
        M_push, a_push = repulsion(params.repulsion, float(np.asarray(one.k_rep)), reach, fade, room, away, drift)
        J = np.concatenate([J, off_obstacle])
        metric = np.concatenate([metric, M_push])
        wanted = np.concatenate([wanted, a_push - off_obstacle_bias])
    weighed = (metric @ J).reshape(-1, len(q))  # the metrics are symmetric
    M = weighed.T @ J.reshape(-1, len(q))
    f = weighed.T @ wanted.ravel()

    m_low, a_low = joint_limit(params.joint_limit, q - q_min, qd)
    m_high, a_high = joint_limit(params.joint_limit, q_max - q, -qd)
    m_cap, a_cap = speed_cap(params.speed_cap, qd)
    m_drag, a_drag = damping(params.damping, qd)
    m_rest, a_rest = posture(params.posture, q, qd, np.asarray(posture_goal))
    M[np.diag_indices(len(q))] += m_low + m_high + m_cap + m_drag + m_rest
    f = f + m_low * a_low - m_high * a_high + m_cap * a_cap + m_drag * a_drag + m_rest * a_rest
    return resolve(params.resolve, M, f)
