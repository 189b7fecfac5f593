"""The monitor: every stop has a name, zone and limit are those of the nearest point, the robot stops in time."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.safety import (
    COMMANDED,
    GREEN,
    HEAD_NEAR,
    INVALID_FRAME,
    MISSING_DATA,
    OLD_DATA,
    RED,
    STOP,
    TOO_CLOSE,
    WAITING,
    YELLOW,
    ClockParams,
    SafetyParams,
    SsmParams,
    ZoneParams,
    ZoneState,
    advance,
    allowed_speed,
    describe,
    initial_clock,
    initial_zone,
    monitor,
)

PARAMS = SafetyParams()
DT = 0.01


@jax.jit
def tick(d, v_r, age, head, valid, pfl, v_h, state):
    return monitor(PARAMS, state, d, v_r, age, DT, head_distance=head, valid=valid, pfl_speed=pfl, v_h=v_h)


def decide(d=(3.0, 3.0), v_r=(0.5, 0.1), age=0.0, head=3.0, valid=True, pfl=1.0, v_h=1.6, state=None):
    state = initial_zone(jnp.float64) if state is None else state
    return tick(jnp.asarray(d), jnp.asarray(v_r), age, head, valid, pfl, v_h, state)


@pytest.mark.parametrize(
    ("case", "reasons"),
    [
        ({}, 0),
        ({"age": 0.0999}, 0),
        ({"age": 0.1001}, OLD_DATA),
        ({"age": -0.1001}, OLD_DATA),
        ({"age": np.nan}, OLD_DATA),
        ({"valid": False}, INVALID_FRAME),
        ({"d": (np.nan, 3.0)}, MISSING_DATA),
        ({"d": (3.0, np.inf)}, MISSING_DATA),
        ({"v_r": (0.0, np.nan)}, MISSING_DATA),
        ({"head": np.nan}, MISSING_DATA),
        ({"pfl": np.nan}, MISSING_DATA),
        ({"pfl": np.inf}, 0),
        ({"v_h": np.nan}, MISSING_DATA),
        ({"d": (3.0, 0.31)}, TOO_CLOSE),
        ({"head": 0.49}, HEAD_NEAR),
        ({"d": (0.1, 3.0), "head": 0.3, "age": 9.0, "valid": False}, TOO_CLOSE | HEAD_NEAR | OLD_DATA | INVALID_FRAME),
    ],
)
def test_every_stop_has_its_reason(case: dict, reasons: int) -> None:
    _, decision = decide(**case)
    assert decision.reasons == reasons
    assert (decision.zone == STOP) == (reasons != 0)
    assert decision.hold == bool(reasons & (OLD_DATA | MISSING_DATA | INVALID_FRAME))
    if reasons:
        assert decision.speed_limit == 0 and decision.scale == 0
        assert decision.any_limit == (0.0 if decision.hold else PARAMS.zone.red_speed)
    else:
        assert decision.zone == GREEN and decision.speed_limit == 1.0 and decision.scale == 1


def test_hold_stops_a_retreat_too_and_closeness_does_not() -> None:
    retreat = (-0.5, -0.1)
    assert decide(v_r=retreat, age=1.0)[1].scale == 0
    _, near = decide(d=(0.2, 3.0), v_r=retreat)
    assert near.zone == STOP and near.scale == 1 and not near.hold


def test_only_the_nearest_points_are_asked_to_retreat() -> None:
    """Another one that is too near as well must not approach, and moves away a little, as directions are off by noise; by 0.02 m/s
    from 2 cm under S_p(0) = 0.36 m on."""
    _, decision = decide(d=(0.05, 0.06, 0.1, 0.35, 0.37), v_r=(0.0,) * 5)
    far = float(allowed_speed(PARAMS.ssm, jnp.asarray(0.37), 1.6))
    np.testing.assert_allclose(decision.point_limit, [-0.1, -0.05, -0.02, -0.01, far], atol=1e-6)
    assert decision.speed_limit == 0


def test_no_silent_continuation() -> None:
    """After a stop the robot waits, and says so, until the person has stayed away: far points at the reduced speed of 0.25 m/s,
    half of 0.5, the nearest point within the hysteresis not at all."""
    for d, scale in (((3.0, 3.0), 0.5), ((0.41, 3.0), 0.0)):
        state, _ = decide(d=(0.2, 3.0))
        seen = []
        for _ in range(12):
            state, decision = decide(d=d, state=state)
            seen.append((int(decision.zone), int(decision.reasons), float(decision.scale)))
        assert seen[:9] == [(STOP, WAITING, scale)] * 9
        assert seen[9:] == ([(GREEN, 0, 1.0)] if scale else [(STOP, WAITING, 0.0)]) * 3


def test_the_stop_for_a_head_ends_for_all_points_at_once() -> None:
    """A point is far from the person, but the head comes near: none approaches until the head is 0.6 m away; a retreat passes."""
    state, near = decide(d=(0.49, 3.0), head=0.49)
    assert near.reasons == HEAD_NEAR
    np.testing.assert_array_equal(near.point_limit, [0.0, 0.0])
    state, still = decide(d=(0.59, 3.0), head=0.59, state=state)
    assert still.reasons == WAITING
    np.testing.assert_array_equal(still.point_limit, [0.0, 0.0])
    assert decide(d=(0.59, 3.0), head=0.59, v_r=(-0.3, -0.1), state=state)[1].scale == 1
    assert (decide(d=(0.61, 3.0), head=0.61, state=state)[1].point_limit > 0.0).all()


def test_in_red_and_in_a_stop_the_person_may_be_elsewhere() -> None:
    """3 cm, and 1 m/s since the image until the end of the tick; in a stop speed grows by 0.5 m/s^2."""
    _, free = decide()
    assert free.zone == GREEN and free.aside == 0 and free.gain >= 1e3
    for age in (0.0, 0.04, 0.1):
        _, near = decide(d=(0.2, 3.0), age=age)
        np.testing.assert_allclose(near.aside, 0.03 + 1.0 * (age + DT), rtol=1e-6)
        np.testing.assert_allclose(near.gain, 0.5 * DT, rtol=1e-6)
    _, red = decide(d=(0.4, 3.0), age=0.04)
    assert red.zone == RED and red.gain >= 1e3
    np.testing.assert_allclose(red.aside, 0.03 + 1.0 * (0.04 + DT), rtol=1e-6)
    assert np.isfinite(decide(age=np.inf)[1].aside) and decide(age=np.inf)[1].hold


any_limit = jax.jit(
    lambda d, age, guarded: monitor(PARAMS, initial_zone(d.dtype), d, 0 * d, age, DT, guarded=guarded)[1].any_limit
)


@pytest.mark.parametrize(
    ("d", "age", "guarded", "limit"),
    [
        (3.0, 0.0, False, PARAMS.zone.nominal_speed),
        (0.8, 0.0, False, PARAMS.zone.nominal_speed),
        (0.45, 0.0, False, PARAMS.zone.red_speed),
        (0.2, 0.0, False, PARAMS.zone.red_speed),
        (3.0, 0.0, True, PARAMS.zone.red_speed),
        (3.0, 1.0, False, 0.0),
        (np.nan, 0.0, False, 0.0),
    ],
)
def test_speed_in_any_direction(d: float, age: float, guarded: bool, limit: float) -> None:
    """Nominal in green and yellow, the reduced speed in red, in a stop and where somebody may hide, 0 where data are missing."""
    for dtype in (jnp.float32, jnp.float64):
        got = any_limit(jnp.array([d, 3.0], dtype), age, guarded)
        assert got is not None and got.dtype == dtype and got == limit


def test_yellow_at_best_where_somebody_may_hide() -> None:
    """Without a stop and its reasons; what is nearer still counts."""
    look = jax.jit(lambda d, guarded: monitor(PARAMS, initial_zone(d.dtype), d, d * 0, 0.0, DT, guarded=guarded)[1])
    far, near = jnp.array([3.0, 4.0]), jnp.array([0.2, 3.0])
    assert look(far, False).zone == GREEN and look(far, True).zone == YELLOW
    assert look(far, True).reasons == 0 and not look(far, True).hold
    assert look(near, True).zone == STOP and look(near, True).reasons == TOO_CLOSE


def test_every_point_has_the_limit_of_its_distance() -> None:
    _, decision = decide(d=(0.6, 0.9), v_r=(0.2, 0.9))
    expected = [allowed_speed(PARAMS.ssm, 0.6), allowed_speed(PARAMS.ssm, 0.9)]
    assert decision.zone == YELLOW
    np.testing.assert_allclose(decision.point_limit, expected, rtol=1e-12)
    np.testing.assert_allclose(decision.speed_limit, expected[0], rtol=1e-12)
    np.testing.assert_allclose(decision.scale, expected[1] / 0.9, rtol=1e-12)


def test_red_takes_the_body_region_into_account() -> None:
    state = ZoneState(jnp.asarray(RED, jnp.int32), jnp.asarray(0.0), jnp.asarray(GREEN, jnp.int32))
    assert decide(d=(0.55, 3.0), pfl=0.2, state=state)[1].speed_limit == 0.2
    assert decide(d=(0.55, 3.0), pfl=9.0, state=state)[1].speed_limit == 0.25


def test_speed_of_the_person() -> None:
    """Measured where given; else 1.6 m/s, and 2.0 m/s for a point nearer than 0.5 m."""
    np.testing.assert_allclose(decide(d=(0.6, 3.0), v_h=0.5)[1].speed_limit, allowed_speed(PARAMS.ssm, 0.6, 0.5))
    d = jnp.array([0.495, 0.6])
    fast = SafetyParams(zone=ZoneParams(red_speed=1.0))
    _, assumed = monitor(fast, initial_zone(jnp.float64), d, jnp.zeros(2), 0.0, DT)
    expected = [allowed_speed(PARAMS.ssm, 0.495, 2.0), allowed_speed(PARAMS.ssm, 0.6, 1.6)]
    np.testing.assert_allclose(assumed.point_limit, expected, rtol=1e-12)


def test_paper_option_slows_and_stops_for_faults_only() -> None:
    params = SafetyParams(zone=ZoneParams(red_only_slows=True))
    state, d, v_r = initial_zone(jnp.float64), jnp.array([0.1]), jnp.array([1.0])
    _, near = monitor(params, state, d, v_r, 0.0, DT, head_distance=0.1)
    assert near.zone == RED and near.speed_limit == 0.25 and near.scale == 0.25 and near.reasons == 0
    _, old = monitor(params, state, d, v_r, 1.0, DT)
    assert old.zone == STOP and old.reasons == OLD_DATA and old.scale == 0


def test_words() -> None:
    assert describe(0) == "none"
    assert describe(OLD_DATA) == "person data too old"
    assert describe(TOO_CLOSE | HEAD_NEAR) == "person too close; head near"
    bits = (OLD_DATA, MISSING_DATA, TOO_CLOSE, HEAD_NEAR, INVALID_FRAME, WAITING, COMMANDED)
    words = [describe(bit) for bit in bits]
    assert len(set(words)) == len(bits) and "none" not in words


def test_the_robot_has_stopped_before_the_person_arrives(dtype: jnp.dtype) -> None:
    """One line: a person walks at 1.6 m/s at a robot that drives at it, seen with the latency T_r.

    When the robot comes to rest, C + Z_d + Z_r are still between them, but for what a T_r^2 / 2 and two ticks take:
    over the latency the robot was faster than its last command. With a reaction time of 0 in the rule, they are not.
    """
    dt, lag = 0.005, 20

    @jax.jit
    def closest(reaction_time):
        params = SafetyParams(ssm=SsmParams(v_h_near=1.6), max_age=0.2)
        params = eqx.tree_at(lambda p: p.ssm.reaction_time, params, reaction_time)

        def step(carry, k):
            clock, zone, seen = carry
            true = jnp.asarray(4.0, dtype) - 1.6 * dt * k.astype(dtype) - clock.s
            zone, decision = monitor(params, zone, seen[:1], jnp.ones(1, dtype), 0.1, jnp.asarray(dt, dtype))
            clock = advance(ClockParams(), clock, decision.speed_limit, jnp.asarray(9.0, dtype), jnp.asarray(dt, dtype))
            seen = jnp.concatenate([seen[1:], true[None]])
            return (clock, zone, seen), jnp.where(clock.v > 1e-3, true, jnp.inf)

        start = (initial_clock(dtype), initial_zone(dtype), jnp.full(lag - 1, 4.0, dtype))
        return jnp.min(jax.lax.scan(step, start, jnp.arange(500))[1])

    assert float(closest(jnp.asarray(0.1, dtype))) > 0.16 - 3.0 * 0.1**2 / 2 - 2 * 1.6 * dt
    assert float(closest(jnp.asarray(0.0, dtype))) < 0.1


def test_glitches_stop_without_chatter() -> None:
    """Distances that jump and vanish for single frames: a stop for each, no resumption between two close ones."""
    d = np.full(200, 3.0)
    d[50:80:5] = np.nan
    d[120] = -7.0

    def step(state, one):
        state, decision = monitor(PARAMS, state, one[None], jnp.ones(1), 0.0, DT)
        return state, (decision.zone, decision.reasons)

    zone, reasons = jax.jit(lambda d: jax.lax.scan(step, initial_zone(jnp.float64), d))(jnp.asarray(d))[1]
    zone = np.asarray(zone)
    assert np.all(zone[50:84] == STOP) and np.all(zone[85:120] == GREEN) and zone[120] == STOP
    assert np.count_nonzero(np.diff(zone)) == 4
    assert np.all((np.asarray(reasons) != 0) == (zone == STOP))
