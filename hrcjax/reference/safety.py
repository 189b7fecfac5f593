"""Speed and separation, zones with memory, and the speed governor; as `hrcjax.safety`.

The least change of a command is solved exactly here, by nonnegative least squares.
"""

from math import inf, isfinite, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from hrcjax.safety import APPROACH_TOLERANCE, BODY_REGIONS, GREEN, RED, STOP, YELLOW, PflParams, SafetyParams, SsmParams
from hrcjax.safety.least_change import EFFORT
from hrcjax.safety.zones import BEYOND_STOP, RETREAT_RAMP, RETREAT_WIDTH


class Zone(NamedTuple):
    """Memory of the zones."""

    zone: int = GREEN
    """0 green, 1 yellow, 2 red, 3 stop."""
    waited: float = 0.0
    """Time for which a less restrictive zone has been possible [s]."""
    candidate: int = GREEN
    """The most restrictive of those."""


class Decision(NamedTuple):
    """Limits of this tick."""

    point_limit: NDArray
    """Largest speed of every point towards the person [m/s]."""
    hold: bool
    """Whether the arm must stop."""
    any_limit: float
    """Largest speed of the reference in any direction [m/s]."""
    aside: float
    """How far the person may be beside where they are seen [m]."""
    widest: float
    """Sine of the largest angle by which a direction counts as off [1]."""
    gain: float
    """How much faster the fastest point may become in this tick [m/s]."""


def safe_distance(params: SsmParams, v: float) -> float:
    """S_p at the approach speed v, for the speed of a person assumed at that distance (ISO/TS 15066, 5.5.4) [m]."""
    stopping = v / params.brake
    fixed = v * (params.reaction_time + stopping / 2) + params.intrusion + params.Z_d + params.Z_r
    close, far = (fixed + person * (params.reaction_time + stopping) for person in (params.v_h_near, params.v_h))
    return close if close < params.near and far <= params.near else max(far, params.near)


def allowed_speeds(params: SsmParams, d: NDArray) -> NDArray:
    """v(d), the inverse of S_p, for the person's speed assumed at each d [m/s].

    Args:
        d: distances; not finite: 0 m/s [m].
    """
    known = np.isfinite(d)
    person = np.where(d < params.near, params.v_h_near, params.v_h)
    excess = d - person * params.reaction_time - (params.intrusion + params.Z_d + params.Z_r)
    excess = np.where(known, np.maximum(excess, 0.0), 0.0)
    b = person + params.brake * params.reaction_time
    two_a_e = 2 * params.brake * excess
    return two_a_e / (b + np.sqrt(b * b + two_a_e))


def slowest_contact(params: PflParams) -> float:
    """v_rel,max = F_max / sqrt(mu k), the least over all regions of the body (ISO/TS 15066, A.6) [m/s]."""
    m_r = params.arm_mass / 2 + params.payload
    return min(
        region.force * region.transient / sqrt(region.mass * m_r / (region.mass + m_r) * region.stiffness)
        for region in BODY_REGIONS
    )


class Monitor:
    """The safety monitor of one episode; constants are computed once."""

    def __init__(self, params: SafetyParams, dt: float) -> None:
        """Args: dt: length of a tick [s]."""
        self.params, self.dt = params, dt
        speeds = (0.0, params.zone.red_speed, params.zone.nominal_speed)
        self.stop, self.yellow, self.green = (safe_distance(params.ssm, v) for v in speeds)
        self.contact = slowest_contact(params.pfl)

    def zone_at(self, d: float, slack: float = 0.0) -> int:
        """The zone of a distance [m], with a slack added to every threshold [m]."""
        if not isfinite(d):
            return STOP
        if d < self.stop + slack:
            return RED if self.params.zone.red_only_slows else STOP
        return GREEN if d >= self.green + slack else YELLOW if d >= self.yellow + slack else RED

    def update(self, state: Zone, d: float, hold: bool, least: int) -> Zone:
        """The zone one tick later: more restrictive at once, less restrictive after a delay, with hysteresis."""
        zone = self.params.zone
        tight = max(STOP if hold else self.zone_at(d), least)
        loose = max(STOP if hold else self.zone_at(d, zone.hysteresis), least)
        if loose >= state.zone:
            return Zone(max(tight, state.zone))
        candidate, waited = max(loose, state.candidate), state.waited + self.dt
        if waited + 0.5 * self.dt < zone.relax_time:
            return Zone(max(tight, state.zone), waited, candidate)
        return Zone(tight if tight >= state.zone else candidate)

    def __call__(
        self, state: Zone, d: NDArray, approach: NDArray, age: float, valid: bool, guarded: bool, surfaces: int
    ) -> tuple[Zone, Decision]:
        """Zone and limits of this tick.

        Args:
            d: distance of every control point's surface to the person [m].
            approach: speed of every point towards the person [m/s].
            age: of the person data [s].
            valid: whether the map of the scene exceeded no capacity.
            guarded: whether somebody may be where no camera looks: yellow and the red speed at best.
            surfaces: rows of each control point.
        """
        params = self.params
        finite = bool(np.isfinite(d).all() and np.isfinite(approach).all())
        hold = not abs(age) <= params.max_age or not finite or not valid
        state = self.update(state, float(d.min()), hold, YELLOW if guarded else GREEN)
        slow = state.zone in (RED, STOP) or guarded
        any_limit = 0.0 if hold else params.zone.red_speed if slow else params.zone.nominal_speed
        aside, gain = 0.0, inf
        if state.zone in (RED, STOP):
            old = min(max(age, 0.0), params.max_age) + self.dt
            aside = params.zone.aside + params.zone.across_speed * old
        if state.zone == STOP:
            gain = params.zone.stop_acceleration * self.dt
        if hold:
            return state, Decision(np.zeros_like(d), hold, any_limit, aside, params.zone.widest, gain)
        # any surface may be the nearest by now
        moved = params.ssm.v_h_near * (min(max(age, 0.0), params.max_age) + self.dt)
        by_now = np.maximum(d.reshape(-1, surfaces).min(axis=1).repeat(surfaces), d - moved)
        limit = np.minimum(allowed_speeds(params.ssm, by_now), params.zone.nominal_speed)
        if state.zone == STOP:
            limit = np.minimum(limit, min(params.zone.red_speed, self.contact))
            ends = self.stop + params.zone.hysteresis + BEYOND_STOP
            share = np.clip(1.0 - (d - d.min()) / RETREAT_WIDTH, 0.0, 1.0) * np.clip(
                (ends - d) / RETREAT_RAMP, 0.0, 1.0
            )
            limit = (1.0 - share) * limit - share * params.zone.retreat_speed
            away = np.clip((self.stop - d) / RETREAT_WIDTH, 0.0, 1.0) * params.zone.turn_away
            limit = np.where(away > 0, np.minimum(limit, -away), limit)
        if state.zone == RED:
            if params.zone.red_only_slows or not params.zone.red_follows_separation:
                limit = np.full_like(d, params.zone.nominal_speed)
            limit = np.minimum(limit, min(params.zone.red_speed, self.contact))
        if guarded:
            limit = np.minimum(limit, self.params.zone.red_speed)
        return state, Decision(limit, hold, any_limit, aside, params.zone.widest, gain)


def speed_scale(approach: NDArray, limit: NDArray) -> float:
    """The largest factor in [0, 1] with which no row approaches faster than its limit; 0 where a number is missing [1].

    Args:
        approach: speed of every row towards its surface [m/s].
        limit: its largest value; below 0 it counts as 0 [m/s].
    """
    if not np.isfinite(approach).all() or np.isnan(limit).any():
        return 0.0
    most = np.maximum(limit, 0.0)
    over = approach > most
    return float((most[over] / approach[over]).min()) if over.any() else 1.0


def least_change(qd: NDArray, A: NDArray, limit: NDArray) -> NDArray:
    """The nearest x to qd with A x <= limit; 0 where a number is missing [rad/s].

    Limits below 0 count (1 - s) limit, where giving a retreat up by s costs (EFFORT s)^2.

    Args:
        qd: desired joint speeds [rad/s].
        A: speed of approach by the joint speeds, (row joint) [m].
        limit: of every row [m/s].
    """
    if not np.isfinite(A).all() or np.isnan(limit).any() or not np.isfinite(qd).all():
        return np.zeros_like(qd)
    counts = np.isfinite(limit) & (np.abs(A).max(axis=1) > 0)
    A, limit = A[counts], limit[counts]
    if (A @ qd <= limit).all():
        return qd.copy()
    given_up = np.append(np.minimum(limit, 0.0) / EFFORT, 1.0)  # with EFFORT s as one more unknown, at most EFFORT
    rows = np.column_stack([np.vstack([A, np.zeros_like(qd)]), given_up])
    x = _nearest(np.append(qd, 0.0), rows, np.append(limit, EFFORT))[:-1]
    approach, most = A @ x, np.maximum(limit, 0.0) + APPROACH_TOLERANCE
    late = approach > most
    within = most[late] - 0.01 * APPROACH_TOLERANCE
    return x * min(1.0, (within / approach[late]).min(initial=1.0))


def _nearest(qd: NDArray, A: NDArray, limit: NDArray) -> NDArray:
    """The nearest x to qd with A x <= limit; 0 where there is none [rad/s].

    As a least-distance problem (Lawson and Hanson, ch. 23): with z = x - qd and h = A qd - limit, the z of least length with
    -A z >= h follows from the residual r of min |E u - (0, 1)| over u >= 0, E = (-A^T; h^T), as -r_z / r_1.
    """
    over = A @ qd - limit
    if (over <= 0).all():
        return qd.copy()
    E = np.vstack([-A.T, over])
    u, _ = nnls(E, np.append(np.zeros_like(qd), 1.0), maxiter=100 * len(over))
    r = E @ u
    return qd + r[:-1] / (1.0 - r[-1]) if r[-1] < 1.0 else np.zeros_like(qd)


def governed(qd: NDArray, J: NDArray, g: NDArray, limit: NDArray) -> NDArray:
    """The nearest joint speeds with which no point approaches a surface faster than its limit [rad/s].

    Args:
        qd: desired joint speeds [rad/s].
        J: Jacobians of the points, (point 3 joint) [m/rad].
        g: gradients of the distances, (point surface 3) [1].
        limit: of every point and surface; infinite: none [m/s].
    """
    size = np.sqrt((g * g).sum(axis=-1))
    lost = size < 0.5
    rows = -np.einsum("psi,pij->psj", g / np.where(lost, 1.0, size)[..., None], J)
    rows[lost] = 0.0
    x = least_change(qd, rows.reshape(-1, len(qd)), limit.ravel())
    speed = np.sqrt(((J @ x) ** 2).sum(axis=1))
    most = np.where(lost, np.maximum(limit, 0.0), np.inf).min(axis=1)
    fast = speed > most
    return x * min(1.0, (most[fast] / speed[fast]).min(initial=1.0))


def path_speed(qd_per_speed: NDArray, A: NDArray, limit: NDArray) -> float:
    """The largest speed along a joint direction within the limits; infinite where nothing approaches [m/s]."""
    slope = A @ qd_per_speed
    if not np.isfinite(slope).all() or np.isnan(limit).any():
        return 0.0
    towards = slope > 0
    return float((np.maximum(limit[towards], 0.0) / slope[towards]).min(initial=np.inf))


def surface_limit(d: NDArray, brake: float, margin: float, reaction: float = 0.008, floor: float = 0.0) -> NDArray:
    """The speed from which the way to the margin suffices for the reaction and to stop [m/s]: v T + v^2 / 2 a = d - margin."""
    left = np.maximum(d - margin, 0.0)
    return np.maximum(brake * (np.sqrt(reaction**2 + 2 * left / brake) - reaction), floor)


def between_factor(D: NDArray, half_gap: NDArray) -> NDArray:
    """Factor on the limit of a control point at D that covers the link to its neighbours [1]."""
    return np.sqrt(np.maximum(1.0 - (half_gap / np.maximum(D, half_gap)) ** 2, 0.0))
