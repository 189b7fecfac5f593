"""What is executed of a planner's broken line: the smoothest curve of its points that the check accepts."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from .scenes import CLEARANCE, PointScene

SPACINGS = (0.08, 0.06, 0.04, 0.03, 0.02, 0.015, 0.01, 0.0075, 0.005)
"""Spacings of the points on the broken line that splines are laid through, the smoothest first [m]."""
STEP = 0.001
"""Spacing of the points that are checked [m]."""
TOLERANCE = 0.0005
"""Violation of clearance and bounds that counts as kept, as in the library's planner [m]."""
LEAST_KNOTS = 5


class Verdict(NamedTuple):
    """What the check says of a curve."""

    kept: bool
    """From start to goal, clearance and bounds kept."""
    clearance: float
    """Least surface distance to an obstacle [m]."""


@dataclass(frozen=True)
class Curve:
    """A natural cubic spline by the length of its chords; or a broken line, which is at rest at every corner."""

    points: NDArray
    """(point 3), no two neighbours at one place [m]."""
    broken: bool = False

    @property
    def knots(self) -> NDArray:
        """Length of chords up to each point [m]."""
        return np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))])

    def spline(self) -> CubicSpline:
        """As a function of the length of chords [m]."""
        return CubicSpline(self.knots, self.points, bc_type="natural")

    def sampled(self, step: float = STEP) -> NDArray:
        """Points along it, at most about `step` apart, ends and corners among them [m]."""
        knots = self.knots
        if self.broken:
            parts = [self.points[:1]]
            for a, b, long in zip(self.points, self.points[1:], np.diff(knots), strict=False):
                parts.append(a + np.linspace(0, 1, int(np.ceil(long / step)) + 1)[1:, None] * (b - a))
            return np.concatenate(parts)
        return self.spline()(np.linspace(0, knots[-1], int(np.ceil(knots[-1] / step)) + 1))

    def length(self) -> float:
        """Length [m]."""
        if self.broken:
            return float(self.knots[-1])
        s, weight = _gauss(self.knots)
        return float(np.sum(weight * np.linalg.norm(self.spline()(s, 1), axis=-1)))

    def bending_energy(self) -> float:
        """Integral of the squared curvature over the length [1/m]; infinite if it has corners."""
        if self.broken:
            turn = np.diff(np.diff(self.points, axis=0) / np.diff(self.knots)[:, None], axis=0)
            return float(np.inf) if (np.linalg.norm(turn, axis=1) > 1e-9).any() else 0.0
        s, weight = _gauss(self.knots)
        first, second = self.spline()(s, 1), self.spline()(s, 2)
        speed = np.linalg.norm(first, axis=-1)
        return float(np.sum(weight * np.sum(np.cross(first, second) ** 2, axis=-1) / speed**5))


def _gauss(knots: NDArray) -> tuple[NDArray, NDArray]:
    """Places and weights of Gauss's rule of 5 points on every segment."""
    at, weight = np.polynomial.legendre.leggauss(5)
    half = np.diff(knots)[:, None] / 2
    return (knots[:-1, None] + half * (1 + at)).ravel(), (half * weight).ravel()


def check(scene: PointScene, curve: Curve) -> Verdict:
    """Whether a curve leads from start to goal with the clearance and within the bounds, by dense samples."""
    x = curve.sampled()
    clearance = float(scene.distances(x).min())
    ends = max(np.abs(x[0] - scene.start).max(), np.abs(x[-1] - scene.goal).max()) < 1e-5
    outside = max((scene.lower - x).max(), (x - scene.upper).max())
    return Verdict(bool(ends and clearance >= CLEARANCE - TOLERANCE and outside <= TOLERANCE), clearance)


def without_repeats(points: NDArray) -> NDArray:
    """The points without those that lie on the one before them; start and goal stay."""
    kept = [points[0]]
    for x in points[1:]:
        if np.linalg.norm(x - kept[-1]) > 1e-6:
            kept.append(x)
    return np.array(kept if len(kept) > 1 else [points[0], points[-1]])


def resampled(points: NDArray, spacing: float) -> NDArray:
    """Points at equal distances along the broken line, about `spacing` apart [m]."""
    ends = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.linspace(0, ends[-1], max(int(np.rint(ends[-1] / spacing)) + 1, LEAST_KNOTS))
    return np.stack([np.interp(at, ends, points[:, k]) for k in range(3)], axis=1)


def curves(points: NDArray) -> Iterator[Curve]:
    """Curves of a broken line, the smoothest first, the broken line itself last."""
    line = without_repeats(points)
    for spacing in SPACINGS:
        yield Curve(without_repeats(resampled(line, spacing)))
    yield Curve(line, broken=True)


def executed(scene: PointScene, points: NDArray) -> tuple[Curve, Verdict]:
    """The first of the curves that the check accepts; if it accepts none, the broken line with its verdict."""
    curve, verdict = Curve(points), Verdict(False, -np.inf)
    for curve in curves(points):
        verdict = check(scene, curve)
        if verdict.kept:
            break
    return curve, verdict
