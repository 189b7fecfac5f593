"""Speed and separation: the figures of the literature, the inverse law, monotony, and closing down on missing data."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads
from scipy.optimize import brentq

from hrcjax.safety import (
    SsmParams,
    allowed_speed,
    assumed_human_speed,
    protective_distance,
    safe_distance,
    separation_distance,
    stopping_distance,
    stopping_time,
)

# Compiled once a shape, not operation by operation.
allowed_speed = jax.jit(allowed_speed)
separation_distance = jax.jit(separation_distance)
assumed_human_speed = jax.jit(assumed_human_speed)
safe_distance = jax.jit(safe_distance)

PARAMS = SsmParams()
slope = jax.jit(jax.grad(lambda d: allowed_speed(PARAMS, d)))
LAW = settings(max_examples=30, deadline=None)


@pytest.mark.parametrize(("v_r", "expected"), [(1.0, 1.24), (0.5, 1.115), (0.0, 0.99)])
def test_protective_distance_of_the_literature(v_r: float, expected: float, dtype: jnp.dtype) -> None:
    """v_h 1.6, T_r .1, T_s .3, S_s = v T_s / 2, C .2, Z_d .1, Z_r .05: figures quoted from the standard's readers."""
    v = jnp.asarray(v_r, dtype)
    S_p = protective_distance(v, 1.6, 0.1, 0.3, v * 0.3 / 2, 0.2, 0.1, 0.05)
    assert S_p.dtype == dtype
    np.testing.assert_allclose(S_p, expected, rtol=1e-6)


@pytest.mark.parametrize(("v_r", "expected"), [(0.0, 0.32), (0.25, 0.49), (1.0, 1.12), (1.5, 1.65)])
def test_separation_distance_of_the_literature(v_r: float, expected: float, dtype: jnp.dtype) -> None:
    """The reference's second set, printed to the centimetre: the defaults."""
    S_p = separation_distance(PARAMS, jnp.asarray(v_r, dtype))
    assert S_p.dtype == dtype
    np.testing.assert_allclose(S_p, expected, atol=0.0051)


def test_terms_by_hand() -> None:
    """Every term with a figure of its own, so that no two can be exchanged."""
    params = SsmParams(v_h=1.1, reaction_time=0.2, brake=2.5, intrusion=0.3, Z_d=0.05, Z_r=0.007)
    T_s = 0.8 / 2.5
    expected = 1.1 * (0.2 + T_s) + 0.8 * 0.2 + 0.8**2 / (2 * 2.5) + 0.3 + 0.05 + 0.007
    np.testing.assert_allclose(separation_distance(params, 0.8), expected, rtol=1e-12)
    np.testing.assert_allclose(separation_distance(params, 0.8, 1.3), expected + 0.2 * (0.2 + T_s), rtol=1e-12)
    np.testing.assert_allclose(stopping_time(params, 0.8), T_s, rtol=1e-12)
    np.testing.assert_allclose(stopping_distance(params, 0.8), 0.128, rtol=1e-12)


def test_retreats_count_as_standing() -> None:
    assert stopping_distance(PARAMS, -1.0) == 0
    assert separation_distance(PARAMS, -1.0) == separation_distance(PARAMS, 0.0)
    assert separation_distance(PARAMS, 0.5, -1.0) == separation_distance(PARAMS, 0.5, 0.0)
    assert allowed_speed(PARAMS, 0.5, -1.0) == allowed_speed(PARAMS, 0.5, 0.0)


@LAW
@given(st.floats(0.0, 3.0), st.floats(0.0, 3.0), st.floats(0.0, 0.5), st.floats(0.5, 8.0))
def test_separation_of_allowed_speed_is_the_distance(beyond: float, v_h: float, T_r: float, brake: float) -> None:
    params = SsmParams(reaction_time=T_r, brake=brake)
    d = float(separation_distance(params, 0.0, v_h)) + beyond
    np.testing.assert_allclose(separation_distance(params, allowed_speed(params, d, v_h), v_h), d, rtol=1e-9)


@LAW
@given(st.floats(0.0, 2.0), st.floats(0.0, 2.0), st.floats(0.0, 3.0), st.floats(0.0, 0.5))
def test_monotone(d: float, more: float, v_h: float, T_r: float) -> None:
    """The allowed speed grows with the distance and falls with the reaction time and the person's speed."""
    params, slower = SsmParams(reaction_time=T_r), SsmParams(reaction_time=T_r + more)
    v = allowed_speed(params, d, v_h)
    assert 0 <= v <= allowed_speed(params, d + more, v_h)
    assert allowed_speed(slower, d, v_h) <= v
    assert allowed_speed(params, d, v_h + more) <= v
    assert separation_distance(params, d + more, v_h) >= separation_distance(params, d, v_h)


def test_allowed_speed_against_a_root_finder(dtype: jnp.dtype) -> None:
    for d in (0.3201, 0.4, 0.7, 1.3, 5.0):
        expected = brentq(lambda v, d=d: 1.6 * (0.1 + v / 3) + v * 0.1 + v * v / 6 + 0.16 - d, 0.0, 20.0, xtol=1e-14)
        v = allowed_speed(PARAMS, jnp.asarray(d, dtype))
        assert v.dtype == dtype
        np.testing.assert_allclose(v, expected, rtol=1e-5 if d > 0.33 else 2e-3)


@pytest.mark.parametrize("d", [jnp.nan, jnp.inf, -jnp.inf, -1.0, 0.0, 0.3199])
def test_missing_or_too_small_distance_allows_no_speed(d: float) -> None:
    assert allowed_speed(PARAMS, d) == 0
    assert slope(float(d)) == 0


@pytest.mark.parametrize("v_h", [jnp.nan, jnp.inf])
def test_missing_human_speed_allows_no_speed(v_h: float) -> None:
    assert allowed_speed(PARAMS, 2.0, v_h) == 0


def test_derivatives() -> None:
    """Against finite differences away from the boundary; finite on it, with a person at rest and no reaction too."""
    check_grads(jax.jit(lambda d, v_h: allowed_speed(PARAMS, d, v_h)), (0.7, 1.2), order=1)
    check_grads(jax.jit(lambda v: separation_distance(PARAMS, v)), (0.7,), order=1)
    instant = SsmParams(v_h=0.0, reaction_time=0.0)
    for params in (PARAMS, instant):
        d_stop = separation_distance(params, 0.0)
        for d in (d_stop, jnp.nextafter(d_stop, jnp.inf)):
            assert jnp.isfinite(jax.jit(jax.grad(lambda x, p=params: allowed_speed(p, x)))(d))
    gradient = jax.jit(jax.grad(lambda p: allowed_speed(p, 0.8)))(jax.tree.map(jnp.asarray, PARAMS))
    assert gradient.brake > 0 and gradient.reaction_time < 0 and gradient.intrusion < 0


def test_assumed_human_speed() -> None:
    assert assumed_human_speed(PARAMS, 0.499) == 2.0
    assert assumed_human_speed(PARAMS, 0.5) == 1.6


@LAW
@given(v_r=st.floats(0.0, 2.0), near=st.floats(0.2, 0.8), v_h=st.floats(0.2, 3.0), v_h_near=st.floats(0.2, 3.0))
def test_safe_distance_is_the_border_of_what_the_assumed_person_allows(
    v_r: float, near: float, v_h: float, v_h_near: float
) -> None:
    """At every distance beyond it the speed is allowed; just nearer it is not."""
    params = SsmParams(near=near, v_h=v_h, v_h_near=v_h_near)
    border = float(safe_distance(params, v_r))

    def allowed(d: float) -> float:
        return float(allowed_speed(params, d, assumed_human_speed(params, d)))

    for d in (border + 1e-6, border + 0.1, near + 1e-6, 2.0):
        if d > border:
            assert allowed(d) >= v_r - 1e-9
    if v_h <= v_h_near:  # otherwise the border may keep back from distances that are safe
        assert v_r < 1e-3 or allowed(border - 1e-4) < v_r
