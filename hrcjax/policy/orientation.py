"""Orientation leaf: a frame is turned to its goal on SO(3), for tasks in which three points do not stand for it."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt
from hrcjax.typing import Array, Float, Joints, Matrix3, Vector3


class OrientationParams(eqx.Module):
    """Numbers of the orientation leaf; all are our choice."""

    kp: float = 4.0
    """Pull per angle near the goal [1/s^2]."""
    kd: float = 4.0
    """Damping of the angular velocity; 2 sqrt(kp) is critical [1/s]."""
    weight: float = 0.1
    """Metric in all directions [m^2]: that of a point of metric 1 at 0.3 m from the axis."""
    eps: float = 0.05
    """Within about 2 eps of half a turn the pull falls to 0, as there is no shortest way [1]."""


class Turn(eqx.Module):
    """Orientation of a frame, and how the joints turn it: d omega / dt = J qdd + Jd_qd."""

    R: Matrix3
    """Axes of the frame as columns, in the world [1]."""
    omega: Vector3
    """Angular velocity J qd, in the world [rad/s]."""
    J: Float[Array, "3 joint"]
    """Angular Jacobian [1]."""
    Jd_qd: Vector3
    """Time derivative of J, times qd: the angular acceleration when qdd is 0 [rad/s^2]."""


def skew_part(A: Matrix3) -> Vector3:
    """The vector w for which (A - A^T) / 2 is the matrix of the cross product by w; of a turn by t about n: sin(t) n."""
    return jnp.stack([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]]) / 2


def turn(orientation: Callable[[Joints], Matrix3], q: Joints, qd: Joints) -> Turn:
    """The motion of a frame, by automatic differentiation.

    Args:
        orientation: joint positions -> rotation matrix.
        q: joint positions [rad].
        qd: joint speeds [rad/s].
    """

    def angular(q: Joints, direction: Joints) -> Vector3:
        R, dR = jax.jvp(orientation, (q,), (direction,))
        return skew_part(dR @ R.T)

    omega, Jd_qd = jax.jvp(lambda q: angular(q, qd), (q,), (qd,))
    J = jax.vmap(lambda direction: angular(q, direction), out_axes=1)(jnp.eye(q.shape[0], dtype=q.dtype))
    return Turn(orientation(q), omega, J, Jd_qd)


def orientation(
    params: OrientationParams,
    R: Matrix3,
    omega: Vector3,
    goal: Matrix3,
    goal_velocity: Vector3,
    goal_acceleration: Vector3,
) -> tuple[Float[Array, "3 3"], Vector3]:
    """Metric and desired angular acceleration of a frame with one goal.

    With t the angle from the goal to the frame and n its axis, a = -kp s(t) n - kd (omega - goal_velocity) + goal_acceleration, and
    s(t) = sin(t) / sqrt(cos^2(t / 2) + eps^2), 2 sin(t / 2) but near half a turn. s n is the gradient of a function of t alone, so that at
    a goal at rest no energy comes from it. It is smooth in R everywhere; at half a turn it is 0, an equilibrium that any motion leaves.

    Args:
        R: axes of the frame [1].
        omega: its angular velocity [rad/s].
        goal: the axes that it should have [1].
        goal_velocity: angular velocity of the goal; 0 at rest [rad/s].
        goal_acceleration: angular acceleration of the goal [rad/s^2].

    Returns:
        the metric M [m^2] and the angular acceleration a [rad/s^2], in the world.

    Not finite if: eps is 0.

    Source: Bullo and Murray 1995, proportional derivative control on SO(3); the scaled sine is ours.
    """
    error = R @ goal.T
    half = jnp.maximum(1 + jnp.trace(error), 0.0) / 4  # cos^2(t / 2)
    away = skew_part(error) / safe_sqrt(half + jnp.asarray(params.eps, R.dtype) ** 2)
    a = -params.kp * away - params.kd * (omega - goal_velocity) + goal_acceleration
    return params.weight * jnp.eye(3, dtype=R.dtype), a
