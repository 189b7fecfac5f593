"""Measured parts of a person in zones and limits: against a person and an arm that are moved step by step, and row by row."""

from dataclasses import replace

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
    TOO_CLOSE,
    YELLOW,
    Coming,
    SafetyParams,
    SsmParams,
    ZoneParams,
    allowed_speed,
    at_the_nearest,
    initial_zone,
    measured_distance,
    measured_limit,
    monitor,
    row_thresholds,
    zone_thresholds,
)
from hrcjax.safety.coming import leaving_thresholds

PARAMS = SafetyParams()
SSM = PARAMS.ssm
DT = 0.008
distances = jax.jit(lambda v, coming: measured_distance(SSM, v, coming))
limits = jax.jit(lambda d, coming: measured_limit(SSM, d, coming))
decide = jax.jit(
    lambda d, v_r, coming: monitor(PARAMS, initial_zone(d.dtype), d, v_r, jnp.asarray(0.05), DT, coming=coming)
)
plain = jax.jit(lambda d, v_r: monitor(PARAMS, initial_zone(d.dtype), d, v_r, jnp.asarray(0.05), DT))
speeds = st.floats(0.0, 2.0)


def coming(v_h, beyond, counts=None, gain=4.0) -> Coming:
    v_h, beyond = np.atleast_2d(v_h).astype(float), np.atleast_2d(beyond).astype(float)
    counts = np.ones(len(v_h), bool) if counts is None else np.asarray(counts)
    return Coming(jnp.asarray(v_h), jnp.asarray(beyond), gain, jnp.asarray(counts))


def left_over(d: float, v_r: float, v_h: float, beyond: float, gain: float = 4.0) -> float:
    """What is left between arm and part after reaction and braking, stepped through [m]."""
    h, gap, arm, person, t = 1e-4, d + beyond, v_r, v_h, 0.0
    while t < SSM.reaction_time - 0.5 * h or arm > 0:
        if t >= SSM.reaction_time - 0.5 * h:
            arm, person = max(arm - SSM.brake * h, 0.0), person + gain * h
        gap, t = gap - h * (arm + person), t + h
    return gap


@pytest.mark.parametrize("v_r", [0.0, 0.25, 0.8])
def test_the_nearest_stop_leaves_the_intrusion_distance(v_r: float) -> None:
    """At the distance for a speed one part just comes to C, Z_d and Z_r; the others stay away."""
    parts = [(0.6, 0.0), (1.5, 0.25), (0.0, 0.1)]
    d = float(distances(v_r, coming([[v for v, _ in parts]], [[e for _, e in parts]]))[0])
    left = [left_over(d, v_r, v, e) for v, e in parts]
    np.testing.assert_allclose(min(left), SSM.intrusion + SSM.Z_d + SSM.Z_r, atol=3e-4)


@settings(deadline=None)
@given(
    st.lists(st.tuples(speeds, st.floats(0.0, 1.0)), min_size=3, max_size=3), st.floats(0.0, 1.5), st.floats(0.0, 8.0)
)
def test_the_limit_is_the_inverse_of_the_distance(parts, v_r: float, gain: float) -> None:
    told = replace(coming([[v for v, _ in parts]], [[e for _, e in parts]]), gain=jnp.asarray(gain))
    np.testing.assert_allclose(limits(distances(v_r, told), told), v_r, atol=1e-9)


@settings(deadline=None)
@given(speeds, st.floats(0.0, 1.0))
def test_faster_people_need_more_and_are_approached_slower(v: float, d: float) -> None:
    slow, fast = coming([[v]], [[0.0]]), coming([[v + 0.1]], [[0.0]])
    assert distances(0.3, fast)[0] > distances(0.3, slow)[0]
    at = jnp.asarray([d])
    assert limits(at, fast)[0] <= limits(at, slow)[0]


def test_without_gain_and_way_it_is_the_usual_formula() -> None:
    told = coming([[0.7]], [[0.0]], gain=0.0)
    np.testing.assert_allclose(limits(jnp.asarray([0.6]), told)[0], allowed_speed(SSM, 0.6, 0.7), rtol=1e-12)


def test_slope_is_finite_where_nothing_is_left() -> None:
    told = coming([[0.5, 0.5]], [[0.0, 0.3]])
    edge = distances(0.0, told)
    for d in (edge, edge - 0.1, jnp.zeros(1)):
        slope = jax.grad(lambda x, e: jnp.sum(measured_limit(SSM, x, replace(told, beyond=e))), (0, 1))(d, told.beyond)
        assert all(np.isfinite(s).all() for s in slope)


def test_rows_that_do_not_count_are_assumed() -> None:
    """Exactly the decision without anything measured, whatever the numbers say."""
    d, v_r = jnp.asarray([0.6, 0.29, 2.0]), jnp.asarray([0.1, 0.0, -0.2])
    told = coming(np.full((3, 2), 0.0), np.full((3, 2), 5.0), counts=[False] * 3)
    for found, expected in zip(jax.tree.leaves(decide(d, v_r, told)), jax.tree.leaves(plain(d, v_r)), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_never_less_than_the_assumed_speed_allows() -> None:
    d = jnp.asarray([0.55, 0.8, 1.0])
    found = decide(d, 0 * d, coming(np.full((3, 1), 2.0), np.zeros((3, 1))))[1]
    assert (np.asarray(found.point_limit) >= np.asarray(plain(d, 0 * d)[1].point_limit)).all()
    assert found.zone == plain(d, 0 * d)[1].zone


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0.05, 1.5), speeds, st.floats(0.0, 0.5), st.booleans()), min_size=3, max_size=3))
def test_the_zone_is_that_of_the_tightest_row(rows) -> None:
    """Row by row in plain Python: every row has thresholds of its own."""
    d = jnp.asarray([row[0] for row in rows])
    told = coming([[row[1]] for row in rows], [[row[2]] for row in rows], [row[3] for row in rows])
    assumed = [float(v) for v in jax.tree.leaves(zone_thresholds(PARAMS))]
    expected, margin = GREEN, np.inf
    for one, v_h, beyond, counts in rows:
        ends = list(assumed)
        if counts:
            for k, v in enumerate((0.0, PARAMS.zone.red_speed, PARAMS.zone.nominal_speed)):
                T_s = v / SSM.brake
                S_p = v_h * (SSM.reaction_time + T_s) + v * SSM.reaction_time + v * T_s / 2 + 2.0 * T_s * T_s
                ends[k] = min(ends[k], S_p + SSM.intrusion + SSM.Z_d + SSM.Z_r - beyond)
        expected = max(
            expected, STOP if one < ends[0] else RED if one < ends[1] else YELLOW if one < ends[2] else GREEN
        )
        margin = min(margin, *(abs(one - end) for end in ends))
    if margin > 1e-9:
        found = decide(d, 0 * d, told)[1]
        assert found.zone == expected
        assert bool(found.reasons & TOO_CLOSE) == (expected == STOP)


def test_a_stop_beside_somebody_who_stands_is_left_nearer() -> None:
    """With the hysteresis of measured speeds beyond its own threshold, and no sooner; an assumed one with the longer hysteresis."""
    told = coming([[0.4]], [[0.0]])
    ends = float(row_thresholds(PARAMS, told).stop[0])
    assert ends < float(zone_thresholds(PARAMS).stop) - 0.1

    @jax.jit
    def step(state, d):
        return monitor(PARAMS, state, d, 0 * d, jnp.asarray(0.05), DT, coming=told)

    assert PARAMS.zone.measured_hysteresis < PARAMS.zone.hysteresis
    for more, left in ((PARAMS.zone.measured_hysteresis - 0.01, False), (PARAMS.zone.measured_hysteresis + 0.01, True)):
        state = step(initial_zone(jnp.float64), jnp.asarray([ends - 0.01]))[0]
        assert state.zone == STOP
        for _ in range(20):
            state, found = step(state, jnp.asarray([ends + more]))
        assert (found.zone != STOP) == left


def test_a_stop_beside_somebody_who_is_not_measured_is_left_as_without_a_body() -> None:
    told = coming([[0.4], [0.4]], [[0.0], [0.0]], [True, False])
    ends = float(zone_thresholds(PARAMS).stop)

    @jax.jit
    def step(state, d):
        return monitor(PARAMS, state, d, 0 * d, jnp.asarray(0.05), DT, coming=told)

    for more, left in ((0.09, False), (0.11, True)):
        state = step(initial_zone(jnp.float64), jnp.asarray([ends + more, ends - 0.01]))[0]
        assert state.zone == STOP
        for _ in range(20):
            state, found = step(state, jnp.asarray([ends + 0.5, ends + more]))
        assert (found.zone != STOP) == left


def test_a_measured_speed_that_needs_what_the_assumed_one_does_is_left_as_that() -> None:
    told = coming([[2.0]], [[0.0]])
    assumed = zone_thresholds(PARAMS)
    rows = row_thresholds(PARAMS, told)
    assert rows.stop[0] == assumed.stop
    assert leaving_thresholds(PARAMS, told, rows).stop[0] == pytest.approx(float(assumed.stop) + PARAMS.zone.hysteresis)


def test_who_stands_nearer_than_the_assumed_stop_is_not_retreated_from() -> None:
    """The retreat of a stop begins by the measured threshold too."""
    d = jnp.asarray([0.25, 0.12])
    told = coming([[0.4], [0.4]], [[0.0], [0.0]])
    found = decide(d, 0 * d, told)[1]
    assert found.zone == STOP and found.point_limit[1] < 0
    assert found.point_limit[0] >= 0
    assert plain(d, 0 * d)[1].point_limit[0] < 0


def test_thresholds_at_the_nearest() -> None:
    params = SafetyParams(ssm=SsmParams(), zone=ZoneParams())
    told = coming([[0.4], [1.5]], [[0.0], [0.0]])
    d = jnp.asarray([0.22, 0.24])
    rows = row_thresholds(params, told)
    ends = at_the_nearest(d, rows)
    assert d[0] > rows.stop[0] and d[1] < rows.stop[1]
    assert jnp.min(d) < ends.stop


def test_what_is_not_a_number_holds() -> None:
    d = jnp.asarray([0.6])
    assert decide(d, 0 * d, coming([[np.nan]], [[0.0]]))[1].hold
