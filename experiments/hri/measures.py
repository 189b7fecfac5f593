"""Measures of one run of the HRI paper's experiment: in the paper's form, in SI units, and what the paper leaves out.

The paper's figures are plain differences of tool positions per sample, so they depend on the rate: its magnitudes fit about
4 samples a second. Both forms are of the same motion, resampled by cubics to a stated rate.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.metrics.samples import resample
from hrcjax.metrics.smoothness import (
    acceleration_variance,
    mean_curvature_change,
    mean_squared_difference_jerk,
    mean_squared_jerk,
    spectral_arc_length,
    total_jerk,
)
from hrcjax.numerics import safe_norm
from hrcjax.typing import Array

PAPER_RATE = 4.0
"""Of the paper's form [1/s]."""
SI_RATE = 50.0
"""Of the forms in SI units: third differences in single precision carry rounding noise above it [1/s]."""
SLOWEST = 0.1
"""Samples of a slower tool have no curvature: the mask of its mean change. At 0.02 m/s, four samples a second of one run gave 0.7 to
24 1/m with where they fell, at the tool's turns; at 0.1 m/s 0.5 to 0.65 [m/s]."""
MOVING = 0.05
"""Joint speed above which a contact is one of a moving arm [rad/s]."""


class Measured(NamedTuple):
    """Measures of a run."""

    variance_x: float
    """Variance of the second difference along x, paper's form [m^2/sample^4]"""
    variance_y: float
    """Along y [m^2/sample^4]"""
    variance_z: float
    """Along z [m^2/sample^4]"""
    total_jerk: float
    """Sum of the norms of the third differences, paper's form: grows with the duration [m/sample^3]"""
    msj: float
    """Mean over samples and axes of the squared third difference, paper's form [m^2/sample^6]"""
    curvature: float
    """Mean of |curvature(k + 1) - curvature(k)| at the paper's rate over samples whose tool moves [1/m]"""
    variance_si: float
    """Variance of the acceleration, summed over the axes [m^2/s^4]"""
    jerk_si: float
    """Mean of the jerk's norm [m/s^3]"""
    msj_si: float
    """Mean of the jerk's squared norm [m^2/s^6]"""
    curvature_si: float
    """Mean of |d curvature / dt| over samples whose tool moves [1/(m s)]"""
    sparc: float
    """Spectral arc length of the tool's speed, nearer 0 is smoother [1]"""
    legs: int
    """Arrivals at a waypoint"""
    cycle_time: float
    """Time there and back: twice the mean of a leg up to the last arrival; or twice the whole time by one leg more, if that is
    longer: who stands to the end is not quick [s]"""
    leg_length: float
    """Way of the tool in a leg, to the last arrival; NaN: no arrival [m]"""
    min_separation: float
    """Least exact distance of the arm to the person [m]"""
    min_clearance: float
    """Least exact distance of the moving links to obstacles [m]"""
    contacts: int
    """Times that the moving arm and the person came to touch"""
    contacts_standing: int
    """Times that the person came to touch a standing arm"""
    success: bool
    """No contact of the moving arm, and at least one cycle"""
    recall: float
    """Share of configurations between the waypoints truly in collision with the person that were known to be; NaN: none was [1]"""
    false_alarms: float
    """Share of those truly farther than `beyond` that were held to be in collision [1]"""


def measured(
    tool: NDArray,
    qd: NDArray,
    dt: float,
    separation: NDArray,
    clearance: NDArray,
    arrivals: Sequence[float],
    probe_true: NDArray,
    probe_known: NDArray,
    gap: float,
    beyond: float = 0.15,
) -> Measured:
    """All measures of a run.

    Args:
        tool: (tick 3) [m].
        qd: (tick joint) [rad/s].
        dt: time between ticks [s].
        separation: (tick) exact distance to the person [m].
        clearance: (tick) exact distance to obstacles [m].
        arrivals: times at which a waypoint was reached [s].
        probe_true: (probing probe) exact distance of configurations to the person [m].
        probe_known: (probing probe) what the system knew of it [m].
        gap: distance at which the system holds a configuration to be in collision [m].
        beyond: distance at which such an answer is a false alarm [m].
    """
    variance, *smooth = (np.asarray(value, float) for value in _smoothness(jnp.asarray(tool), dt))
    last = max(arrivals, default=0.0)
    legs = len(arrivals)
    way = np.linalg.norm(np.diff(tool, axis=0), axis=1)[: round(last / dt)].sum()
    moving, standing = contacts(separation, qd)
    return Measured(
        *variance.tolist(),
        **{name: float(value) for name, value in zip(SMOOTHNESS, smooth, strict=True)},
        legs=legs,
        cycle_time=2 * max(last / max(legs, 1), len(tool) * dt / (legs + 1)),
        leg_length=float(way) / legs if legs else float("nan"),
        min_separation=float(separation.min()),
        min_clearance=float(clearance.min()),
        contacts=moving,
        contacts_standing=standing,
        success=moving == 0 and legs >= 2,
        recall=share(probe_known <= gap, probe_true <= 0),
        false_alarms=share(probe_known <= gap, probe_true > beyond),
    )


SMOOTHNESS = ("total_jerk", "msj", "curvature", "variance_si", "jerk_si", "msj_si", "curvature_si", "sparc")


@partial(jax.jit, static_argnums=1)
def _smoothness(tool: Array, dt: float) -> tuple[Array, ...]:
    """Variance of the acceleration along each axis in the paper's form, and the measures of SMOOTHNESS."""
    x, fine = at_rate(tool, dt, PAPER_RATE), at_rate(tool, dt, SI_RATE)
    speed = safe_norm(jnp.diff(fine, axis=0)) * SI_RATE
    return (
        acceleration_variance(x),
        total_jerk(x),
        mean_squared_difference_jerk(x),
        mean_curvature_change(x, PAPER_RATE, slowest=SLOWEST),
        jnp.sum(acceleration_variance(fine)) * SI_RATE**4,
        total_jerk(fine) / (fine.shape[0] - 3) * SI_RATE**3,
        mean_squared_jerk(fine, SI_RATE),
        mean_curvature_change(fine, SI_RATE, slowest=SLOWEST) * SI_RATE,
        spectral_arc_length(speed, SI_RATE),
    )


def at_rate(x: Array, dt: float, rate: float) -> Array:
    """Positions (time 3) at a rate, from the first on, as long as the run lasts [m]."""
    count = int(np.floor((len(x) - 1) * dt * rate + 1e-9)) + 1
    return resample(x, jnp.asarray(1 / dt, x.dtype), jnp.asarray(rate, x.dtype), count)


def contacts(separation: NDArray, qd: NDArray) -> tuple[int, int]:
    """Times that arm and person came to touch, while the arm moved and while it stood; a touch counts as one of a moving arm if
    the arm moves at any tick of it."""
    touch = np.concatenate([[False], separation <= 0, [False]])
    begins, ends = np.flatnonzero(~touch[:-1] & touch[1:]), np.flatnonzero(touch[:-1] & ~touch[1:])
    moves = np.abs(qd).max(1) > MOVING
    moving = sum(bool(moves[a:b].any()) for a, b in zip(begins, ends, strict=True))
    return moving, len(begins) - moving


def share(found: NDArray, among: NDArray) -> float:
    """Share of the entries among which something holds; NaN: there are none [1]."""
    return float(found[among].mean()) if among.any() else float("nan")
