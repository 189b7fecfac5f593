"""The motion policy in plain NumPy, one leaf after another: the oracle of tests and the serial baseline."""

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

from hrcjax.geom.point_motion import PointMotion
from hrcjax.policy import (
    CollisionParams,
    DampingParams,
    JointLimitParams,
    JointLimits,
    PolicyParams,
    PostureParams,
    ResolveParams,
    SpeedCapParams,
    TargetParams,
)

Numbers = NDArray[np.floating]


def target(
    params: TargetParams,
    x: Numbers,
    xd: Numbers,
    goal: Numbers,
    goal_velocity: Numbers,
    goal_acceleration: Numbers,
) -> tuple[Numbers, Numbers]:
    """Metric and acceleration of a point with a goal."""
    delta = goal - x
    distance = np.linalg.norm(delta)
    pull = min(params.ramp * distance, 1.0) * params.kp
    a = pull * delta / (distance + params.eps) + params.kd * (goal_velocity - xd) + goal_acceleration
    bell = np.exp(-(distance**2) / (2 * params.length**2))
    w = (1 - params.alpha_min) * bell + params.alpha_min
    M = w * params.metric_max * np.identity(3)
    if distance > 0:
        along = delta / distance
        M = M + (1 - w) * params.metric_min * np.outer(along, along)
    return M, a


def collision(params: CollisionParams, d: float, g: Numbers, xd: Numbers) -> tuple[Numbers, Numbers]:
    """Metric and acceleration of a control point."""
    clearance = max(d - params.margin, 0.0)
    receding = float(np.dot(g, xd))
    gate = 1 - 1 / (1 + np.exp(-receding / params.v_gate))
    a = params.k_rep * np.exp(-clearance / params.s_rep) * g
    a = a - gate * params.k_damp * xd / (clearance / params.s_damp + params.eps)
    w = 0.0
    if clearance < params.r_act:
        w = params.weight * (1 - clearance / params.r_act) ** 2
    return w * (params.isotropy * np.identity(3) + (1 - params.isotropy) * np.outer(g, g)), a


def joint_limit(params: JointLimitParams, x: float, xd: float) -> tuple[float, float]:
    """Metric and acceleration of the distance to one end."""
    x = max(x, 0.0)
    gate = 0.5 * (1 - np.tanh(0.5 * xd / params.v_gate))
    M = gate * params.metric / (x / params.metric_length + params.metric_eps)
    return M, params.kp / ((x / params.length) ** 2 + params.eps) - params.kd * xd


def speed_cap(params: SpeedCapParams, qd: float) -> tuple[float, float]:
    """Metric and acceleration of one joint."""
    cut = params.v_max - params.region
    if abs(qd) <= cut:
        return 0.0, 0.0
    ratio = min((abs(qd) - cut) / params.region, params.ratio_max)
    return params.weight / (1 - ratio * ratio), -params.k * (abs(qd) - cut) * (1 if qd > 0 else -1)


def damping(params: DampingParams, qd: float) -> tuple[float, float]:
    """Metric and acceleration of one joint."""
    return params.weight, -params.k * qd


def posture(params: PostureParams, q: Numbers, qd: Numbers, goal: Numbers) -> tuple[float, Numbers]:
    """Metric, the same for all joints, and their accelerations."""
    delta = goal - q
    distance = np.linalg.norm(delta)
    if distance > params.reach:
        delta = delta * params.reach / distance
    return params.weight, params.kp * delta - params.kd * qd


def resolve(params: ResolveParams, M: Numbers, f: Numbers) -> Numbers:
    """The joint acceleration of the combined policy."""
    s = max(1.0, params.scale * np.max(np.abs(M)))
    return scipy.linalg.solve(M / s + params.regularisation * np.identity(len(f)), f / s, assume_a="pos")


def policy_acceleration(
    params: PolicyParams,
    q: ArrayLike,
    qd: ArrayLike,
    tool: PointMotion,
    goal: ArrayLike,
    goal_velocity: ArrayLike,
    goal_acceleration: ArrayLike,
    body: PointMotion,
    d: ArrayLike,
    g: ArrayLike,
    limits: JointLimits,
    posture_goal: ArrayLike,
) -> Numbers:
    """As `hrcjax.policy.policy_acceleration`, for NumPy arrays [rad/s^2]."""
    q, qd, d, g = np.asarray(q), np.asarray(qd), np.asarray(d), np.asarray(g)
    goal, goal_velocity, goal_acceleration = map(np.asarray, (goal, goal_velocity, goal_acceleration))
    q_min, q_max = np.asarray(limits.q_min), np.asarray(limits.q_max)
    M = np.zeros((len(q), len(q)), q.dtype)
    f = np.zeros(len(q), q.dtype)

    x, xd, J, Jd_qd = (np.asarray(part) for part in (tool.x, tool.xd, tool.J, tool.Jd_qd))
    for k in range(len(x)):
        M_k, a = target(params.target, x[k], xd[k], goal[k], goal_velocity[k], goal_acceleration[k])
        M += J[k].T @ M_k @ J[k]
        f += J[k].T @ M_k @ (a - Jd_qd[k])

    xd, J, Jd_qd = (np.asarray(part) for part in (body.xd, body.J, body.Jd_qd))
    for k in range(len(xd)):
        M_k, a = collision(params.collision, float(d[k]), g[k], xd[k])
        M += J[k].T @ M_k @ J[k]
        f += J[k].T @ M_k @ (a - Jd_qd[k])

    posture_metric, posture_a = posture(params.posture, q, qd, np.asarray(posture_goal))
    for j in range(len(q)):
        low = joint_limit(params.joint_limit, q[j] - q_min[j], qd[j])
        high = joint_limit(params.joint_limit, q_max[j] - q[j], -qd[j])
        leaves = [
            low,
            (high[0], -high[1]),
            speed_cap(params.speed_cap, qd[j]),
            damping(params.damping, qd[j]),
            (posture_metric, posture_a[j]),
        ]
        for m, a in leaves:
            M[j, j] += m
            f[j] += m * a
    return resolve(params.resolve, M, f)
