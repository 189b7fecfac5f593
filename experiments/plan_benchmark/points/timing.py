"""One law of time for all curves: time-optimal within limits of each axis, and besides with a limit of jerk."""

import logging
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PPoly

from hrcjax.reference.clock import Clock, advance
from hrcjax.safety import ClockParams

from .curve import Curve

try:
    import toppra as _toppra
except ImportError:  # told once by the run
    _toppra = None
toppra: Any = _toppra

SPEED, ACCELERATION, JERK = 0.5, 2.0, 20.0
"""Limits of each axis [m/s, m/s^2, m/s^3]."""
TICK = 0.01
"""Of the jerk-limited clock [s]."""
CRUISES = (1.0, 0.8, 0.6, 0.45, 0.3)
"""Cruising speeds that are tried, over SPEED [1]."""
GRID = 0.005
"""Spacing of the places where the time-optimal law holds its limits [m]."""


class Times(NamedTuple):
    """Durations of a curve."""

    optimal: float
    """Time-optimal within the limits of speed and acceleration, by toppra; NaN if it is not installed [s]."""
    smooth: float
    """By the jerk-limited path clock, stretched until every axis keeps all three limits [s]."""


def times(curve: Curve) -> Times:
    """Durations of a curve; of a broken line the sums over its pieces, each from rest to rest."""
    if curve.broken:
        pieces = [_straight(a, b) for a, b in zip(curve.points, curve.points[1:], strict=False)]
        each = [(optimal_time(piece), smooth_time(piece)) for piece in pieces]
        return Times(*(float(sum(x)) for x in zip(*each, strict=True)))
    return Times(optimal_time(curve.spline()), smooth_time(curve.spline()))


def _straight(a: NDArray, b: NDArray) -> CubicSpline:
    long = np.linalg.norm(b - a)
    return CubicSpline(np.linspace(0, long, 3), np.stack([a, (a + b) / 2, b]), bc_type="natural")


def optimal_time(path: PPoly) -> float:
    """Least duration within the limits of speed and acceleration of each axis, from rest to rest [s].

    The speed along the path squared is linear between grid points, so that the duration is exact for it.
    """
    if toppra is None:
        return float(np.nan)
    logging.getLogger("toppra").setLevel(logging.ERROR)
    end = float(path.x[-1])
    grid = np.linspace(0, end, max(int(np.ceil(end / GRID)), 50) + 1)
    limit = np.array([[-1.0, 1.0]] * 3)
    law = toppra.algorithm.TOPPRA(
        [
            toppra.constraint.JointVelocityConstraint(SPEED * limit),
            toppra.constraint.JointAccelerationConstraint(ACCELERATION * limit),
        ],
        _for_toppra(path),
        gridpoints=grid,
        parametrizer="ParametrizeConstAccel",
    )
    found: Any = law.compute_parameterization(0.0, 0.0)
    speed = found[1]
    if speed is None:
        return float(np.nan)
    return float(np.sum(2 * np.diff(grid) / (speed[1:] + speed[:-1])))


def _for_toppra(path: PPoly) -> Any:
    """The curve as toppra's, by its own points: the same natural spline."""
    return toppra.SplineInterpolator(path.x, path(path.x), bc_type="natural")


def smooth_time(path: PPoly) -> float:
    """Duration by the library's path clock, whose acceleration and jerk along the path are bounded [s].

    Several cruising speeds are tried. Each motion is stretched in time by one factor until every axis keeps speed,
    acceleration and jerk everywhere, and the shortest counts.
    """
    fine = np.linspace(0, path.x[-1], 2 * int(np.ceil(path.x[-1] / 0.002)) + 1)
    rate = np.linalg.norm(path(fine, 1), axis=-1)
    way = np.concatenate([[0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(fine))])
    return min(_stretched(path, fine, way, SPEED * part) for part in CRUISES)


def _stretched(path: PPoly, fine: NDArray, way: NDArray, cruise: float) -> float:
    params = ClockParams(acceleration=ACCELERATION, deceleration=ACCELERATION, brake=ACCELERATION, jerk=JERK)
    clock, places, speeds, gains = Clock(), [0.0], [0.0], [0.0]
    while places[-1] < way[-1] - 1e-6 and len(places) < 20000:
        clock = advance(params, clock, cruise, way[-1] - clock.s, TICK, False)
        places.append(clock.s)
        speeds.append(clock.v)
        gains.append(clock.a)
    v, a = np.array(speeds), np.array(gains)
    jerk = np.diff(a, append=0.0) / TICK
    jerk[-2:] = 0  # the tick in which the clock arrives drops what is left of its acceleration
    s = np.interp(np.array(places), way, fine)
    tangent, bend, twist = by_length(path, s)
    v, a, jerk = v[:, None], a[:, None], jerk[:, None]
    highest = [
        np.abs(tangent * v).max() / SPEED,
        np.sqrt(np.abs(bend * v**2 + tangent * a).max() / ACCELERATION),
        np.cbrt(np.abs(twist * v**3 + 3 * bend * v * a + tangent * jerk).max() / JERK),
    ]
    return float(max(highest) * TICK * (len(places) - 1))


def by_length(path: PPoly, s: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """First to third derivative of a curve by its length, where its parameter is s [1, 1/m, 1/m^2]."""
    d1, d2, d3 = path(s, 1), path(s, 2), path(s, 3)
    g = np.linalg.norm(d1, axis=-1, keepdims=True)
    g1 = np.sum(d1 * d2, axis=-1, keepdims=True) / g
    g2 = (np.sum(d2 * d2 + d1 * d3, axis=-1, keepdims=True) - g1**2) / g
    top, top1 = d2 * g - d1 * g1, d3 * g - d1 * g2
    return d1 / g, top / g**3, (top1 * g - 3 * top * g1) / g**5
