"""All metrics of an episode by loops and sums; names and units of `hrcjax.metrics.METRICS`.

Score: tables IX and X of Robotica 2025 in the readings that `hrcjax.metrics.score` names.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SLOW = 0.05
"""Largest speed of the tool that counts as at rest at the goal [m/s]."""
HORIZON = 5.0
"""Upper limit of the time to collision [s]."""
TOOL_WAYPOINTS = 64


def size(v: NDArray) -> NDArray:
    """Length of the vectors in the last axis."""
    return np.sqrt((v * v).sum(axis=-1))


def path_length(path: NDArray) -> float:
    """Length of a broken line (waypoint 3) [m]."""
    return float(size(np.diff(path, axis=0)).sum())


def path_bending(path: NDArray) -> float:
    """Integral of the squared curvature of a broken line [1/m]; repeated waypoints are skipped.

    At a corner the curvature is |T' - T| over the mean length of its segments; it holds for half of both, and at the
    first and the last corner to the very end.
    """
    apart = 4 * np.finfo(path.dtype).eps * np.abs(path).max()
    segments = [segment for segment in np.diff(path, axis=0) if size(segment) > apart]
    lengths = [float(size(segment)) for segment in segments]
    total = 0.0
    for k in range(len(segments) - 1):
        turn = segments[k + 1] / lengths[k + 1] - segments[k] / lengths[k]
        spacing = (lengths[k] + lengths[k + 1]) / 2
        held = lengths[k] / (1 if k == 0 else 2) + lengths[k + 1] / (1 if k == len(segments) - 2 else 2)
        total += float(turn @ turn) / spacing**2 * held
    return total


def evenly(path: NDArray, count: int) -> NDArray:
    """Points at equal distances along a broken line [m]."""
    travelled = np.concatenate([[0.0], np.cumsum(size(np.diff(path, axis=0)))])
    at = np.linspace(0, travelled[-1], count)
    return np.stack([np.interp(at, travelled, path[:, k]) for k in range(path.shape[1])], axis=1)


@dataclass(frozen=True)
class Arrived:
    """Arrival of the tool at rest at the goal."""

    success: bool
    index: int
    """The first sample there; the last one if there is none."""
    time: float
    """[s]"""


def arrival(tool: NDArray, goal: NDArray, tolerance: float, dt: float) -> Arrived:
    """The first sample within the tolerance [m] of the goal and slow; the time is where a line between samples reaches it."""
    distance, step = size(tool - goal), size(np.diff(tool, axis=0)) / dt
    for k in range(len(tool)):
        share = max(distance[k] / tolerance, step[max(k - 1, 0)] / SLOW)
        if share <= 1:
            if k == 0:
                return Arrived(True, 0, 0.0)
            before = max(distance[k - 1] / tolerance, step[max(k - 2, 0)] / SLOW)
            return Arrived(True, k, (k - 1 + (before - 1) / (before - share)) * dt)
    return Arrived(False, len(tool) - 1, (len(tool) - 1) * dt)


def jerk_measures(x: NDArray, rate: float) -> tuple[float, float]:
    """Root of the mean squared jerk [m/s^3], and -ln of the dimensionless jerk [1], of samples at a rate [Hz]."""
    if len(x) < 4:
        return 0.0, 0.0
    jerk = np.diff(x, n=3, axis=0) * rate**3
    square = float((jerk * jerk).sum(axis=1).mean())
    peak = float(size(np.diff(x, axis=0)).max()) * rate
    duration = (len(x) - 1) / rate
    whole = square * duration**4 / peak**2 if peak > 0 else 0.0
    return float(np.sqrt(square)), -float(np.log(whole)) if whole > 0 else 0.0


def spectral_arc_length(speed: NDArray, rate: float) -> float:
    """SPARC with cutoff 10 Hz, threshold 0.05 and padding 4 (Balasubramanian et al. 2015) [1]."""
    count = 1
    while count < len(speed):
        count *= 2
    count = max(count, 2) * 2**4
    spectrum = np.abs(np.fft.rfft(speed, count))
    if spectrum.max() == 0:
        return 0.0
    spectrum = spectrum / spectrum.max()
    frequency = np.arange(len(spectrum)) * rate / count
    seen = np.flatnonzero((frequency <= 10.0) & (spectrum >= 0.05))
    first, last = seen[0], seen[-1]
    if first == last:
        return 0.0
    f, m = frequency[first : last + 1], spectrum[first : last + 1]
    return -float(np.hypot(np.diff(f) / (f[-1] - f[0]), np.diff(m)).sum())


def time_to_collision(separation: float, closing: float) -> float:
    """Distance over closing speed, at most the horizon; 0 in contact [s]."""
    if separation <= 0:
        return 0.0
    return min(separation / closing, HORIZON) if closing > 0 else HORIZON


def safety_score(separation: NDArray, closing: NDArray, obstacles: NDArray, unsafe: float) -> float:
    """.4 SNE + .3 OPM + .3 CRM of the samples until arrival, out of 100.

    Args:
        obstacles: distances to the obstacles that exist, (time obstacle) [m].
        unsafe: separation under which time is unsafe [m].
    """
    navigation = 100 - 100 * float((separation < unsafe).mean())
    total = separation + obstacles.sum(axis=1)
    proximity = 100 * float(total.mean() / total.max()) if total.max() != 0 else 0.0
    collision = (
        100 * float(np.mean([time_to_collision(*one) for one in zip(separation, closing, strict=True)])) / HORIZON
    )
    return 0.4 * navigation + 0.3 * proximity + 0.3 * collision


def efficiency_score(
    q: NDArray, qd: NDArray, qdd: NDArray, tau: NDArray, dt: float, ideal: float, time: float
) -> float:
    """.3 time + .3 power + .1 trajectory smoothness + .3 joint smoothness of the samples until arrival, out of 100.

    Args:
        ideal: ideal time without a person [s].
        time: time to arrival [s].
    """
    power = np.abs(tau * qd).sum(axis=1)
    of_power = 100 * float(power.mean() / power.max()) if power.max() > 0 else 0.0
    rough, omega = np.zeros((2, q.shape[1]))
    if len(q) > 1:
        rough, omega = np.abs(np.diff(qdd, axis=0)).sum(axis=0), np.abs(np.diff(q, axis=0)).mean(axis=0) / dt
    span = rough.max() - rough.min()
    trajectory = float(np.mean((rough - rough.min()) / (span if span > 0 else 1.0) * 99 + 1))
    joint = 100 * float(omega.mean() / omega.max()) if omega.max() > 0 else 0.0
    return 0.3 * (100 * ideal / max(time, dt)) + 0.3 * of_power + 0.1 * trajectory + 0.3 * joint
