"""Limits of the joints, and the accelerations that keep within them for ever."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.typing import Array, Bool, Float, Joints, Scalar


class JointLimits(eqx.Module):
    """What the joints can do. All finite and, but for the range, positive."""

    q_min: Float[Array, "*batch joint"]
    """Lower end of the range [rad]."""
    q_max: Float[Array, "*batch joint"]
    """Upper end of the range [rad]."""
    qd_max: Float[Array, "*batch joint"]
    """Top speed, either way [rad/s]."""
    qdd_max: Float[Array, "*batch joint"]
    """Top acceleration, either way [rad/s^2]."""


def limit_acceleration(
    qdd: Joints, q: Joints, qd: Joints, limits: JointLimits, dt: Scalar
) -> tuple[Joints, Bool[Array, "joint"]]:
    """The acceleration nearest to the one asked for after which the joints can still keep all limits.

    In this order, so that a later rule wins over an earlier one:
    1. all joints are scaled by one number until |qdd| <= qdd_max: the direction stays;
    2. each joint is held between two bounds: after the step |qd| <= qd_max, and full braking still ends within the
       range: qd^2 <= 2 qdd_max (q_max - q), likewise below. Where the bounds exclude each other, their mean is taken;
    3. no bound asks for more than qdd_max: from a state outside the limits (too fast, or beyond the range) a joint
       brakes as hard as it can; beyond the range it is not sent back, only kept from going on.

    From a state within the limits no rule gives way, if qdd_max dt <= qd_max and each range is wider than some
    qdd_max dt^2; with a longer dt the range is kept and the speed may not be. The bounds hold whether the caller
    integrates exactly, q += qd dt + qdd dt^2 / 2, also between the samples, or qd first (semi-implicit Euler);
    explicit Euler overshoots. Differentiable almost everywhere. In float32 rounding lets a joint pass an end by some
    1e-5 rad.

    Args:
        qdd: acceleration asked for [rad/s^2].
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        limits: of the joints.
        dt: time for which the acceleration holds [s].

    Returns:
        the acceleration [rad/s^2], and True where a limit of this joint changed it (in 1. the joints above their
        limit, not those scaled along with them).
    """
    dt = jnp.asarray(dt, qdd.dtype)
    top = limits.qdd_max
    excess = jnp.abs(qdd) / top
    scaled = qdd / jnp.maximum(jnp.max(excess), 1.0)
    upper = (jnp.minimum(_fastest(limits.q_max - q, qd, top, dt), limits.qd_max) - qd) / dt
    lower = -(jnp.minimum(_fastest(q - limits.q_min, -qd, top, dt), limits.qd_max) + qd) / dt
    upper, lower = jnp.clip(upper, -top, top), jnp.clip(lower, -top, top)
    mean = (upper + lower) / 2.0
    limited = jnp.clip(scaled, jnp.minimum(lower, mean), jnp.maximum(upper, mean))
    return limited, (excess > 1.0) | (limited != scaled)


def _fastest(room: Joints, v: Joints, top: Joints, dt: Array) -> Joints:
    """The largest speed towards an end at distance `room`, one step after v, from which the joint can still stop.

    Exact step: the end after the step is room - (v + v') dt / 2 away; semi-implicit: room - v' dt. With that,
    v'^2 <= 2 top (what is left) is quadratic in v'; its root is written without a difference of near equals.
    """
    settling = jnp.maximum(room, 0.0) / (2.0 * dt)  # half of what is left at most: it comes to rest without bouncing
    semi_implicit = jnp.minimum(_stoppable(room, top, dt), settling)
    left = room - v * dt / 2.0
    inside = jnp.where(room > 0, room, 1.0)
    turn = jnp.where(room > 0, v - v * v / (2.0 * inside) * dt, -v)  # it turns within the step, at the end
    exact = jnp.where(left > 0, _stoppable(left, top, dt / 2.0), turn)
    return jnp.minimum(semi_implicit, exact)


def _stoppable(room: Joints, top: Joints, h: Array) -> Joints:
    """The v >= 0 of v^2 = 2 top (room - h v)."""
    room = jnp.maximum(room, 0.0)
    k = top * h
    return 2.0 * top * room / (k + jnp.sqrt(k * k + 2.0 * top * room))
