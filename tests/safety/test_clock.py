"""The clock: bounds on speed, acceleration and jerk, the way to a stop, the end, and derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcjax.safety import ClockParams, ClockState, advance, initial_clock, stop_length

PARAMS = ClockParams()
DT = 0.008
STEPS = 500


def simulate(params, length, limits, dt, hold):
    def tick(clock, now):
        clock = advance(params, clock, now[0], length - clock.s, dt, now[1])
        return clock, clock

    return jax.lax.scan(tick, initial_clock(length.dtype), (limits, hold))[1]


_run = jax.jit(simulate)


def run(limits, length=2.0, params=PARAMS, hold=None, dtype=jnp.float64):
    limits = jnp.broadcast_to(jnp.asarray(limits, dtype), (STEPS,))
    hold = jnp.zeros(STEPS, bool) if hold is None else jnp.asarray(hold)
    params = jax.tree.map(lambda x: jnp.asarray(x, dtype), params)
    return _run(params, jnp.asarray(length, dtype), limits, jnp.asarray(DT, dtype), hold)


def jerk(clock):
    return np.diff(np.concatenate([[0.0], np.asarray(clock.a, float)])) / DT


@pytest.mark.parametrize(("length", "limit"), [(2.0, 1.0), (1.5, 0.5), (0.5, 1.0), (0.1, 0.25), (0.01, 1.0)])
def test_rest_to_rest(length: float, limit: float, dtype: jnp.dtype) -> None:
    """One path under one limit: all bounds hold, the end is met, and no time is wasted.

    The least time with jerk bounds is L/V + V/a + a/j where speed and acceleration reach their bounds.
    """
    clock = run(limit, length, dtype=dtype)
    assert clock.s.dtype == clock.v.dtype == clock.a.dtype == dtype
    s, v, a = (np.asarray(x, float) for x in (clock.s, clock.v, clock.a))
    np.testing.assert_allclose(s[-1], length, atol=1e-6)
    assert v[-1] == 0 and a[-1] == 0
    assert v.max() <= limit * (1 + 1e-6) and v.min() >= 0 and np.all(np.diff(s) >= -1e-7)
    assert np.abs(a).max() <= 1.0 + 1e-5
    moving = s < length - 1e-4
    assert np.abs(jerk(clock)[moving]).max() <= 10.0 * 1.005  # but for the last ticks at the very end
    assert np.abs(np.diff(a)).max() <= 0.35
    if length >= 1.5:
        time = DT * np.argmax(s > length - 1e-4)
        np.testing.assert_allclose(time, length / limit + limit + 0.1, atol=0.06)


def test_deceleration_has_a_bound_of_its_own() -> None:
    """Planned stops use `deceleration`, not `acceleration`, and not `brake`."""
    clock = run(1.0, 1.5, ClockParams(acceleration=2.0, deceleration=0.5))
    a = np.asarray(clock.a)
    np.testing.assert_allclose([a.max(), a.min()], [2.0, -0.5], rtol=1e-3)
    np.testing.assert_allclose(clock.s[-1], 1.5, atol=1e-6)


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.sampled_from([0.0, 0.05, 0.25, 0.6, 1.0, float("nan")]), min_size=20, max_size=20), st.floats(0.05, 3.0)
)
def test_any_limits(levels: list[float], length: float) -> None:
    """Limits that jump, vanish and come back."""
    limits = np.repeat(levels, STEPS // 20)
    clock = run(limits, length)
    s, v, a = (np.asarray(x) for x in (clock.s, clock.v, clock.a))
    limits = np.nan_to_num(limits)
    before = np.concatenate([[0.0], v[:-1]])
    assert np.all(np.diff(s) >= 0) and np.all(v >= 0) and np.all(s <= length + 1e-12)
    assert np.all(v <= np.maximum(limits, before - 3.0 * DT) + 1e-9)  # within the limit, or braking at the bound
    assert np.all(a <= 1.0 + 1e-9) and np.all(a >= -3.0 - 1e-9)
    rise = np.diff(np.concatenate([[0.0], np.maximum(a, 0.0)])) / DT
    assert np.all(rise <= 10.0 * (1 + 1e-6))  # resuming: no jump of the acceleration
    at_rest = np.concatenate([[0.0], s[:-1]]) >= length
    assert np.all(v[at_rest] == 0)


def test_braking_for_a_limit_is_at_once_and_at_the_bound() -> None:
    """From 1 m/s at 3 m/s^2: 1/3 s and 1/6 m; the stopping distance that the separation rule counts on."""
    limits = np.where(np.arange(STEPS) < 250, 1.0, 0.0)
    clock = run(limits, 50.0)
    v, s = np.asarray(clock.v), np.asarray(clock.s)
    np.testing.assert_allclose(v[249], 1.0, rtol=1e-9)
    np.testing.assert_allclose(v[250], 1.0 - 3.0 * DT, rtol=1e-9)
    np.testing.assert_allclose(s[-1] - s[249], 1 / 6, rtol=0.01)
    assert v[250 + 42] == 0 and v[250 + 40] > 0
    np.testing.assert_allclose(np.diff(v), clock.a[1:] * DT, atol=1e-12)  # also in the tick that ends at rest


def test_resumes_smoothly() -> None:
    """After a stop: no jump, no full speed at once."""
    limits = np.where((np.arange(STEPS) >= 200) & (np.arange(STEPS) < 280), 0.0, 1.0)
    clock = run(limits, 50.0)
    np.testing.assert_allclose(np.abs(jerk(clock)[280:]).max(), 10.0, rtol=1e-6)
    np.testing.assert_allclose(clock.v[280], 10.0 * DT * DT, rtol=1e-9)
    np.testing.assert_allclose(clock.v[-1], 1.0, rtol=1e-9)


@pytest.mark.parametrize("bad", [np.nan, -1.0, 0.0])
def test_no_limit_no_motion(bad: float) -> None:
    assert run(bad).s[-1] == 0


def test_hold() -> None:
    held = run(1.0, hold=np.arange(STEPS) >= 100)
    free = run(1.0)
    assert held.v[99] == free.v[99] > 0 and held.v[-1] == 0
    assert held.v[100] < held.v[99] - 2.9 * DT


def test_a_path_that_ends_sooner_brakes_harder() -> None:
    """The remaining length may shrink: then up to `brake` is used, and the clock never runs beyond the end."""
    before = run(1.0, 50.0)
    clock = jax.tree.map(lambda x: x[250], before)
    seen = []
    tick = jax.jit(lambda clock, r: advance(PARAMS, clock, 1.0, r, DT))
    for _ in range(80):
        clock = tick(clock, before.s[250] + 0.2 - clock.s)
        seen.append((float(clock.s), float(clock.v), float(clock.a)))
    s, v, a = np.transpose(seen)
    assert s.max() <= before.s[250] + 0.2 + 1e-12 and v[-1] == 0
    np.testing.assert_allclose(a[0], -1 / (2 * 0.2), rtol=1e-6)  # v^2 / 2 r
    assert a.min() >= -3.0 - 1e-9


def test_the_path_is_not_left() -> None:
    """The points passed under any limit are points of the path: a circle of radius 0.3 m, within 1e-9."""
    rng = np.random.default_rng(0)
    s = run(rng.uniform(0.0, 1.0, STEPS), 0.9).s
    x = 0.3 * jnp.stack([jnp.cos(s / 0.3), jnp.sin(s / 0.3)])
    np.testing.assert_allclose(jnp.linalg.norm(x, axis=0), 0.3, atol=1e-9)


@pytest.mark.parametrize(("v", "a"), [(1.0, 0.0), (1.0, 0.7), (0.5, -0.6), (0.03, 0.2), (0.02, 0.0), (0.4, -1.0)])
def test_stop_length_against_integration(v: float, a: float) -> None:
    """Jerk down to the peak, constant, jerk up: integrated in small steps with a search for when to let go."""
    j, a_max, h = 10.0, 1.0, 1e-5
    s, speed, acc = 0.0, v, a
    while speed > 0 and not (acc >= 0 and speed < 1e-6):
        let_go = acc < 0 and speed <= acc * acc / (2 * j)
        acc = min(acc + j * h, 0.0) if let_go else max(acc - j * h, -a_max)
        s, speed = s + speed * h, speed + acc * h
        if let_go and acc == 0.0:
            break
    np.testing.assert_allclose(stop_length(PARAMS, v, a), s, atol=3e-5)


def test_stop_length_when_braking_too_hard() -> None:
    """v 0.02, a -0.9, j 10: rest at t = (.9 - sqrt(.81 - .4)) / 10 by v + a t + j t^2 / 2 = 0."""
    t = (0.9 - np.sqrt(0.81 - 0.4)) / 10
    np.testing.assert_allclose(stop_length(PARAMS, 0.02, -0.9), 0.02 * t - 0.45 * t**2 + 10 * t**3 / 6, rtol=1e-9)
    assert stop_length(PARAMS, 0.0, 0.0) == 0


def test_stop_length_of_a_staircase() -> None:
    """Ticks of constant acceleration .16, .08, ..., -.40, -.32, ..., 0 m/s^2, entered from .24 m/s^2."""
    steps = np.concatenate([np.arange(2, -6, -1), np.arange(-4, 1)]) * 0.08
    v = -steps.sum() * DT
    after = v + np.cumsum(steps) * DT
    before = np.concatenate([[v], after[:-1]])
    np.testing.assert_allclose(stop_length(PARAMS, v, 0.24, DT), np.sum(before + after) * DT / 2, rtol=5e-3)


def test_the_brake_is_let_go_to_the_planned_deceleration() -> None:
    """A limit that falls and comes back: from -3 to -1 m/s^2 at once, from there by the jerk."""
    k = np.arange(STEPS)
    clock = run(np.where((k >= 250) & (k < 255), 0.2, 1.0), 50.0)
    np.testing.assert_allclose(clock.a[254:257], [-3.0, -1.0 + 0.08, -1.0 + 0.16], rtol=1e-6)


def test_derivatives() -> None:
    """Distance after 1.2 s, with a planned stop in it, by every number and the limit, against finite differences."""
    params = jax.tree.map(jnp.asarray, PARAMS)

    def travelled(params, limit, steps=150, length=0.5):
        clock = simulate(params, jnp.asarray(length), jnp.full(steps, limit), jnp.asarray(DT), jnp.zeros(steps, bool))
        return clock.s[-1]

    value = jax.jit(travelled)
    slopes, slope = jax.jit(jax.grad(travelled, argnums=(0, 1)))(params, jnp.asarray(0.5))
    h = 1e-5
    expected = (value(params, 0.5 + h) - value(params, 0.5 - h)) / (2 * h)
    np.testing.assert_allclose(slope, expected, rtol=1e-4)
    for name in ("acceleration", "deceleration", "jerk"):
        up = eqx.tree_at(lambda p, n=name: getattr(p, n), params, getattr(params, name) * (1 + h))
        down = eqx.tree_at(lambda p, n=name: getattr(p, n), params, getattr(params, name) * (1 - h))
        expected = (value(up, 0.5) - value(down, 0.5)) / (2 * h * getattr(params, name))
        assert jnp.abs(expected) > 1e-5
        np.testing.assert_allclose(getattr(slopes, name), expected, rtol=1e-4, atol=1e-6)


def test_derivatives_at_rest_are_finite() -> None:
    """At the start, on hold, at the end and beyond it."""
    clock = initial_clock(jnp.float64)
    slope = jax.jit(
        jax.grad(lambda limit, r, hold: sum(jax.tree.leaves(advance(PARAMS, clock, limit, r, DT, hold))), (0, 1))
    )
    for limit, r, hold in (
        (1.0, 1.0, False),
        (0.0, 1.0, False),
        (1.0, 0.0, False),
        (1.0, -1.0, False),
        (1.0, 1.0, True),
    ):
        assert np.all(np.isfinite(slope(limit, r, hold)))


def test_derivatives_of_a_stop_at_the_end_are_those_of_its_values() -> None:
    """Random states about a planned stop, from 1 mm/s on, among them those whose braking just changes its form: a root that is not
    reached has a derivative that is 10 and more times too large there."""
    rng = np.random.default_rng(0)
    count = 20_000
    v, a = 10 ** rng.uniform(-3, -0.3, count), rng.uniform(-1.0, 0.3, count)
    stop = np.asarray(jax.jit(jax.vmap(lambda v, a: stop_length(PARAMS, v, a, DT)))(jnp.asarray(v), jnp.asarray(a)))
    left = stop * rng.uniform(0.9, 1.2, count) + v * DT * rng.uniform(0, 1.5, count)
    limit = jnp.asarray(v * rng.uniform(0.8, 1.5, count))

    def after(x):
        def one(v, a, left, limit):
            return advance(PARAMS, ClockState(jnp.zeros_like(v), v, a), limit, left, DT).a

        return jax.vmap(one)(x[0], x[1], x[2], limit)

    at, step = jnp.asarray(np.stack([v, a, left])), 1e-10
    program = jax.jit(after)
    for k in range(3):
        way = jnp.zeros_like(at).at[k].set(1.0)
        slope = jax.jit(lambda x, way: jax.jvp(after, (x,), (way,))[1])(at, way)
        difference = (program(at + step * way) - program(at - step * way)) / (2 * step)
        off = np.abs(slope - difference) / (1 + np.abs(difference))
        assert off.max() < 0.05, (k, at[:, off.argmax()])
