"""The safety monitor: from distances and the age of the data to a zone, a speed limit and a named reason of a stop."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.bits import pack, words
from hrcjax.safety.coming import Coming, at_the_nearest, leaving_thresholds, measured_limit, row_thresholds
from hrcjax.safety.governor import speed_scale
from hrcjax.safety.head import head_limit
from hrcjax.safety.least_change import UNLIMITED
from hrcjax.safety.params import SafetyParams
from hrcjax.safety.ssm import assumed_human_speed
from hrcjax.safety.zones import (
    GREEN,
    RED,
    STOP,
    YELLOW,
    ZoneState,
    retreat_share,
    turned_away,
    update_zone,
    zone_speed,
    zone_thresholds,
)
from hrcjax.typing import Array, Bool, Float, Int, Scalar

OLD_DATA = 1
MISSING_DATA = 2
TOO_CLOSE = 4
HEAD_NEAR = 8
INVALID_FRAME = 16
WAITING = 32
COMMANDED = 64

REASONS = {
    OLD_DATA: "person data too old",
    MISSING_DATA: "distance or speed missing or not a number",
    TOO_CLOSE: "person too close",
    HEAD_NEAR: "head near",
    INVALID_FRAME: "sensor frame not valid",
    WAITING: "waiting for the person to stay away",
    COMMANDED: "stopped by command",
}
"""Why the robot is stopped: bit -> words. The last one is the tick's, which reads commands; the monitor never gives it."""


class SafetyDecision(eqx.Module):
    """What the monitor allows in this tick."""

    zone: Int[Array, ""]
    """GREEN, YELLOW, RED or STOP."""
    speed_limit: Float[Array, ""]
    """Largest speed towards the person of the nearest point [m/s]."""
    point_limit: Float[Array, "point"]
    """Largest speed towards the person of every point, by its distance; negative: it is asked to retreat as fast [m/s]."""
    scale: Float[Array, ""]
    """Factor in [0, 1] that the present motion must be scaled with [1]."""
    hold: Bool[Array, ""]
    """Stand still in every direction: the data can't be trusted."""
    reasons: Int[Array, ""]
    """Bits of why the robot is stopped; 0 exactly where the zone is not STOP. In words: `describe`."""
    any_limit: Float[Array, ""] | None = None
    """Largest speed of the reference in any direction; None: `speed_limit` [m/s]."""
    aside: Float[Array, "*row"] | None = None
    """How far the person may be beside where they are seen, or of every row: the limits hold in all directions that this leaves open; None: 0
    [m]."""
    widest: Float[Array, ""] | None = None
    """Sine of the largest angle between these and the direction seen; None: 1 [1]."""
    gain: Float[Array, ""] | None = None
    """How much faster the fastest point may become in this tick; None: no bound [m/s]."""
    head_limit: Float[Array, "control"] | None = None
    """Largest speed of every control point towards the head, as `point_limit`; None: which points are near it is not known [m/s]."""


def monitor(
    params: SafetyParams,
    state: ZoneState,
    d: Float[Array, "point"],
    v_r: Float[Array, "point"],
    age: Scalar,
    dt: Scalar,
    *,
    head_distance: Scalar | Float[Array, "control"] | None = None,
    valid: Bool[Array, ""] | bool = True,
    pfl_speed: Scalar | Float[Array, "point"] | None = None,
    v_h: Scalar | None = None,
    guarded: Bool[Array, ""] | bool = False,
    by_now: Float[Array, "point"] | None = None,
    coming: Coming | None = None,
) -> tuple[ZoneState, SafetyDecision]:
    """One tick of the monitor, over the control points of the whole arm.

    The zone follows the nearest point; every point gets the limit of its own distance, or of `by_now` where that is less. The limits hold for motion
    towards the person: in a stop for closeness the robot may still retreat, and points far from everybody may move. Old, invalid or missing data, also from
    the future, hold the robot still in every direction. Motion that approaches nobody is bounded by the nominal speed, and in
    red and stop, or guarded, by the red speed. In red and in a stop limits hold in all directions in which the person may be by
    now; in a stop speed grows slowly besides.

    Args:
        d: distance of every control point's surface to the person; no person: a large finite number [m].
        v_r: speed of every point towards the person [m/s].
        age: age of the person data [s].
        dt: time since the last tick [s].
        head_distance: distance of the arm to the person's head, or of every control point, of which each then has its own limit
            towards it; None: not watched [m].
        valid: whether the sensor vouches for the frame.
        pfl_speed: power-and-force speed, one for all points or of every point; None: not watched [m/s].
        v_h: person's measured speed towards the robot; None: assumed from the distance [m/s].
        guarded: whether somebody may be where no camera looks: the zone is yellow at best, and the speed that of red, the
            reduced speed.
        by_now: distance whose v(d) bounds the speed of every point, if less than `d`, see `nearest_by_now`; None: `d` alone [m].
        coming: how the parts of a measured person come to every point, which lets zones begin nearer; None: not measured.
    """
    nearest = jnp.min(d)  # NaN if any is
    old = ~(jnp.abs(jnp.asarray(age)) <= params.max_age)
    finite = jnp.all(jnp.isfinite(d)) & jnp.all(jnp.isfinite(v_r))
    for given in (head_distance, v_h, by_now, *(() if coming is None else (coming.v_h, coming.beyond))):
        if given is not None:
            finite = finite & jnp.all(jnp.isfinite(jnp.asarray(given)))
    if pfl_speed is not None:
        known = ~jnp.isnan(jnp.asarray(pfl_speed))
        finite = finite & (jnp.all(known) if known.ndim else known)
    invalid = ~jnp.asarray(valid)
    hold = old | ~finite | invalid

    limits, leaving, stops_at = None, None, d  # what the distances count as where a stop begins as for an assumed speed
    if coming is not None:
        rows = row_thresholds(params, coming)
        limits, stops_at = at_the_nearest(d, rows), d + (zone_thresholds(params).stop - rows.stop)
        leaving = at_the_nearest(d, leaving_thresholds(params, coming, rows))
    head_nearest = None if head_distance is None else jnp.min(jnp.asarray(head_distance))
    least = jnp.where(guarded, YELLOW, GREEN)
    by_point = head_distance is not None and jnp.ndim(head_distance) > 0
    head_slack = params.zone.head_hysteresis if by_point else None
    state = update_zone(params, state, nearest, ~hold, dt, head_nearest, least, limits, leaving, head_slack)

    near_now = d if by_now is None else jnp.minimum(d, by_now)
    measured = None if coming is None else measured_limit(params.ssm, near_now, coming)

    def point_limit(
        one: Float[Array, ""], contact: Scalar | None, measured: Scalar | None
    ) -> Float[Array, ""]:  # fmt: skip
        person = assumed_human_speed(params.ssm, one) if v_h is None else v_h
        return zone_speed(params, state.zone, one, contact, person, measured)

    of_points = pfl_speed is not None and jnp.ndim(pfl_speed) > 0
    axes = (0, 0 if of_points else None, None if measured is None else 0)
    limit = jax.vmap(point_limit, in_axes=axes)(near_now, pfl_speed, measured)
    share = retreat_share(params, state.zone, stops_at)
    limit = (1.0 - share) * limit - share * params.zone.retreat_speed
    limit = jnp.minimum(limit, turned_away(params, state.zone, stops_at))
    limit = jnp.where(guarded, jnp.minimum(limit, params.zone.red_speed), limit)
    limit = jnp.where(hold, 0.0, limit)

    only_slows = params.zone.red_only_slows
    close = (nearest < (zone_thresholds(params) if limits is None else limits).stop) & (not only_slows)
    head, towards_head = jnp.asarray(False), None
    if head_distance is not None and head_nearest is not None:
        head = (head_nearest < params.zone.head_stop) & (not only_slows)
        if not by_point:
            # which points are near the head is not known: until that stop ends, none approaches
            near_head = head_nearest < params.zone.head_stop + params.zone.hysteresis
            limit = jnp.where(near_head & (state.zone == STOP), jnp.minimum(limit, 0.0), limit)
        elif not only_slows:
            towards_head = jnp.where(hold, 0.0, head_limit(params, state.zone, jnp.asarray(head_distance)))
    scale = jnp.where(hold, 0.0, speed_scale(v_r, limit))
    reasons = pack(
        {OLD_DATA: old, MISSING_DATA: ~finite, INVALID_FRAME: invalid, TOO_CLOSE: close, HEAD_NEAR: head},
    )
    slow = (state.zone == RED) | (state.zone == STOP) | jnp.asarray(guarded)
    any_limit = jnp.where(hold, 0.0, jnp.where(slow, params.zone.red_speed, params.zone.nominal_speed))
    stopped = state.zone == STOP
    moved = params.zone.across_speed * (jnp.clip(jnp.asarray(age), 0.0, params.max_age) + dt)
    aside = jnp.where(stopped | (state.zone == RED), params.zone.aside + moved, 0.0)
    gain = jnp.where(stopped, params.zone.stop_acceleration * dt, UNLIMITED)
    waiting = (state.zone == STOP) & (reasons == 0)
    return state, SafetyDecision(
        zone=state.zone,
        speed_limit=jnp.maximum(jnp.min(limit), 0.0),
        point_limit=limit,
        scale=scale,
        hold=hold,
        reasons=reasons | pack({WAITING: waiting}),
        any_limit=any_limit.astype(d.dtype),
        aside=aside.astype(d.dtype),
        widest=jnp.asarray(params.zone.widest, d.dtype),
        gain=gain.astype(d.dtype),
        head_limit=towards_head,
    )


def describe(reasons: int) -> str:
    """The bits of a stop in words; "none" for 0."""
    return words(REASONS, reasons)
