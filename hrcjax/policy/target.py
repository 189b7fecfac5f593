"""Target leaf: a point is drawn to its goal, softly near it and with a bounded pull far from it."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.numerics import safe_norm, unit
from hrcjax.typing import Array, Float, Vector3


class TargetParams(eqx.Module):
    """Numbers of the target leaf: those of the HRI paper's system (UR5e with a gripper)."""

    kp: float = 0.5
    """Pull far from the goal; kp / kd is the cruising speed [m/s^2]."""
    kd: float = 1.0
    """Damping of the velocity [1/s]."""
    eps: float = 0.075
    """Distance that softens the direction of the pull [m]."""
    ramp: float = 20.0
    """The pull is cut in proportion to the distance below 1 / ramp [1/m]."""
    length: float = 0.05
    """Distance over which the metric changes from the goal's to the far one [m]."""
    alpha_min: float = 0.03
    """Share of the goal's metric that remains far from the goal [1]."""
    metric_max: float = 1.5
    """Metric at the goal, in all directions [1]."""
    metric_min: float = 0.2
    """Metric far from the goal, along the line to it [1]."""
    orientation_weight: float = 0.1
    """Metric of all points but the first, as a share of that of the first: where not all can be had, orientation gives way
    before position. 1 is the source's [1]."""


def target(
    params: TargetParams,
    x: Vector3,
    xd: Vector3,
    goal: Vector3,
    goal_velocity: Vector3,
    goal_acceleration: Vector3,
) -> tuple[Float[Array, "3 3"], Vector3]:
    """Metric and desired acceleration of one point with one goal.

    A goal at rest (velocity and acceleration 0) gives the leaf of the source. For a moving goal the damping acts on
    the velocity relative to it and its acceleration is added, so that a point on the goal stays on it.
    Orientation follows from three points: the tool point and two points 0.5 m along the tool's x and y axes, `to_goals`.

    Args:
        x: the point [m].
        xd: its velocity [m/s].
        goal: where it should be [m].
        goal_velocity: velocity of the goal [m/s].
        goal_acceleration: acceleration of the goal [m/s^2].

    Returns:
        the metric M [1] and the acceleration a [m/s^2].

    Not finite if: eps or length is 0.

    Source: the HRI paper's system, see docs/references.md; RMP2 (Li et al. 2021) publishes the same leaf without the ramp. The pull has a
    kink at |goal - x| = 1 / ramp; elsewhere, at the goal too, both values are differentiable.
    """
    delta = goal - x
    n = safe_norm(delta)
    pull = jnp.minimum(params.ramp * n, 1.0) * params.kp / (n + params.eps)
    a = pull * delta - params.kd * (xd - goal_velocity) + goal_acceleration
    far = (params.alpha_min - 1.0) * jnp.expm1(-(n * n) / (2.0 * params.length**2))  # 1 - w
    along = unit(delta)
    M = (1.0 - far) * params.metric_max * jnp.eye(3, dtype=x.dtype)
    return M + far * params.metric_min * along[:, None] * along[None, :], a


def to_goals(
    params: TargetParams,
    x: Float[Array, "goal 3"],
    xd: Float[Array, "goal 3"],
    goal: Float[Array, "goal 3"],
    goal_velocity: Float[Array, "goal 3"],
    goal_acceleration: Float[Array, "goal 3"],
) -> tuple[Float[Array, "goal 3 3"], Float[Array, "goal 3"]]:
    """The leaves of the tool point and of the points that fix its orientation, whose metric is `orientation_weight` times as large.

    Arguments, Returns: as `target`, of all points, the tool point first.
    """
    M, a = jax.vmap(lambda *point: target(params, *point))(x, xd, goal, goal_velocity, goal_acceleration)
    share = jnp.where(jnp.arange(x.shape[0]) == 0, 1.0, params.orientation_weight).astype(x.dtype)
    return share[:, None, None] * M, a
