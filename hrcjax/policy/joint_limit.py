"""Joint-limit leaf: a joint is pushed off one end of its range and slowed on its way to it."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Float


class JointLimitParams(eqx.Module):
    """Numbers of the joint-limit leaf: those RMP2 (Li et al. 2021) publishes for its arm; the HRI paper's
    system has this leaf, but off (metric 0)."""

    metric: float = 0.1
    """Metric at the distance (1 - metric_eps) metric_length when approaching fast [1]."""
    metric_length: float = 0.01
    """Distance that scales the metric [rad]."""
    metric_eps: float = 0.001
    """Keeps the metric finite at the limit [1]."""
    v_gate: float = 0.01
    """Speed over which the metric fades in, from receding to approaching [rad/s]."""
    kp: float = 1.0
    """Push at the distance `length`, before eps [rad/s^2]."""
    length: float = 0.1
    """Distance that scales the push [rad]."""
    eps: float = 0.01
    """Keeps the push finite at the limit [1]."""
    kd: float = 200.0
    """Damping of the speed [1/s]."""


def joint_limit(
    params: JointLimitParams, x: Float[Array, ""], xd: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Metric and desired acceleration of the distance of one joint to one end of its range.

    For the lower end x = q - q_min and xd = qd; for the upper one x = q_max - q, xd = -qd, and the acceleration of the
    joint is the opposite of the one returned.

    Args:
        x: distance to the end [rad]; at and beyond the end it counts as 0, where both values are largest and finite.
        xd: its rate; negative when approaching [rad/s].

    Returns:
        the metric M [1] and the acceleration a [rad/s^2].

    Not finite if: a length, an eps or v_gate is 0.

    Source: the HRI paper's system, see docs/references.md; the same leaf is in the documentation of RMPflow's implementations.
    """
    room = jnp.maximum(x, 0.0)
    gate = jax.nn.sigmoid(-xd / params.v_gate)  # 1 - sigmoid(xd / v)
    M = gate * params.metric / (room / params.metric_length + params.metric_eps)
    a = params.kp / ((room / params.length) ** 2 + params.eps) - params.kd * xd
    return M, a
