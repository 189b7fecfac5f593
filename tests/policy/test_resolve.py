"""Resolution: against scipy, and its derivatives where the metric vanishes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from jax.test_util import check_grads

from hrcjax.policy import Pulled, ResolveParams, resolve


@pytest.mark.parametrize("size", [0.0, 1e-3, 1.0, 99.0, 101.0, 1e5])
@pytest.mark.parametrize("params", [ResolveParams(), ResolveParams(regularisation=0.02, scale=0.5)])
def test_agrees_with_scipy(size, params):
    rng = np.random.default_rng(1)
    root, f = rng.normal(size=(6, 4)), rng.normal(size=6)
    M = root @ root.T
    M *= size / np.abs(M).max()
    s = max(1.0, params.scale * size)
    expected = scipy.linalg.solve(M / s + params.regularisation * np.eye(6), f / s, assume_a="pos")
    got = resolve(params, Pulled(jnp.asarray(M), jnp.asarray(f)))
    np.testing.assert_allclose(got, expected, rtol=1e-9)


def test_defaults(dtype):
    got = resolve(ResolveParams(), Pulled(jnp.zeros((2, 2), dtype), jnp.asarray([1.0, -2.0], dtype)))
    np.testing.assert_allclose(got, [1e3, -2e3], rtol=1e-6)  # f / 1e-3
    got = resolve(ResolveParams(), Pulled(1e4 * jnp.eye(2, dtype=dtype), jnp.asarray([1e4, 0.0], dtype)))
    np.testing.assert_allclose(got, [100 / 100.001, 0.0], rtol=1e-6)  # s = 100
    assert got.dtype == dtype


@pytest.mark.parametrize("size", [0.0, 1.0, 500.0])
def test_derivatives(size):
    M = size * (jnp.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.2], [0.0, 0.2, 0.5]]))
    f = 1e-3 * jnp.array([1.0, -2.0, 3.0])
    params = jax.tree.map(jnp.asarray, ResolveParams())

    @jax.jit
    def solved(M, f, params):
        return resolve(jax.tree.map(jnp.asarray, params), Pulled(jnp.asarray((M + M.T) / 2), jnp.asarray(f)))

    check_grads(solved, (M, f, params), 1, eps=1e-7, rtol=1e-3, atol=1e-3)
