"""Zones: thresholds, tightening at once, relaxing with hysteresis and a wait, and the speed of every zone."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcjax.safety import (
    GREEN,
    RED,
    STOP,
    YELLOW,
    ZONE_NAMES,
    SafetyParams,
    ZoneParams,
    ZoneState,
    allowed_speed,
    initial_zone,
    separation_distance,
    update_zone,
    zone_at,
    zone_speed,
    zone_thresholds,
)
from hrcjax.safety.zones import retreat_share

# Compiled once a shape, not operation by operation.
update_zone = jax.jit(update_zone)
zone_at = jax.jit(zone_at)
zone_speed = jax.jit(zone_speed)

PARAMS = SafetyParams()
ONLY_SLOWS = SafetyParams(zone=ZoneParams(red_only_slows=True))
DT = 0.01


@jax.jit
def run(distances, fresh, state):
    """The zone over time."""

    def tick(state, now):
        state = update_zone(PARAMS, state, now[0], now[1], jnp.asarray(DT, now[0].dtype))
        return state, state.zone

    return jax.lax.scan(tick, state, (distances, fresh))[1]


plain_zones = jax.jit(jax.vmap(lambda d: zone_at(PARAMS, d)))


def zones(distances, fresh=None, start=GREEN):
    d = jnp.asarray(distances)
    fresh = jnp.ones(d.shape, bool) if fresh is None else jnp.asarray(fresh)
    return np.asarray(
        run(d, fresh, ZoneState(jnp.asarray(start, jnp.int32), jnp.zeros((), d.dtype), jnp.asarray(GREEN, jnp.int32)))
    )


def test_thresholds() -> None:
    """S_p of 0 and 0.25 m/s at 2 m/s of the person, .36 and .56 m, the latter beyond 0.5 m; there .49 at 1.6; of 1 m/s 1.12 m."""
    limits = zone_thresholds(PARAMS)
    np.testing.assert_allclose((limits.stop, limits.yellow, limits.green), (0.36, 0.5, 1.12), atol=0.005)


def test_order_of_the_zones() -> None:
    """Names, and the zone on both sides of every threshold; eq. 6c's red is nearer than d_yellow."""
    assert (GREEN, YELLOW, RED, STOP) == (0, 1, 2, 3)
    assert ZONE_NAMES == ("green", "yellow", "red", "stop")
    limits = zone_thresholds(PARAMS)
    for threshold, inside, outside in (
        (limits.stop, STOP, RED),
        (limits.yellow, RED, YELLOW),
        (limits.green, YELLOW, GREEN),
    ):
        assert zone_at(PARAMS, threshold - 1e-6) == inside
        assert zone_at(PARAMS, threshold + 1e-6) == outside
    for slack, zone in ((-0.5, GREEN), (0.0, YELLOW), (0.3, RED), (0.5, STOP)):
        assert zone_at(PARAMS, 0.7, slack=slack) == zone


def test_zones_divide_the_distances_as_eq_6c_corrected() -> None:
    """Every distance is in exactly one zone of eq. 6c with red nearer than d_yellow; as printed red overlaps the others."""
    limits = zone_thresholds(ONLY_SLOWS)  # the paper has no stop
    d = np.linspace(0.01, 2.0, 400)
    green, yellow = d >= float(limits.green), (d < float(limits.green)) & (d > float(limits.yellow))
    red = d <= float(limits.yellow)
    assert np.all(green.astype(int) + yellow + red == 1)
    found = jax.vmap(lambda x: zone_at(ONLY_SLOWS, x))(jnp.asarray(d))
    np.testing.assert_array_equal(found, np.select([green, yellow, red], [GREEN, YELLOW, RED]))
    printed_red, ours = d >= float(limits.yellow), np.asarray(found)
    np.testing.assert_array_equal(ours == RED, ~printed_red)  # the other way round
    assert set(ours[printed_red]) == {GREEN, YELLOW}


@pytest.mark.parametrize("d", [jnp.nan, jnp.inf, -jnp.inf])
def test_missing_distance_stops(d: float) -> None:
    assert zone_at(PARAMS, d) == STOP
    assert zone_at(ONLY_SLOWS, d) == STOP
    assert zone_at(PARAMS, 3.0, d) == STOP
    assert zones([3.0, d])[1] == STOP


def test_head_near_stops() -> None:
    assert zone_at(PARAMS, 3.0, 0.499) == STOP
    assert zone_at(PARAMS, 3.0, 0.501) == GREEN
    assert zone_at(PARAMS, 3.0, 0.55, slack=0.1) == STOP
    assert zone_at(ONLY_SLOWS, 3.0, 0.4) == RED
    state = update_zone(PARAMS, initial_zone(jnp.float64), 3.0, True, DT, 0.4)
    assert state.zone == STOP


def test_paper_option_only_slows() -> None:
    assert zone_at(ONLY_SLOWS, 0.01) == RED
    assert zone_at(ONLY_SLOWS, 0.6) == YELLOW
    assert update_zone(ONLY_SLOWS, initial_zone(jnp.float64), 3.0, False, DT).zone == STOP


def test_tightens_at_once() -> None:
    np.testing.assert_array_equal(zones([2.0, 0.8, 0.4, 0.2]), [GREEN, YELLOW, RED, STOP])
    assert zones([0.2])[0] == STOP


def test_relaxes_after_the_hysteresis_and_the_wait() -> None:
    """0.1 m farther for 0.1 s: ten ticks of 10 ms; 0.09 m farther never."""
    np.testing.assert_array_equal(zones(np.full(12, 0.60), start=RED), [RED] * 9 + [YELLOW] * 3)
    np.testing.assert_array_equal(zones(np.full(40, 0.57), start=RED), [RED] * 40)
    np.testing.assert_array_equal(zones(np.full(12, 3.0), start=STOP), [STOP] * 9 + [GREEN] * 3)


def test_relaxes_to_the_tightest_zone_of_the_wait() -> None:
    """One far sample at the end of the wait does not open green; the next wait begins afresh."""
    np.testing.assert_array_equal(zones([0.48] * 9 + [3.0] * 13, start=STOP), [STOP] * 9 + [RED] * 10 + [GREEN] * 3)
    np.testing.assert_array_equal(zones([0.48] * 10 + [3.0] * 12, start=STOP), [STOP] * 9 + [RED] * 10 + [GREEN] * 3)


def test_an_interrupted_wait_starts_again() -> None:
    d = np.full(30, 0.60)
    d[7] = 0.55
    np.testing.assert_array_equal(zones(d, start=RED), [RED] * 17 + [YELLOW] * 13)
    np.testing.assert_array_equal(
        zones(np.full(30, 0.6), np.arange(30) != 7, RED), [RED] * 7 + [STOP] * 10 + [YELLOW] * 13
    )


def test_a_zone_that_is_at_least_yellow() -> None:
    """Entered at once, left after the wait, not in the way of tighter ones; a stop relaxes to it, not to green."""

    def after(d: float, ticks: int, least: int, state: ZoneState) -> ZoneState:
        for _ in range(ticks):
            state = update_zone(PARAMS, state, d, True, DT, None, least)
        return state

    start = initial_zone(jnp.float64)
    yellow = after(3.0, 1, YELLOW, start)
    assert yellow.zone == YELLOW and after(3.0, 40, YELLOW, yellow).zone == YELLOW
    assert after(3.0, 9, GREEN, yellow).zone == YELLOW and after(3.0, 10, GREEN, yellow).zone == GREEN
    assert after(0.4, 1, YELLOW, start).zone == RED and after(0.2, 1, YELLOW, start).zone == STOP
    stopped = after(0.2, 1, YELLOW, start)
    assert after(3.0, 9, YELLOW, stopped).zone == STOP and after(3.0, 10, YELLOW, stopped).zone == YELLOW
    assert after(3.0, 40, YELLOW, stopped).zone == YELLOW


def test_no_chatter_at_a_threshold() -> None:
    """Noise of 4 cm about a threshold changes the zone once."""
    rng = np.random.default_rng(1)
    d = 0.5 + rng.uniform(-0.04, 0.04, 300)
    assert np.count_nonzero(np.diff(zones(d))) <= 1


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.0, 2.0), min_size=25, max_size=25))
def test_never_more_relaxed_than_the_distance(distances: list[float]) -> None:
    plain = plain_zones(jnp.asarray(distances))
    assert np.all(zones(distances) >= np.asarray(plain))


def test_speeds() -> None:
    """Green and yellow v(d) up to nominal, red the least of three; in a stop far points at the slowest of these, near ones not."""
    assert zone_speed(PARAMS, jnp.asarray(GREEN), 3.0) == 1.0
    np.testing.assert_allclose(zone_speed(PARAMS, jnp.asarray(YELLOW), 0.8), allowed_speed(PARAMS.ssm, 0.8), rtol=1e-12)
    assert 0.25 < zone_speed(PARAMS, jnp.asarray(YELLOW), 0.8) < 1.0
    assert zone_speed(PARAMS, jnp.asarray(RED), 0.8) == 0.25
    assert zone_speed(PARAMS, jnp.asarray(RED), 0.8, 0.2) == 0.2
    assert zone_speed(PARAMS, jnp.asarray(YELLOW), 0.8, 0.2) > 0.25
    np.testing.assert_allclose(zone_speed(PARAMS, jnp.asarray(RED), 0.4), allowed_speed(PARAMS.ssm, 0.4), rtol=1e-12)
    for d, pfl, expected in (
        (3.0, 0.2, 0.2),
        (3.0, None, 0.25),
        (0.37, None, float(allowed_speed(PARAMS.ssm, 0.37))),
        (0.25, None, 0.0),
    ):
        np.testing.assert_allclose(zone_speed(PARAMS, jnp.asarray(STOP), d, pfl), expected, atol=1e-12)
    assert zone_speed(PARAMS, jnp.asarray(YELLOW), 0.8, None, 0.0) > zone_speed(PARAMS, jnp.asarray(YELLOW), 0.8)


stop_speeds = jax.jit(jax.vmap(lambda d, v_h: zone_speed(PARAMS, jnp.asarray(STOP), d, 0.2, v_h)))


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(-0.5, 4.0), min_size=20, max_size=20), st.lists(st.floats(0, 2.5), min_size=20, max_size=20))
def test_a_stop_never_allows_more_than_separation(distances: list[float], people: list[float]) -> None:
    """S_p written out at the speed allowed in a stop is within the distance, whatever the person's speed; the limit falls with the
    distance."""
    d, v_h, ssm = np.array(distances), np.array(people), PARAMS.ssm
    v = np.asarray(stop_speeds(jnp.asarray(d), jnp.asarray(v_h)))
    stop = v / ssm.brake
    needed = v_h * (ssm.reaction_time + stop) + v * ssm.reaction_time + v * stop / 2 + ssm.intrusion + ssm.Z_d + ssm.Z_r
    moving = v > 0
    assert (needed[moving] <= d[moving] + 1e-12).all()
    assert (v <= 0.2).all() and (v >= 0).all()
    order = np.asarray(stop_speeds(jnp.asarray(np.sort(d)), jnp.full(20, 1.6)))
    assert (np.diff(order) >= -1e-12).all()


def test_a_stop_follows_the_separation_whatever_red_does() -> None:
    for zone in (ZoneParams(red_only_slows=True), ZoneParams(red_follows_separation=False)):
        params = SafetyParams(zone=zone)
        for d in (0.25, 0.37, 0.4):
            expected = min(float(allowed_speed(PARAMS.ssm, d)), 0.25)
            np.testing.assert_allclose(zone_speed(params, jnp.asarray(STOP), d), expected, atol=1e-12)


def test_nobody_anywhere_has_a_derivative() -> None:
    slope = jax.grad(lambda d: jnp.sum(retreat_share(PARAMS, jnp.asarray(STOP), d)))(jnp.full(3, jnp.inf))
    np.testing.assert_array_equal(slope, 0)


def test_a_retreat_is_asked_for_in_a_stop_alone_and_of_the_nearest_most() -> None:
    """The stop ends at 0.46 m: 0.36 and the hysteresis; the retreat fades from there to 0.56 m, and for points 2 cm farther."""
    stop = jnp.asarray(STOP)
    for d, expected in ((0.0, 1), (0.46, 1), (0.51, 0.5), (0.56, 0), (3.0, 0)):
        np.testing.assert_allclose(retreat_share(PARAMS, stop, jnp.asarray([d, 5.0])), [expected, 0], atol=1e-9)
    np.testing.assert_allclose(retreat_share(PARAMS, stop, jnp.asarray([0.3, 0.31, 0.32])), [1, 0.5, 0], atol=1e-9)
    for zone in (GREEN, YELLOW, RED):
        np.testing.assert_array_equal(retreat_share(PARAMS, jnp.asarray(zone), jnp.asarray([0.1])), 0)


def test_speed_options_in_red() -> None:
    contact = SafetyParams(zone=ZoneParams(red_follows_separation=False))
    for params in (ONLY_SLOWS, contact):
        assert zone_speed(params, jnp.asarray(RED), 0.1) == 0.25
        assert zone_speed(params, jnp.asarray(RED), 0.1, 0.1) == 0.1


def test_derivatives_and_precision(dtype: jnp.dtype) -> None:
    d = jnp.asarray(0.8, dtype)
    value, slope = jax.jit(jax.value_and_grad(lambda x: zone_speed(PARAMS, jnp.asarray(YELLOW), x)))(d)
    assert value.dtype == slope.dtype == dtype
    expected = 1 / jax.jit(jax.grad(lambda v: separation_distance(PARAMS.ssm, v)))(value)  # slope of an inverse
    np.testing.assert_allclose(slope, expected, rtol=1e-5)
    state = update_zone(PARAMS, initial_zone(dtype), d, True, jnp.asarray(DT, dtype))
    assert state.waited.dtype == dtype and state.zone.dtype == jnp.int32


def test_batches_of_settings() -> None:
    """Every number is a leaf: a sweep is a vmap."""
    leaves = jax.tree.map(lambda x: jnp.asarray([x, x]), PARAMS)
    leaves = eqx.tree_at(lambda p: p.zone.red_speed, leaves, jnp.asarray([0.25, 0.5]))
    both = jax.vmap(lambda p: zone_at(p, 0.6))(leaves)
    np.testing.assert_array_equal(both, [YELLOW, RED])
