"""A path as a motion: corners rounded by a B-spline, time-optimal by toppra, accelerations that ramp."""

# pyright: reportMissingImports=false
# toppra is compiled and an extra

import logging
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from hrcjax.robot import Arm

from .arm_spheres import ArmSpheres
from .settings import BaselineSettings

try:
    import toppra as _toppra
except ImportError:  # told once by the run
    _toppra = None
toppra: Any = _toppra

FINE = 0.001
"""Step of the law of time [s]."""
GRID = 120
"""Least number of places on the path where the limits are held."""


def installed() -> bool:
    """Whether toppra is there."""
    return toppra is not None


def rounded(path: NDArray, spacing: float) -> BSpline:
    """A clamped cubic B-spline whose control points lie on the broken line, at most `spacing` apart.

    It starts and ends where the line does, is twice continuously differentiable, stays straight where four control points
    in a row are on one piece, and cuts a corner by less than the spacing.
    """  # fmt: skip
    points = [path[:1]]
    for a, b in pairwise(path):
        count = max(int(np.ceil(np.linalg.norm(b - a) / spacing)), 1)
        points.append(a + np.linspace(0, 1, count + 1)[1:, None] * (b - a))
    control = np.concatenate(points)
    if len(control) < 5:
        along = np.linspace(0, len(control) - 1, 5)
        control = np.stack([np.interp(along, np.arange(len(control)), x) for x in control.T], axis=1)
    knots = np.concatenate([np.zeros(3), np.arange(len(control) - 2), np.full(3, len(control) - 3)])
    return BSpline(knots.astype(float), control, 3)


_Path: Any = toppra.interpolator.AbstractGeometricPath if toppra else object


class _Geometry(_Path):
    """A B-spline as toppra wants it."""

    def __init__(self, spline: BSpline) -> None:
        self.spline = spline

    def __call__(self, s: Any, order: int = 0) -> NDArray:
        return self.spline(s, order)

    @property
    def dof(self) -> int:
        return self.spline.c.shape[1]

    @property
    def path_interval(self) -> NDArray:
        return np.array([0.0, self.spline.t[-1]])

    @property
    def waypoints(self) -> tuple[NDArray, NDArray]:
        s = np.linspace(0, self.spline.t[-1], len(self.spline.c))
        return s, self.spline(s)


class Motion:
    """Joints over time from rest to rest."""

    def __init__(self, spline: BSpline, s: NDArray, sd: NDArray, sdd: NDArray) -> None:
        """
        Args:
            spline: joints along the path.
            s: place on the path, and its two derivatives, every FINE seconds.
        """
        self.spline, self.s, self.sd, self.sdd = spline, s, sd, sdd
        self.times = np.arange(len(s)) * FINE
        self.duration = float(self.times[-1])

    def at(self, t: NDArray | float) -> tuple[NDArray, NDArray, NDArray]:
        """Joints, their speeds and accelerations at times; held after the end [rad, rad/s, rad/s^2]."""
        s, sd, sdd = (np.interp(t, self.times, x) for x in (self.s, self.sd, self.sdd))
        first, second = self.spline(s, 1), self.spline(s, 2)
        sd, sdd = np.asarray(sd)[..., None], np.asarray(sdd)[..., None]
        return self.spline(s), first * sd, second * sd**2 + first * sdd


def timed(settings: BaselineSettings, spheres: ArmSpheres, spline: BSpline) -> Motion | None:
    """The fastest motion along a path within the limits; None: toppra found none."""
    logging.getLogger("toppra").setLevel(logging.ERROR)
    arm: Arm = spheres.arm
    end = float(spline.t[-1])
    grid = np.linspace(0, end, max(GRID, 6 * len(spline.c)) + 1)
    speed = settings.speed_scale * arm.qd_max
    acceleration = settings.acceleration_scale * arm.qdd_max
    fine = np.linspace(0, end, 4 * len(grid))
    pace = np.linalg.norm(np.gradient(spheres.tool(spline(fine)), fine, axis=0), axis=1)

    def limits(s: float) -> NDArray:
        tangent = np.abs(spline(s, 1)) + 1e-9
        most = settings.tool_speed / max(float(np.interp(s, fine, pace)), 1e-6)
        top = np.minimum(speed, tangent * most + 1e-9)
        return np.stack([-top, top], axis=1)

    law = toppra.algorithm.TOPPRA(
        [
            toppra.constraint.JointVelocityConstraintVarying(limits),
            toppra.constraint.JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)),
        ],
        _Geometry(spline), gridpoints=grid, parametrizer="ParametrizeConstAccel",
    )  # fmt: skip
    found: Any = law.compute_parameterization(0.0, 0.0)
    rate = found[1]
    if rate is None or not np.isfinite(rate).all():
        return None
    return _law_of_time(spline, grid, np.asarray(rate), settings.jerk_time)


def _law_of_time(spline: BSpline, grid: NDArray, rate: NDArray, width: float) -> Motion:
    """The place over time from its speeds at the grid, averaged over a window of time.

    Between grid points the acceleration along the path is constant. The average keeps the path; its acceleration changes
    by at most twice the largest one in the width of the window, and the motion takes that much longer.
    """
    when = np.concatenate([[0.0], np.cumsum(2 * np.diff(grid) / np.maximum(rate[1:] + rate[:-1], 1e-9))])
    size = round(width / FINE) if width > 0 else 1
    t = np.arange(int(np.ceil(when[-1] / FINE)) + 1) * FINE
    sd = np.interp(t, when, rate, right=0.0)
    sd[-1] = 0.0
    if size > 1:
        sd = np.convolve(sd, np.ones(size) / size)
    s = np.concatenate([[0.0], np.cumsum((sd[1:] + sd[:-1]) / 2 * FINE)])
    whole = grid[-1] / s[-1]  # what the steps of time cut off, some thousandths
    return Motion(spline, s * whole, sd * whole, np.gradient(sd, FINE) * whole)
