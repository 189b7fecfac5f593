"""Scaling a command: the approach is within the limit, a retreat is free, an elbow counts, missing data stop."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads

from hrcjax.safety import SafetyParams, approach_speeds, governor, guard, initial_zone, monitor, speed_scale

# Compiled once a shape, not operation by operation.
approach_speeds = jax.jit(approach_speeds)
governor = jax.jit(governor)
guard = jax.jit(guard)
speed_scale = jax.jit(speed_scale)

L1, L2 = 0.5, 0.4


def planar_arm(q):
    """Elbow and tool of a planar two-link arm."""
    elbow = L1 * jnp.stack([jnp.cos(q[0]), jnp.sin(q[0]), jnp.zeros_like(q[0])])
    tool = elbow + L2 * jnp.stack([jnp.cos(q[0] + q[1]), jnp.sin(q[0] + q[1]), jnp.zeros_like(q[0])])
    return jnp.stack([elbow, tool])


def scene(q, person):
    x, J = planar_arm(q), jax.jacfwd(planar_arm)(q)
    away = x - person
    d = jnp.linalg.norm(away, axis=-1)
    return x, J, away / d[:, None], d


scaled = jax.jit(governor)


def test_the_elbow_limits_where_the_tool_does_not() -> None:
    """The arm folded back: the tool retreats, the elbow runs at the person. The tool's distance alone would let it."""
    q, qd = jnp.array([0.0, 2.5]), jnp.array([1.0, 0.0])
    person = jnp.array([0.55, 0.6, 0.0])
    _, J, g, d = scene(q, person)
    assert d[0] < d[1] + 0.5
    approach = approach_speeds(qd, J, g)
    assert approach[0] > 0.4
    limit = jnp.asarray(0.1)
    beta = governor(qd, J, g, limit)
    beta_tool = governor(qd, J[1:], g[1:], limit)
    np.testing.assert_allclose(approach[0] * beta, limit, rtol=1e-10)
    assert beta_tool > 1.5 * beta
    tick = jax.jit(lambda d, v_r: monitor(SafetyParams(), initial_zone(jnp.float64), d, v_r, 0.0, 0.01)[1])
    whole, tool = tick(d, approach), tick(d[1:], approach[1:])
    assert whole.scale < tool.scale


def test_approach_speed_against_finite_differences() -> None:
    q, qd, person = jnp.array([0.3, 1.1]), jnp.array([0.7, -1.3]), jnp.array([0.2, 0.9, 0.3])
    _, J, g, d = scene(q, person)
    h = 1e-6
    np.testing.assert_allclose(approach_speeds(qd, J, g), -(scene(q + h * qd, person)[3] - d) / h, rtol=1e-4)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31 - 1), st.floats(0.0, 1.0))
def test_the_approach_is_within_the_limit_and_no_slower_than_needed(seed: int, limit: float) -> None:
    rng = np.random.default_rng(seed)
    J, qd, g = rng.normal(size=(5, 3, 6)), rng.normal(size=6), rng.normal(size=(5, 3))
    g = g / np.linalg.norm(g, axis=-1, keepdims=True)
    beta = float(scaled(jnp.asarray(qd), jnp.asarray(J), jnp.asarray(g), jnp.asarray(limit)))
    approach = max(-g[k] @ J[k] @ qd for k in range(5))
    assert 0 <= beta <= 1
    assert approach * beta <= limit * (1 + 1e-12)
    assert beta == 1 or approach * beta >= limit * (1 - 1e-12) - 1e-300


def test_a_retreat_is_not_slowed() -> None:
    J, g = jnp.eye(3)[None], jnp.array([[1.0, 0.0, 0.0]])
    for limit in (0.0, 0.1):
        assert governor(jnp.array([2.0, 1.0, 0.0]), J, g, jnp.asarray(limit)) == 1
        assert governor(jnp.array([-2.0, 1.0, 0.0]), J, g, jnp.asarray(limit)) == limit / 2


def test_a_limit_of_its_own_for_every_point() -> None:
    approach = jnp.array([1.0, 2.0, -3.0])
    assert speed_scale(approach, jnp.array([0.5, 1.5, 0.0])) == 0.5
    assert speed_scale(approach, jnp.array([0.9, 0.4, 0.0])) == 0.2
    assert speed_scale(approach, jnp.asarray(3.0)) == 1
    assert speed_scale(approach, jnp.asarray(-1.0)) == 0


def test_no_direction_means_approach() -> None:
    """Inside the person the gradient vanishes: then every motion counts."""
    J = jnp.eye(3)[None]
    assert governor(jnp.array([0.0, 2.0, 0.0]), J, jnp.zeros((1, 3)), jnp.asarray(0.5)) == 0.25


@pytest.mark.parametrize("bad", [jnp.nan, jnp.inf])
def test_missing_numbers_stop(bad: float) -> None:
    assert speed_scale(jnp.array([bad, 0.1]), jnp.asarray(1.0)) == 0
    assert speed_scale(jnp.array([-bad, 0.1]), jnp.asarray(1.0)) == 0
    assert speed_scale(jnp.array([0.1, 0.1]), jnp.array([1.0, jnp.nan])) == 0


def test_derivatives_and_precision(dtype: jnp.dtype) -> None:
    rng = np.random.default_rng(3)
    J, qd, g = (jnp.asarray(rng.normal(size=s), dtype) for s in ((4, 3, 6), (6,), (4, 3)))
    assert governor(qd, J, g, jnp.asarray(0.2, dtype)).dtype == dtype
    if dtype == jnp.float64:
        check_grads(jax.jit(lambda qd, limit: governor(qd, J, g, limit)), (qd, jnp.asarray(0.2)), order=1)
    slope = jax.jit(jax.grad(lambda qd: governor(qd, J, 0 * g, jnp.asarray(0.0, dtype))))
    for still in (jnp.zeros(6, dtype), qd):
        slopes = slope(still)
        assert jnp.all(jnp.isfinite(slopes))


@pytest.mark.parametrize("slow", [1e-7, 1e-12, 1e-22, 1e-30])
def test_an_approach_of_almost_nothing_has_finite_derivatives(slow: float) -> None:
    """In single precision the square of 1e-22 is 0: 0 times its inverse was not a number, in motion that creeps in a stop."""
    approach = jnp.asarray([slow, -slow], jnp.float32)
    for limit in (0.0, slow / 2):
        value, slopes = jax.value_and_grad(speed_scale, argnums=(0, 1))(approach, jnp.asarray(limit, jnp.float32))
        assert 0 <= value <= 0.5 and all(np.isfinite(slope).all() for slope in slopes)


def test_guard() -> None:
    command, fallback = jnp.array([1.0, 2.0]), jnp.array([0.0, -1.0])
    kept, bad = guard(command, fallback)
    assert not bad and jnp.array_equal(kept, command)
    for value in (jnp.nan, jnp.inf, -jnp.inf):
        kept, bad = guard(command.at[1].set(value), fallback)
        assert bad and jnp.array_equal(kept, fallback)
