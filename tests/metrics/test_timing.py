"""Arrival: near AND slow, between samples, and never."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.metrics import arrival, ideal_time

# Compiled once a shape, not operation by operation.
arrival = jax.jit(arrival)

GOAL = jnp.array([1.0, 2.0, 3.0])


def approach(rate=2.0, n=401, dt=0.01, offset=1.0):
    """distance = offset exp(-rate t): crosses a tolerance e at ln(offset/e)/rate."""
    t = jnp.asarray(np.arange(n) * dt)
    return GOAL + offset * jnp.exp(-rate * t)[:, None] * jnp.array([0.0, 0.6, -0.8])


def test_time_of_an_exponential_approach(dtype: jnp.dtype) -> None:
    got = arrival(approach().astype(dtype), GOAL.astype(dtype), 0.01, jnp.asarray(0.01, dtype), slow=1.0)
    assert got.success and got.time.dtype == dtype
    np.testing.assert_allclose(got.time, np.log(100) / 2, atol=2e-4)
    assert 0.0098 < got.error <= 0.01
    assert int(got.before.sum()) == 232 and got.before[231] and not got.before[232]


def test_speed_counts_too() -> None:
    """The speed 2 exp(-2 t) falls under 0.005 m/s at ln(400)/2 s, after the distance has come under 1 cm."""
    got = arrival(approach(), GOAL, 0.01, 0.01, slow=0.005)
    np.testing.assert_allclose(got.time, np.log(400) / 2, atol=0.006)


def test_passing_the_goal_is_not_arriving() -> None:
    x = GOAL + jnp.linspace(-1, 1, 101)[:, None] * jnp.array([1.0, 0.0, 0.0])
    got = arrival(x, GOAL, 0.05, 0.1)
    assert not got.success and jnp.all(got.before)
    np.testing.assert_allclose([got.time, got.error], [10.0, 1.0], rtol=1e-9)


def test_at_the_goal_from_the_start() -> None:
    got = arrival(jnp.broadcast_to(GOAL, (5, 3)), GOAL, 0.01, 0.1)
    assert got.success and got.time == 0 and got.error == 0 and got.before.sum() == 1


def test_derivative_of_the_time() -> None:
    """d/d rate of ln(100)/rate; finite where the goal is never reached, and at it."""
    slope = jax.jit(jax.grad(lambda rate, o: arrival(approach(rate, offset=o), GOAL, 0.01, 0.01, 1.0).time))
    np.testing.assert_allclose(slope(2.0, 1.0), -np.log(100) / 4, rtol=0.01)
    assert slope(0.1, 1.0) == 0
    assert jnp.isfinite(slope(2.0, 0.0))


def test_too_few_samples() -> None:
    with pytest.raises(ValueError, match="at least 2"):
        arrival(GOAL[None], GOAL, 0.1, 0.1)


def test_ideal_time_is_the_area_of_a_trapezium() -> None:
    """1 m at 0.5 m/s with ramps of 0.25 s: the way is the area under the speed."""
    t = np.linspace(0, 2.25, 2_251)
    speed = np.minimum(np.minimum(2 * t, 0.5), 2 * (2.25 - t))
    np.testing.assert_allclose(np.trapezoid(speed, t), 1.0, rtol=1e-6)
    assert float(ideal_time(1.0, 0.5, 2.0)) == 2.25
