"""The sound score: every term by hand and monotone, no quality above a failure, singular points."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcjax.metrics import (
    SoundScoreParams,
    SoundTerms,
    log_dimensionless_jerk,
    sound_clearance,
    sound_energy,
    sound_jerk,
    sound_score,
    sound_separation,
    sound_time,
)

NAMES = ("clearance", "separation", "time", "jerk", "energy")
out_of_100 = st.floats(0, 100)
positive = st.floats(0.01, 100)
# Compiled once, not operation by operation.
score = jax.jit(lambda params, success, terms: sound_score(params, success, SoundTerms(*terms)))
separation_term = jax.jit(sound_separation)


def number(params: SoundScoreParams, success: bool, terms: list[float]) -> float:
    return float(score(jax.tree.map(jnp.asarray, params), jnp.asarray(success), jnp.asarray(terms)))


def test_score_by_hand() -> None:
    terms = [100.0, 80.0, 60.0, 40.0, 20.0]
    quality = 0.25 * 100 + 0.25 * 80 + 0.2 * 60 + 0.15 * 40 + 0.15 * 20  # 66
    assert quality == pytest.approx(66)
    assert number(SoundScoreParams(), True, terms) == pytest.approx(20 + 0.8 * 66)
    assert number(SoundScoreParams(), False, terms) == pytest.approx(6.6)
    assert number(SoundScoreParams(), True, [100.0] * 5) == pytest.approx(100)
    assert number(SoundScoreParams(0.0, 0.0, 0.0, 0.0, 2.0, 50.0, 5.0), True, terms) == pytest.approx(60)


def test_terms_by_hand() -> None:
    np.testing.assert_allclose([sound_clearance(d, 0.05) for d in (-1.0, 0.0, 0.01, 0.025, 0.05, 9.0)],
                               [0, 0, 36, 75, 100, 100], atol=1e-12)  # fmt: skip
    np.testing.assert_allclose([sound_time(2.0, t) for t in (1.0, 2.0, 4.0, 0.0)], [100, 100, 50, 100])
    np.testing.assert_allclose([sound_energy(e, 30.0) for e in (0.0, 30.0, 120.0)], [100, 50, 20])
    reach = float(log_dimensionless_jerk(minimum_jerk_reach(), 200.0))
    np.testing.assert_allclose([sound_jerk(x, 10.0) for x in (0.0, reach, reach - 10)],
                               [100, 100, 100 / np.e], rtol=0.01)  # fmt: skip
    # half a second of four at half of S_p, another in contact: missing shares 0, 0, 1/2, 1
    d = jnp.array([1.0, 2.0, 0.25, -0.1, 0.0])
    mask = jnp.array([True, True, True, True, False])
    np.testing.assert_allclose(separation_term(d, jnp.array([0.5, 0.5, 0.5, 0.5, 9.0]), mask), 100 * (1 - 1.75 / 4))


def minimum_jerk_reach() -> jax.Array:
    u = np.linspace(0, 1, 401)
    return jnp.asarray((10 * u**3 - 15 * u**4 + 6 * u**5)[:, None] * np.array([0.3, 0.4, 0.0]))


@settings(deadline=None, max_examples=60)
@given(st.lists(out_of_100, min_size=5, max_size=5), st.integers(0, 4), out_of_100, st.booleans(),
       st.lists(positive, min_size=5, max_size=5))  # fmt: skip
def test_score_grows_with_each_term(
    terms: list[float], which: int, other: float, success: bool, weights: list[float]
) -> None:
    params = SoundScoreParams(*weights)
    changed = [*terms[:which], other, *terms[which + 1 :]]
    low, high = sorted([changed, terms], key=lambda t: t[which])
    assert number(params, success, high) >= number(params, success, low) - 1e-9
    if high[which] - low[which] > 1:
        assert number(params, success, high) > number(params, success, low)


@settings(deadline=None, max_examples=60)
@given(st.lists(out_of_100, min_size=5, max_size=5), st.lists(out_of_100, min_size=5, max_size=5),
       st.lists(positive, min_size=5, max_size=5))  # fmt: skip
def test_a_failed_run_is_below_every_successful_one(bad: list[float], good: list[float], weights: list[float]) -> None:
    params = SoundScoreParams(*weights)
    failed, arrived = number(params, False, bad), number(params, True, good)
    assert 0 <= failed <= 10 + 1e-9 and 20 - 1e-9 <= arrived <= 100 + 1e-9 and failed < arrived


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(-0.2, 2), min_size=6, max_size=6), st.integers(0, 5), st.floats(0, 1), positive)
def test_terms_are_monotone(separation: list[float], which: int, more: float, value: float) -> None:
    """Farther, faster, smoother and with less energy is never worse; less than a millionth may be rounding."""
    d, S_p = jnp.asarray(separation), jnp.full(6, 0.7)
    farther, wider = separation_term(d.at[which].add(more), S_p), separation_term(d, S_p.at[which].add(more))
    here = separation_term(d, S_p)
    assert 0 <= wider <= here + 1e-9 and here <= farther + 1e-9 <= 100 + 2e-9
    assert sound_clearance(separation[0] + more, 0.05) >= sound_clearance(separation[0], 0.05) - 1e-9
    assert sound_time(1.0, value + more) <= sound_time(1.0, value)
    assert sound_energy(value + more, 30.0) <= sound_energy(value, 30.0)
    assert sound_jerk(-value - more, 10.0) <= sound_jerk(-value, 10.0)


def test_nobody_and_no_obstacle_count_in_full(dtype: jnp.dtype) -> None:
    for far in (10.0, np.inf):
        d = jnp.full(4, far, dtype)
        assert separation_term(d, jnp.asarray(0.5, dtype)) == 100
        assert sound_clearance(jnp.asarray(far, dtype), 0.05) == 100
    assert separation_term(d, jnp.asarray(0.5, dtype)).dtype == dtype


def test_derivatives_at_singular_points() -> None:
    slopes = [
        jax.grad(lambda d: sound_clearance(d, 0.05))(x) for x in (0.0, 0.05, jnp.inf)
    ] + [jax.grad(lambda t: sound_time(1.0, t))(0.0), jax.grad(lambda x: sound_jerk(x, 10.0))(0.0)]  # fmt: skip
    slopes.append(jnp.sum(jax.grad(lambda d: sound_separation(d, 0.5))(jnp.array([0.0, 0.5, jnp.inf]))))
    assert np.isfinite(slopes).all()
    np.testing.assert_allclose(jax.grad(lambda d: sound_clearance(d, 0.05))(0.025), 100 / 0.05, rtol=1e-9)
