"""A smooth curve through waypoints, as a function of the length travelled on it."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import require_floating, safe_divide, safe_norm
from hrcjax.typing import Array, Float, Scalar

_GAUSS = ((0.5 - 0.15**0.5, 5 / 18), (0.5, 8 / 18), (0.5 + 0.15**0.5, 5 / 18))
"""Places and weights of Gauss's rule of three points on [0, 1]."""


class PathCurve(eqx.Module):
    """Natural cubic spline: its second derivative is continuous, and zero at both ends.

    Its argument s is the length travelled, in [0, length]; outside it is taken at the nearer end. The speed |dp/ds|
    is 1 to within 1 % if the waypoints are equally spaced and turn by less than about 25 degrees each.
    """

    coefficients: Float[Array, "segment 4 dim"]
    """Of the powers 0 to 3 of the place in [0, 1] on each segment [m]."""
    length: Float[Array, ""]
    """Length of the curve [m]."""

    def _locate(self, s: Scalar) -> tuple[Float[Array, "4 dim"], Float[Array, ""], Float[Array, ""]]:
        """Coefficients of the segment that holds s, the place on it, and segments per length [1/m]."""
        count = self.coefficients.shape[0]
        rate = safe_divide(jnp.asarray(count, self.length.dtype), self.length)
        u = jnp.clip(jnp.asarray(s, self.length.dtype), 0, self.length) * rate
        index = jnp.clip(jnp.floor(u), 0, count - 1)
        return self.coefficients[index.astype(jnp.int32)], u - index, rate

    def point(self, s: Scalar) -> Float[Array, "dim"]:
        """Position after the length s [m]."""
        c, t, _ = self._locate(s)
        return c[0] + t * (c[1] + t * (c[2] + t * c[3]))

    def tangent(self, s: Scalar) -> Float[Array, "dim"]:
        """Derivative of the position by s [1]."""
        c, t, rate = self._locate(s)
        return rate * (c[1] + t * (2 * c[2] + t * 3 * c[3]))

    def curvature(self, s: Scalar) -> Float[Array, "dim"]:
        """Second derivative of the position by s: the curvature vector [1/m]."""
        c, t, rate = self._locate(s)
        return rate * rate * (2 * c[2] + t * 6 * c[3])


def path_curve(waypoints: Float[Array, "waypoint dim"]) -> PathCurve:
    """The curve through equally spaced waypoints.

    Raises:
        ValueError: fewer than 3 waypoints.
    """
    require_floating("path_curve", waypoints=waypoints)
    count = waypoints.shape[0]
    if count < 3:
        raise ValueError(f"no curve through {count} waypoints; accepted are 3 or more")
    second = jnp.asarray(_second_derivatives(count), waypoints.dtype) @ waypoints
    p, q = waypoints[:-1], waypoints[1:]
    m, n = second[:-1], second[1:]
    coefficients = jnp.stack([p, q - p - (2 * m + n) / 6, m / 2, (n - m) / 6], axis=1)
    return PathCurve(coefficients, jnp.sum(_segment_lengths(coefficients)))


def equally_spaced(waypoints: Float[Array, "waypoint dim"]) -> Float[Array, "waypoint dim"]:
    """As many points on the smooth curve through nearly equally spaced waypoints, at more nearly equal lengths of it [m].

    Raises:
        ValueError: fewer than 3 waypoints.
    """
    coefficients = path_curve(waypoints).coefficients
    lengths = _segment_lengths(coefficients)
    ends = jnp.cumsum(lengths)
    at = ends[-1] * jnp.linspace(0, 1, waypoints.shape[0], dtype=waypoints.dtype)[1:-1]
    index = jnp.minimum(jnp.sum(ends[None, :] <= at[:, None], axis=1), lengths.shape[0] - 1)
    t = safe_divide(at - (ends[index] - lengths[index]), lengths[index])[:, None]
    c = coefficients[index]
    inner = c[:, 0] + t * (c[:, 1] + t * (c[:, 2] + t * c[:, 3]))
    return jnp.concatenate([waypoints[:1], inner, waypoints[-1:]])


def _segment_lengths(coefficients: Float[Array, "segment 4 dim"]) -> Float[Array, "segment"]:
    c1, c2, c3 = coefficients[:, 1], coefficients[:, 2], coefficients[:, 3]
    speeds = [weight * safe_norm(c1 + 2 * t * c2 + 3 * t * t * c3) for t, weight in _GAUSS]
    return speeds[0] + speeds[1] + speeds[2]


def _second_derivatives(count: int) -> np.ndarray:
    """The matrix that takes waypoints to the second derivatives of their natural cubic spline."""
    inner = count - 2
    system = 4 * np.eye(inner) + np.eye(inner, k=1) + np.eye(inner, k=-1)
    differences = np.eye(inner, count) - 2 * np.eye(inner, count, k=1) + np.eye(inner, count, k=2)
    return np.concatenate([np.zeros((1, count)), 6 * np.linalg.solve(system, differences), np.zeros((1, count))])
