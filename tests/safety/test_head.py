"""Limits of every point towards a head: against an arm that is moved step by step, and through the monitor."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.safety import GREEN, HEAD_NEAR, STOP, SafetyParams, initial_zone, monitor
from hrcjax.safety.head import MARGIN, head_limit

PARAMS = SafetyParams()
STOPS, MORE = PARAMS.zone.head_stop, PARAMS.zone.head_hysteresis
DT = 0.008
limits = jax.jit(lambda zone, d: head_limit(PARAMS, zone, d))


def nearest_after(d: float, speed: float) -> float:
    """Distance to a head that stands still after the reaction and braking, stepped through [m]."""
    h, t = 1e-4, 0.0
    while t < PARAMS.ssm.reaction_time - 0.5 * h or speed > 0:
        speed = speed if t < PARAMS.ssm.reaction_time - 0.5 * h else max(speed - PARAMS.ssm.brake * h, 0.0)
        d, t = d - speed * h, t + h
    return d


@pytest.mark.parametrize("more", [0.01, 0.05, 0.3, 1.0])
def test_the_arm_stops_before_the_head_and_not_much_before(more: float) -> None:
    for zone, ends in ((GREEN, STOPS + MARGIN * MORE), (STOP, STOPS + MORE)):
        d = ends + more
        speed = float(limits(jnp.asarray(zone), jnp.asarray([STOPS - 0.1, d]))[1])
        assert speed > 0
        assert nearest_after(d, speed) == pytest.approx(ends, abs=2e-3)


@pytest.mark.parametrize("noise", [0.001, 0.003])
def test_noise_of_the_head_s_place_does_not_stop_an_arm_that_comes(noise: float) -> None:
    """One point that goes at the head as fast as it may, 20 s, the place with new noise in every image."""
    rng = np.random.default_rng(0)

    @jax.jit
    def step(state, head):
        d = jnp.asarray([2.0])
        state, found = monitor(PARAMS, state, d, 0 * d, jnp.asarray(0.02), DT, head_distance=head[None])
        return state, found.head_limit[0], found.zone

    state, d, stops, before, seen = initial_zone(jnp.float64), STOPS + 0.3, 0, GREEN, 0.0
    for k in range(2500):
        seen = noise * rng.standard_normal() if k % 4 == 0 else seen
        state, limit, zone = step(state, jnp.asarray(d + seen))
        d -= DT * min(0.25, float(limit))
        stops, before = stops + (int(zone) == STOP and before != STOP), int(zone)
    assert stops == 0
    assert d == pytest.approx(STOPS + MARGIN * MORE, abs=0.01)


def test_none_approaches_within_the_stop_and_the_nearest_retreats() -> None:
    left = STOPS + MORE
    d = jnp.asarray([STOPS - 0.02, left - 1e-3, left + 1e-3, left + 0.1, 50.0])
    free, stopped = limits(jnp.asarray(GREEN), d), limits(jnp.asarray(STOP), d)
    np.testing.assert_allclose(stopped[0], -PARAMS.zone.retreat_speed)
    assert stopped[1] == 0 and 0 < stopped[2] < 0.02 and stopped[3] > 0.1
    assert (stopped[2:] < free[2:]).all()
    assert free[0] == 0 and free[1] > 0


def test_of_the_monitor() -> None:
    """The stop, its reason and its end are those of one distance; other points keep the limits of their own distance to people."""
    d = jnp.asarray([2.0, 2.0])

    @jax.jit
    def step(state, head):
        return monitor(PARAMS, state, d, 0 * d, jnp.asarray(0.02), DT, head_distance=head)

    start = initial_zone(jnp.float64)
    state, found = step(start, jnp.asarray([STOPS - 0.05, 3.0]))
    whole = step(start, jnp.asarray(STOPS - 0.05))[1]
    assert found.zone == whole.zone == STOP and found.reasons == whole.reasons == HEAD_NEAR
    assert found.head_limit is not None and found.head_limit[0] < 0 < found.head_limit[1]
    assert whole.head_limit is None and (whole.point_limit <= 0).all()
    assert (found.point_limit > 0).all()
    for head, left in ((STOPS + 0.5 * MORE, False), (STOPS + 1.1 * MORE, True)):
        after = state
        for _ in range(20):
            after, found = step(after, jnp.asarray([head, 3.0]))
        assert (found.zone != STOP) == left
    bad = step(start, jnp.asarray([jnp.nan, 3.0]))[1]
    assert bad.hold and bad.head_limit is not None and (bad.head_limit == 0).all()
