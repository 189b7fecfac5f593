"""The clock of a path: how far along it the robot is, never where the path goes.

A path is followed at speed v(t) = ds/dt. Only s changes under a speed limit, so the path's geometry stays as planned.
Speeding up and planned stops have bounded acceleration and jerk; a speed limit below the speed brakes at once.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from hrcjax.numerics import safe_divide, safe_sqrt
from hrcjax.safety.params import ClockParams
from hrcjax.typing import Array, Bool, Float, Scalar

_HALVINGS = 6
"""Bisections of the interval in which the acceleration lies."""
_STEPS = 3
"""Newton steps after them: one is not enough where a kink lies between its start and the root."""
_AT_ROOT = 0.01
"""How far from the root the derivative may be taken, over what jerk changes in a tick [1]. In the last ticks before the end there may be none."""


class ClockState(eqx.Module):
    """Where the clock of a path stands."""

    s: Float[Array, ""]
    """Arc length from the start [m]."""
    v: Float[Array, ""]
    """Speed along the path, never negative [m/s]."""
    a: Float[Array, ""]
    """Acceleration of the last tick [m/s^2]."""


def initial_clock(dtype: jnp.dtype | type = jnp.float32) -> ClockState:
    """At the start of the path, standing."""
    zero = jnp.zeros((), dtype)
    return ClockState(zero, zero, zero)


def advance(
    params: ClockParams,
    state: ClockState,
    speed_limit: Scalar,
    remaining: Scalar,
    dt: Scalar,
    hold: Bool[Array, ""] | bool = False,
) -> ClockState:
    """The clock one tick later.

    Of all accelerations that keep the bounds, the largest: (1) at most `acceleration`, growing by `jerk`; (2) the speed
    comes to the limit without exceeding it; (3) a stop within `deceleration` and `jerk` ends at the path's end. Where
    the speed is above the limit, or on hold, the clock brakes with up to `brake` and forgets the jerk
    bound, also when it lets go of what exceeds `deceleration`. It never runs backwards and never beyond the end.

    Args:
        speed_limit: largest speed along the path; not a number: 0 [m/s].
        remaining: length of the path not yet travelled [m].
        dt: length of the tick [s].
        hold: stand still, whatever the limit.

    Differentiable in the parameters and the limit almost everywhere.
    """
    s, v, a = state.s, state.v, state.a
    j = params.jerk
    stopped = jnp.asarray(hold) | ~(jnp.asarray(speed_limit) > 0)
    limit = jnp.where(stopped, 0.0, speed_limit).astype(v.dtype)
    r = jnp.maximum(jnp.asarray(remaining), 0.0).astype(v.dtype)

    rising = jnp.maximum(a, -params.deceleration) + j * dt
    upper = jnp.minimum(jnp.minimum(rising, params.acceleration), _towards_limit(params, limit - v, dt))
    upper = jnp.maximum(upper, -params.brake)
    lower = jnp.minimum(jnp.maximum(a - j * dt, -params.deceleration), upper)
    chosen = _towards_end(params, v, r, lower, upper, dt)

    acceleration = jnp.maximum(chosen, -v / dt)  # no running backwards
    v_next = jnp.maximum(v + acceleration * dt, 0.0)
    step = jnp.minimum(0.5 * (v + v_next) * dt, r)
    at_end = step >= r
    return ClockState(
        s=s + step,
        v=jnp.where(at_end, 0.0, v_next),
        a=jnp.where(at_end, 0.0, acceleration),
    )


def stop_length(params: ClockParams, v: Scalar, a: Scalar, dt: Scalar = 0.0) -> Float[Array, ""]:
    """Way to a stop from speed v and acceleration a by jerk down, constant deceleration and jerk up to rest [m].

    Args:
        v: speed, not negative [m/s].
        a: acceleration of the tick that ends, not below -`deceleration` [m/s^2].
        dt: length of the ticks that follow, during each of which the acceleration is constant; 0: continuous [s].
    """
    j, a_max = params.jerk, params.deceleration
    v, a = jnp.asarray(v), jnp.asarray(a)
    half = 0.5 * j * dt  # a staircase of jerk is a straight ramp that starts half a step further
    b = a - half
    # Peak of a stop without a stretch of constant deceleration.
    peak = jnp.minimum(safe_sqrt(j * v + 0.5 * b * b - half * half), a_max)
    t_down = (a + peak) / j
    v_down = v + b * t_down - 0.5 * j * t_down**2
    s_down = v * t_down + b * t_down**2 / 2 - j * t_down**3 / 6
    rest = jnp.maximum(peak - half, 0.0)
    v_up, s_up = rest**2 / (2 * j), rest**3 / (6 * j * j)
    s_constant = safe_divide((v_down - v_up) * (v_down + v_up), 2 * peak)
    # Braking too hard for a smooth end: even with jerk up the stop comes before the acceleration is 0.
    early = peak < -a
    c = a + half
    t_up = (-c - safe_sqrt(c * c - 2 * j * v)) / j
    return jnp.where(early, v * t_up + c * t_up**2 / 2 + j * t_up**3 / 6, s_down + s_constant + s_up)


def _towards_limit(params: ClockParams, missing: Float[Array, ""], dt: Scalar) -> Float[Array, ""]:
    """Acceleration of this tick after which jerk down meets the speed limit with no acceleration left [m/s^2]."""
    j = params.jerk
    ramp = safe_sqrt(2 * j * missing) - 0.5 * j * dt  # sum of a, a - j dt, a - 2 j dt, ... times dt is `missing`
    return jnp.where(missing > 0.5 * j * dt * dt, ramp, missing / dt)


def _towards_end(
    params: ClockParams,
    v: Float[Array, ""],
    r: Float[Array, ""],
    lower: Float[Array, ""],
    upper: Float[Array, ""],
    dt: Scalar,
) -> Float[Array, ""]:
    """The largest acceleration in [lower, upper] after which the path's end is not overrun [m/s^2].

    Bisection, then Newton steps; its derivative is that of the implicit function at the root. Where even
    `lower` overruns, the constant deceleration that stops in time, at most `brake`.
    """

    def excess(a: Float[Array, ""]) -> Float[Array, ""]:
        after = jnp.maximum(v + a * dt, 0.0)
        return stop_length(params, after, jnp.maximum(a, -params.deceleration), dt) + 0.5 * (v + after) * dt - r

    low, high = lax.stop_gradient(lower), lax.stop_gradient(upper)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        over = lax.stop_gradient(excess(middle)) > 0
        low, high = jnp.where(over, low, middle), jnp.where(over, middle, high)
    slope_of = jax.grad(excess)
    root = low
    for _ in range(_STEPS):
        root = jnp.clip(lax.stop_gradient(root - safe_divide(excess(root), slope_of(root))), low, high)
    here = excess(root)  # its derivative there, that of an implicit function; the value stays
    at, slope = lax.stop_gradient((here, slope_of(root)))
    is_root = (slope > 0) & (jnp.abs(at) <= _AT_ROOT * params.jerk * dt * slope)
    root = root - jnp.where(is_root, (here - at) / jnp.where(is_root, slope, 1.0), 0.0)
    root = jnp.clip(root, lower, upper)
    emergency = jnp.maximum(jnp.minimum(lower, -safe_divide(v * v, 2 * r)), -params.brake)
    return jnp.where(excess(upper) <= 0, upper, jnp.where(excess(lower) > 0, emergency, root))
