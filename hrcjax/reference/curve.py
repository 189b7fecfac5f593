"""A natural cubic spline by arc length, with SciPy's coefficients."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

_PLACES = np.array([0.5 - 0.15**0.5, 0.5, 0.5 + 0.15**0.5])
_WEIGHTS = np.array([5, 8, 5]) / 18


class Curve:
    """A path; as `hrcjax.plan.path_curve`."""

    def __init__(self, waypoints: NDArray, measured: NDArray | None = None) -> None:
        """Args: waypoints: equally spaced, (waypoint dim); measured: columns whose curve has the length that counts [m]."""
        self.count = len(waypoints) - 1
        spline = CubicSpline(np.arange(len(waypoints)), waypoints, bc_type="natural")
        self.coefficients = np.ascontiguousarray(spline.c.swapaxes(0, 1))  # (segment, falling power, dim)
        along = spline if measured is None else CubicSpline(np.arange(len(measured)), measured, bc_type="natural")
        speeds = np.linalg.norm(along(np.arange(self.count)[:, None] + _PLACES, 1), axis=-1)  # Gauss's rule
        self.length = float((speeds @ _WEIGHTS).sum())
        self.rate = self.count / self.length

    def at(self, s: float) -> tuple[NDArray, NDArray, NDArray]:
        """Position [m], tangent [1] and curvature vector [1/m] at arc length s [m]."""
        u = min(max(s, 0.0), self.length) * self.rate
        index = min(int(u), self.count - 1)
        t = u - index
        c3, c2, c1, c0 = self.coefficients[index]
        point = c0 + t * (c1 + t * (c2 + t * c3))
        return point, self.rate * (c1 + t * (2 * c2 + t * 3 * c3)), self.rate**2 * (2 * c2 + t * 6 * c3)
