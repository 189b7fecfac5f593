"""A clamped cubic B-spline: a smooth curve of few control points, whose ends are the first and the last of them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import BSpline

from hrcjax.typing import Array, Float, Scalar


def _knots(control: int) -> np.ndarray:
    if control < 4:
        raise ValueError(f"{control} control points; accepted are 4 or more")
    return np.concatenate([np.zeros(3), np.linspace(0, 1, control - 2), np.ones(3)])


def spline_matrix(control: int, places: np.ndarray) -> np.ndarray:
    """The matrix that takes control points to the points of the spline at places in [0, 1], (place control).

    Raises:
        ValueError: fewer than 4 control points.
    """
    return BSpline(_knots(control), np.eye(control), 3)(np.asarray(places, float))


def control_places(control: int) -> np.ndarray:
    """Places of the control points of a straight line travelled at constant speed (Greville's abscissae)."""
    knots = _knots(control)
    return (knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3


def fit_matrix(control: int, places: np.ndarray) -> np.ndarray:
    """The matrix that takes points at the places to the control points between the ends that come nearest to them; the first
    and the last point are ends of the spline, (inner place)."""
    S = spline_matrix(control, places)
    inner = np.linalg.pinv(S[:, 1:-1])
    ends = np.zeros((2, len(places)))
    ends[0, 0] = ends[1, -1] = 1.0
    return inner @ (np.eye(len(places)) - S[:, [0, -1]] @ ends)


class JointSpline(eqx.Module):
    """The curve as polynomials, at any place."""

    coefficients: Float[Array, "segment 4 dim"]
    """Of the powers 0 to 3 of the place in [0, 1] on each segment."""

    def __call__(self, place: Scalar) -> Float[Array, "dim"]:
        """The point at a place in [0, 1]; outside, that of the nearer end."""
        count = self.coefficients.shape[0]
        u = jnp.clip(jnp.asarray(place, self.coefficients.dtype), 0, 1) * count
        index = jnp.clip(jnp.floor(u), 0, count - 1)
        c, t = self.coefficients[index.astype(jnp.int32)], u - index
        return c[0] + t * (c[1] + t * (c[2] + t * c[3]))


def joint_spline(control_points: Float[Array, "control dim"]) -> JointSpline:
    """The spline of these control points.

    Raises:
        ValueError: fewer than 4 of them.
    """
    control = control_points.shape[0]
    knots, count = _knots(control), control - 3
    starts = np.arange(count) / count
    whole = BSpline(knots, np.eye(control), 3)
    powers = [whole.derivative(k)(starts) / (count**k * max(k * (k - 1), 1)) for k in range(3)]
    powers.append(BSpline(knots, np.eye(control), 3).derivative(3)(starts + 0.5 / count) / (6 * count**3))
    matrix = jnp.asarray(np.stack(powers, axis=1), control_points.dtype)  # (segment 4 control)
    return JointSpline(jnp.sum(matrix[..., None] * control_points, axis=2))
