"""Limits: no sequence of wishes, however hostile, drives a joint across them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from hrcjax.policy import JointLimits, limit_acceleration

JOINTS = 3


def limits_of(dtype=jnp.float64):
    return JointLimits(
        q_min=jnp.asarray([-1.0, -6.28, 0.2], dtype),
        q_max=jnp.asarray([1.0, 6.28, 0.9], dtype),
        qd_max=jnp.asarray([3.14, 2.0, 1.0], dtype),
        qdd_max=jnp.asarray([10.0, 20.0, 40.0], dtype),
    )


def hostile(kind, key, q, qd, t):
    """Wishes for acceleration made to cross a limit."""
    size = 200.0
    if kind == "up":
        return jnp.full_like(q, size)
    if kind == "down":
        return jnp.full_like(q, -size)
    if kind == "along":  # whatever it does, more of it
        return jnp.where(qd >= 0, size, -size).astype(q.dtype)
    if kind == "swing":
        return size * jnp.sin(0.05 * t) * jnp.ones_like(q)
    if kind == "gentle":
        return jnp.full_like(q, 0.3)
    return 30.0 * jax.random.normal(jax.random.fold_in(key, t.astype(int)), q.shape, q.dtype)


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("kind", ["up", "down", "along", "swing", "gentle", "noise"])
@pytest.mark.parametrize("dt", [0.002, 0.02])
def test_limits_are_never_crossed(exact, kind, dt, dtype):
    limits = limits_of(dtype)

    def step(state, t):
        q, qd = state
        qdd, _ = limit_acceleration(hostile(kind, jax.random.key(1), q, qd, t), q, qd, limits, dt)
        after = qd + qdd * dt
        turn = jnp.where(qdd == 0, 0, -qd / jnp.where(qdd == 0, 1, qdd))
        turns = (turn > 0) & (turn < dt) & exact
        extreme = jnp.where(turns, q + qd * turn / 2, q)  # between the samples
        q = q + (qd + after) * dt / 2 if exact else q + after * dt
        return (q, after), (q, after, qdd, extreme)

    start = (jnp.asarray([0.9, 0.0, 0.5], dtype), jnp.zeros(JOINTS, dtype))
    _, (q, qd, qdd, extreme) = jax.jit(lambda s: jax.lax.scan(step, s, jnp.arange(3000, dtype=dtype)))(start)
    slack = 1e-5 if dtype == jnp.float32 else 1e-12
    for place in (q, extreme):
        assert jnp.all(place <= limits.q_max + slack) and jnp.all(place >= limits.q_min - slack)
    assert jnp.all(jnp.abs(qd) <= limits.qd_max + slack)
    assert jnp.all(jnp.abs(qdd) <= limits.qdd_max * (1 + 1e-6))
    if kind in ("up", "down"):  # and no room is given away: the joint arrives and rests there
        end = limits.q_max if kind == "up" else limits.q_min
        np.testing.assert_allclose(q[-1], end, atol=1e-5)
        assert jnp.abs(qdd[-50:]).max() < (1.0 if dtype == jnp.float32 else 1e-5)  # without bouncing
        top = jnp.max(jnp.abs(qd), axis=0)
        np.testing.assert_allclose(top[1], limits.qd_max[1], rtol=1e-3)
        np.testing.assert_allclose(jnp.max(jnp.abs(qdd), axis=0)[0], limits.qdd_max[0], rtol=1e-2)


def test_wishes_within_the_limits_pass_unchanged(dtype):
    q, qd, wish = (jnp.asarray(v, dtype) for v in ([0.0, 1.0, 0.5], [0.1, -0.2, 0.0], [5.0, -19.0, 1.0]))
    qdd, saturated = limit_acceleration(wish, q, qd, limits_of(dtype), 0.008)
    np.testing.assert_array_equal(qdd, wish)
    assert not saturated.any() and qdd.dtype == dtype


def test_scaling_keeps_the_direction():
    wish = jnp.array([20.0, -10.0, 1.0])
    qdd, saturated = limit_acceleration(wish, jnp.array([0.0, 1.0, 0.5]), jnp.zeros(3), limits_of(), 0.008)
    np.testing.assert_allclose(qdd, wish / 2, rtol=1e-14)
    np.testing.assert_array_equal(saturated, [True, False, False])


def test_each_bound_in_closed_form():
    limits, dt = limits_of(), 0.01
    zero = jnp.zeros(3)
    middle = jnp.array([0.0, 0.0, 0.5])
    qdd, saturated = limit_acceleration(jnp.array([0.0, 20.0, 0.0]), middle, zero.at[1].set(1.9), limits, dt)
    np.testing.assert_allclose(qdd, [0.0, 10.0, 0.0], atol=1e-12)  # to 2 rad/s in one step
    np.testing.assert_array_equal(saturated, [False, True, False])
    qdd, _ = limit_acceleration(jnp.array([0.0, -20.0, 0.0]), middle, zero.at[1].set(-1.9), limits, dt)
    np.testing.assert_allclose(qdd, [0.0, -10.0, 0.0], atol=1e-12)
    qd = 2.0  # braking from 2 rad/s at 10 rad/s^2 takes 0.2 rad: on that edge full braking is the only way
    qdd, _ = limit_acceleration(zero, middle.at[0].set(0.8), zero.at[0].set(qd), limits, dt)
    np.testing.assert_allclose(qdd[0], -10.0, rtol=1e-9)
    qdd, _ = limit_acceleration(zero, middle.at[0].set(-0.8), zero.at[0].set(-qd), limits, dt)
    np.testing.assert_allclose(qdd[0], 10.0, rtol=1e-9)
    qdd, _ = limit_acceleration(zero, middle.at[0].set(0.77), zero.at[0].set(qd), limits, dt)
    np.testing.assert_array_equal(qdd, 0.0)  # 0.03 rad earlier there is still a step to spare


def test_braking_bound_between_nothing_and_full():
    """Room 0.21 rad at 2 rad/s: v' with v'^2 = 2 qdd_max (room - (v + v') dt / 2)."""
    q, qd, dt = jnp.array([0.79, 0.0, 0.5]), jnp.array([2.0, 0.0, 0.0]), 0.01
    qdd, _ = limit_acceleration(jnp.zeros(3), q, qd, limits_of(), dt)
    after = 2.0 + qdd[0] * dt
    assert -10.0 < qdd[0] < 0.0
    np.testing.assert_allclose(after**2, 2 * 10.0 * (0.21 - (2.0 + after) * dt / 2), rtol=1e-12)


def test_passing_an_end_by_rounding_is_undone_gently():
    qdd, _ = limit_acceleration(
        jnp.zeros(3), jnp.array([1.0, 0.0, 0.5]), jnp.array([1e-3, 0.0, 0.0]), limits_of(), 0.01
    )
    np.testing.assert_allclose(qdd[0], -0.2, rtol=1e-12)  # to -1e-3 rad/s: back where it was


def test_where_the_bounds_exclude_each_other_their_mean_is_taken():
    limits = JointLimits(*(jnp.array([v]) for v in (1.0, -1.0, 3.0, 10.0)))  # no range at all
    qdd, _ = limit_acceleration(jnp.array([5.0]), jnp.zeros(1), jnp.array([0.01]), limits, 0.01)
    np.testing.assert_allclose(qdd, -1.5, rtol=1e-12)  # between -2 and -1


def test_outside_the_limits_it_brakes_and_does_not_go_on():
    limits, middle, dt = limits_of(), jnp.array([0.0, 0.0, 0.5]), 0.01
    push = jnp.full(3, 5.0)
    qdd, saturated = limit_acceleration(push, middle.at[0].set(1.1), jnp.zeros(3), limits, dt)
    assert qdd[0] == 0 and saturated[0]  # beyond, at rest: stays
    qdd, _ = limit_acceleration(push, middle.at[0].set(1.1), jnp.array([0.5, 0.0, 0.0]), limits, dt)
    np.testing.assert_allclose(qdd[0], -10.0)  # beyond, going on: full brake
    qdd, _ = limit_acceleration(-push, middle.at[0].set(1.1), jnp.array([-0.05, 0.0, 0.0]), limits, dt)
    np.testing.assert_allclose(qdd[0], -5.0)  # beyond, coming back: allowed
    qdd, _ = limit_acceleration(push, middle, jnp.array([5.0, 0.0, 0.0]), limits, dt)
    np.testing.assert_allclose(qdd[0], -10.0)  # too fast: full brake
    narrow = JointLimits(*(jnp.full(3, v) for v in (-1e-9, 1e-9, 3.0, 10.0)))
    qdd, _ = limit_acceleration(push, jnp.full(3, 5e-10), jnp.zeros(3), narrow, dt)
    assert jnp.all(jnp.abs(qdd) < 1e-4)


@jax.jit
def limited(wish, q, qd):
    return limit_acceleration(wish, q, qd, limits_of(), 0.01)[0]


derivatives = [jax.jit(derivative(limited, argnums=(0, 1, 2))) for derivative in (jax.jacfwd, jax.jacrev)]


@pytest.mark.parametrize("place", [0.0, 0.79, 0.9, 1.0 - 1e-7, 1.0, 1.2])
@pytest.mark.parametrize("speed", [0.0, 1.9, -1.0])
def test_derivatives_are_finite_and_right(place, speed):
    q, qd = jnp.array([place, 0.5, 0.5]), jnp.array([speed, 0.3, 0.0])
    wish = jnp.array([9.0, -30.0, 1.0])
    for derivative in derivatives:
        for part in derivative(wish, q, qd):
            assert jnp.isfinite(part).all()
    if place < 1.0 - 1e-6:
        check_grads(limited, (wish, q, qd), 1, eps=1e-8, atol=1e-4, rtol=1e-4)
