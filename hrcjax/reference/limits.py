"""The acceleration after which the joints can still respect their limits; as `hrcjax.policy.limit_acceleration`."""

import numpy as np
from numpy.typing import NDArray

from hrcjax.reference.motion import Limits


def limit_acceleration(qdd: NDArray, q: NDArray, qd: NDArray, limits: Limits, dt: float) -> NDArray:
    """The admissible acceleration nearest to the desired one [rad/s^2].

    Args:
        qdd: desired acceleration [rad/s^2].
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        limits: of the joints.
        dt: time for which the acceleration holds [s].
    """
    top = limits.qdd_max
    scaled = qdd / max((np.abs(qdd) / top).max(), 1.0)
    room = np.stack([limits.q_max - q, q - limits.q_min])  # to the upper and to the lower end
    speed = np.stack([qd, -qd])
    most = (np.minimum(_fastest(room, speed, top, dt), limits.qd_max) - speed) / dt
    most = np.minimum(np.maximum(most, -top), top)
    upper, lower = most[0], -most[1]
    mean = (upper + lower) / 2
    return np.minimum(np.maximum(scaled, np.minimum(lower, mean)), np.maximum(upper, mean))


def _fastest(room: NDArray, v: NDArray, top: NDArray, dt: float) -> NDArray:
    """Largest speed towards a limit after a step from which the joint can still stop before it [rad/s]."""
    settling = np.maximum(room, 0.0) / (2 * dt)
    semi_implicit = np.minimum(_stoppable(room, top, dt), settling)
    left = room - v * dt / 2
    exact = _stoppable(left, top, dt / 2)
    if (left <= 0).any():  # it turns within the step
        turn = np.where(room > 0, v - v * v * dt / (2 * np.where(room > 0, room, 1.0)), -v)
        exact = np.where(left > 0, exact, turn)
    return np.minimum(semi_implicit, exact)


def _stoppable(room: NDArray, top: NDArray, h: float) -> NDArray:
    """The v >= 0 of v^2 = 2 top (room - h v) [rad/s]."""
    room, k = np.maximum(room, 0.0), top * h
    return 2 * top * room / (k + np.sqrt(k * k + 2 * top * room))
