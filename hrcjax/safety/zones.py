"""Zones of distance between robot and person, entered at once and left with hysteresis and a wait.

Robotica paper, eq. 6c (misprint: its red zone reads d >= d_yellow; d <= d_yellow is meant). The paper gives no
thresholds; here they are the separation distances of three speeds.
"""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.safety.params import SafetyParams
from hrcjax.safety.ssm import allowed_speed, safe_distance
from hrcjax.typing import Array, Bool, Float, Int, Scalar

GREEN = 0
YELLOW = 1
RED = 2
STOP = 3
ZONE_NAMES = ("green", "yellow", "red", "stop")
RETREAT_WIDTH = 0.02
"""Points farther than the nearest by more than this are not asked to retreat [m]."""
RETREAT_RAMP = 0.1
"""Distance over which the retreat that a point is asked for grows to the whole retreat speed [m]."""
NOBODY = 1e3
"""Farther than this a person does not count [m]."""
BEYOND_STOP = 0.1
"""A retreat ends so much beyond the distance at which the stop does, so that it gets there [m]."""


class ZoneThresholds(eqx.Module):
    """Distances at which zones begin."""

    stop: Float[Array, "*row"]
    """Of standstill: nearer, a stop [m]."""
    yellow: Float[Array, "*row"]
    """Of the red speed: nearer, red [m]."""
    green: Float[Array, "*row"]
    """Of the nominal speed: nearer, yellow [m]."""


class ZoneState(eqx.Module):
    """What the zones remember from one tick to the next."""

    zone: Int[Array, ""]
    """GREEN, YELLOW, RED or STOP."""
    waited: Float[Array, ""]
    """How long a more relaxed zone has been possible [s]."""
    candidate: Int[Array, ""]
    """The tightest of the zones that were possible in that time."""


def initial_zone(dtype: jnp.dtype | type = jnp.float32) -> ZoneState:
    """Green, not waiting: the first update tightens at once, so call it before the robot moves."""
    green = jnp.asarray(GREEN, jnp.int32)
    return ZoneState(green, jnp.zeros((), dtype), green)


def zone_thresholds(params: SafetyParams) -> ZoneThresholds:
    """From where on standstill, red speed and nominal speed are safe, for the speed that a person is assumed to have there [m]."""
    return ZoneThresholds(
        stop=safe_distance(params.ssm, 0.0),
        yellow=safe_distance(params.ssm, params.zone.red_speed),
        green=safe_distance(params.ssm, params.zone.nominal_speed),
    )


def zone_at(
    params: SafetyParams,
    d: Scalar,
    head_distance: Scalar | None = None,
    slack: Scalar = 0.0,
    thresholds: ZoneThresholds | None = None,
) -> Int[Array, ""]:
    """The zone of a distance, without memory.

    Args:
        d: distance robot to person; not finite: STOP [m].
        head_distance: distance robot to head; not finite: STOP; None: not watched [m].
        slack: added to every threshold [m].
        thresholds: None: those of the assumed speed of a person, `zone_thresholds`.
    """
    d = jnp.asarray(d)
    limits = zone_thresholds(params) if thresholds is None else thresholds
    nearest = RED if params.zone.red_only_slows else STOP
    zone = jnp.where(d >= limits.green + slack, GREEN, jnp.where(d >= limits.yellow + slack, YELLOW, RED))
    zone = jnp.where(d >= limits.stop + slack, zone, nearest)
    missing = ~jnp.isfinite(d)
    if head_distance is not None:
        head_distance = jnp.asarray(head_distance)
        zone = jnp.where(head_distance >= params.zone.head_stop + slack, zone, nearest)
        missing = missing | ~jnp.isfinite(head_distance)
    return jnp.where(missing, STOP, zone).astype(jnp.int32)


def update_zone(
    params: SafetyParams,
    state: ZoneState,
    d: Scalar,
    fresh: Bool[Array, ""] | bool,
    dt: Scalar,
    head_distance: Scalar | None = None,
    least: Int[Array, ""] | int = 0,
    thresholds: ZoneThresholds | None = None,
    leaving: ZoneThresholds | None = None,
    head_slack: Scalar | None = None,
) -> ZoneState:
    """The zone one tick later.

    A tighter zone is entered at once. A more relaxed one is entered when the person has been farther than its threshold
    by `hysteresis`, or as the arguments say, for all of `relax_time`.

    Args:
        d: distance robot to person [m].
        fresh: whether the data can be trusted; if not: STOP.
        dt: time since the last update [s].
        head_distance: distance robot to head; None: not watched [m].
        least: the zone is at least this tight.
        thresholds: None: those of the assumed speed of a person, `zone_thresholds`.
        leaving: beyond which zones are relaxed; None: `hysteresis` beyond `thresholds`.
        head_slack: how much farther than `head_stop` the head must be before a stop near it is left; None: `hysteresis` [m].
    """
    tight = jnp.where(fresh, zone_at(params, d, head_distance, thresholds=thresholds), STOP)
    tight = jnp.maximum(tight, least).astype(jnp.int32)
    slack = params.zone.hysteresis
    beyond = zone_at(params, d, None, slack, thresholds) if leaving is None else zone_at(params, d, thresholds=leaving)
    if head_distance is not None:
        beyond = jnp.maximum(
            beyond, zone_at(params, NOBODY, head_distance, slack if head_slack is None else head_slack)
        )
    loose = jnp.where(fresh, beyond, STOP)
    loose = jnp.maximum(loose, least).astype(jnp.int32)
    relaxing = loose < state.zone
    candidate = jnp.where(relaxing, jnp.maximum(loose, state.candidate), GREEN).astype(jnp.int32)
    waited = jnp.where(relaxing, state.waited + dt, 0.0).astype(state.waited.dtype)
    # Half a tick of tolerance: the sum of many dt must not miss relax_time by rounding.
    relaxed = relaxing & (waited + 0.5 * dt >= params.zone.relax_time)
    zone = jnp.where(tight >= state.zone, tight, jnp.where(relaxed, candidate, state.zone))
    return ZoneState(zone, jnp.where(relaxed, 0.0, waited), jnp.where(relaxed, GREEN, candidate).astype(jnp.int32))


def zone_speed(
    params: SafetyParams,
    zone: Int[Array, ""],
    d: Scalar,
    pfl_speed: Scalar | None = None,
    v_h: Scalar | None = None,
    measured: Scalar | None = None,
) -> Float[Array, ""]:
    """Largest speed towards the person in a zone [m/s].

    Green and yellow: v(d), not above the nominal speed (in green v(d) exceeds it). Red: at most the red speed, the
    PFL speed and v(d); with `red_only_slows`, or without `red_follows_separation`, v(d) does not count there. Stop: v(d), which is
    0 nearer than S_p(0), and at most the red and the PFL speed.

    Args:
        d: distance robot to person [m].
        pfl_speed: power-and-force speed of the nearest body region; None: not watched [m/s].
        v_h: person's speed towards the robot; None: `params.ssm.v_h` [m/s].
        measured: what the distance allows beside a person who is measured, if that is more; None: not measured [m/s].
    """
    separated = allowed_speed(params.ssm, d, v_h)
    separated = separated if measured is None else jnp.maximum(separated, measured)
    separated = jnp.minimum(separated, params.zone.nominal_speed)
    bounded = params.zone.red_follows_separation and not params.zone.red_only_slows
    red = jnp.minimum(separated if bounded else params.zone.nominal_speed, params.zone.red_speed)
    if pfl_speed is not None:
        red = jnp.minimum(red, pfl_speed)
    return jnp.where(zone == STOP, jnp.minimum(separated, red), jnp.where(zone == RED, red, separated))


def retreat_share(
    params: SafetyParams, zone: Int[Array, ""], d: Float[Array, "point"], ends: Scalar | None = None
) -> Float[Array, "point"]:
    """How far every point is asked to retreat instead of what it may: 1 at the retreat speed, 0 not at all [1].

    In a stop alone, so that it can end. Falls to 0 over `RETREAT_RAMP` before `ends`, and over `RETREAT_WIDTH` for points farther
    than the nearest: all at once often cannot, and would hold the one that can.

    Args:
        d: distance of the points to the person [m].
        ends: where nothing is asked for; None: `BEYOND_STOP` beyond the distance at which a stop for an assumed speed ends [m].
    """
    if ends is None:
        ends = zone_thresholds(params).stop + params.zone.hysteresis + BEYOND_STOP
    d = jnp.minimum(d, NOBODY)  # no difference of infinite numbers
    near = jnp.clip((ends - d) / RETREAT_RAMP, 0.0, 1.0)
    nearest = jnp.clip(1.0 - (d - jnp.min(d)) / RETREAT_WIDTH, 0.0, 1.0)
    return jnp.where(zone == STOP, near * nearest, 0.0)


def turned_away(params: SafetyParams, zone: Int[Array, ""], d: Float[Array, "point"]) -> Float[Array, "point"]:
    """Largest speed towards the person of points nearer than S_p(0) in a stop; none for others [m/s].

    Below 0, so that no point approaches where the direction to the person is off by noise: from 0 at S_p(0) to
    `zone.turn_away` over `RETREAT_WIDTH`.

    Args:
        d: distance of the points to the person [m].
    """
    short = zone_thresholds(params).stop - jnp.minimum(d, NOBODY)
    share = jnp.clip(short / RETREAT_WIDTH, 0.0, 1.0)
    return jnp.where((zone == STOP) & (share > 0), -share * params.zone.turn_away, jnp.inf)
