"""The path clock in plain floats; as `hrcjax.safety.clock`."""

from math import sqrt
from typing import Any, NamedTuple

from scipy.optimize import brentq

from hrcjax.safety import ClockParams

ROUNDING = 1e-12
"""Error of the acceleration [m/s^2]."""


class Clock(NamedTuple):
    """State of the path clock."""

    s: float = 0.0
    """Arc length travelled [m]."""
    v: float = 0.0
    """Speed along the path [m/s]."""
    a: float = 0.0
    """Acceleration of the last tick [m/s^2]."""


def stop_length(params: ClockParams, v: float, a: float, dt: float) -> float:
    """Stopping distance from speed v and acceleration a: jerk down, constant deceleration, jerk up to rest [m].

    Args:
        v: speed, not negative [m/s].
        a: acceleration of the tick that ends [m/s^2].
        dt: length of the ticks that follow [s].
    """
    j = params.jerk
    half = 0.5 * j * dt
    b = a - half
    peak = min(sqrt(max(j * v + 0.5 * b * b - half * half, 0.0)), params.deceleration)
    if peak < -a:  # braking so hard that the stop comes before the acceleration is 0
        c = a + half
        t = (-c - sqrt(max(c * c - 2 * j * v, 0.0))) / j
        return v * t + c * t**2 / 2 + j * t**3 / 6
    t = (a + peak) / j
    v_down = v + b * t - 0.5 * j * t**2
    s_down = v * t + b * t**2 / 2 - j * t**3 / 6
    rest = max(peak - half, 0.0)
    v_up, s_up = rest**2 / (2 * j), rest**3 / (6 * j * j)
    s_constant = (v_down - v_up) * (v_down + v_up) / (2 * peak) if peak else 0.0
    return s_down + s_constant + s_up


def advance(params: ClockParams, clock: Clock, limit: float, remaining: float, dt: float, hold: bool) -> Clock:
    """The clock one tick later.

    Args:
        limit: largest speed along the path; not a number: 0 [m/s].
        remaining: length of the path not yet travelled [m].
        dt: length of the tick [s].
        hold: stand still, whatever the limit.
    """
    s, v, a = clock
    j = params.jerk
    limit = 0.0 if hold or not limit > 0 else limit
    r = max(remaining, 0.0)
    missing = limit - v
    towards = sqrt(2 * j * missing) - 0.5 * j * dt if missing > 0.5 * j * dt * dt else missing / dt
    upper = max(min(max(a, -params.deceleration) + j * dt, params.acceleration, towards), -params.brake)
    lower = min(max(a - j * dt, -params.deceleration), upper)
    chosen = max(_towards_end(params, v, r, lower, upper, dt), -v / dt)
    v_next = max(v + chosen * dt, 0.0)
    step = 0.5 * (v + v_next) * dt
    if step >= r:
        return Clock(s + r, 0.0, 0.0)
    return Clock(s + step, v_next, chosen)


def _towards_end(params: ClockParams, v: float, r: float, lower: float, upper: float, dt: float) -> float:
    """The largest acceleration in [lower, upper] that does not overshoot the path's end [m/s^2]."""

    def excess(a: float) -> float:
        after = max(v + a * dt, 0.0)
        return stop_length(params, after, max(a, -params.deceleration), dt) + 0.5 * (v + after) * dt - r

    if excess(upper) <= 0:
        return upper
    if excess(lower) > 0:
        return max(min(lower, -v * v / (2 * r) if r else 0.0), -params.brake)
    root: Any = brentq(excess, lower, upper, xtol=ROUNDING)
    return float(root)
