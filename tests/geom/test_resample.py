import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads

from hrcjax.geom.resample import resample_path as resample_

resample = jax.jit(resample_, static_argnums=1)


def oracle(w, count):
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(w, axis=0), axis=1))])
    return np.stack([np.interp(np.linspace(0, s[-1], count), s, w[:, k]) for k in range(3)], axis=1)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000))
def test_agrees_with_linear_interpolation_over_length(seed):
    w = np.cumsum(np.random.default_rng(seed).normal(size=(9, 3)), axis=0)
    np.testing.assert_allclose(resample(jnp.asarray(w), 16), oracle(w, 16), atol=1e-12)


def test_repeated_waypoints(dtype):
    w = np.array([[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 0]], float)
    out = resample(jnp.asarray(w, dtype), 5)
    assert out.dtype == dtype
    np.testing.assert_allclose(out, [[0, 0, 0], [0.5, 0, 0], [1, 0, 0], [1, 0.5, 0], [1, 1, 0]], atol=1e-6)
    assert np.isfinite(jax.jit(jax.jacrev(lambda w: resample(w, 5)))(jnp.asarray(w, dtype))).all()


def test_no_length_at_all():
    w = jnp.ones((4, 3))
    np.testing.assert_allclose(resample(w, 6), 1)
    assert np.isfinite(jax.jit(jax.jacrev(lambda w: resample(w, 6)))(w)).all()


def test_ends_are_exact_and_derivatives_right():
    w = jnp.asarray(np.cumsum(np.random.default_rng(1).normal(size=(6, 3)), axis=0))
    out = resample(w, 9)
    assert (out[0] == w[0]).all() and (out[-1] == w[-1]).all()
    check_grads(lambda w: resample(w, 9), (w,), order=1, modes=["fwd", "rev"], rtol=1e-5)


@pytest.mark.parametrize(("given_", "wanted"), [(1, 5), (5, 1)])
def test_too_few_are_refused(given_, wanted):
    with pytest.raises(ValueError, match="2 or more"):
        resample(jnp.zeros((given_, 3)), wanted)
