import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from hrcjax.numerics import ldl_factor, solve_spd


def spd(n: int, seed: int, dtype) -> jax.Array:
    a = np.random.default_rng(seed).normal(size=(n, n))
    return jnp.asarray(a @ a.T + 0.1 * np.eye(n), dtype)


@pytest.mark.parametrize("n", [1, 3, 6])
def test_solution_agrees_with_lapack(n, dtype):
    A = spd(n, n, dtype)
    b = jnp.asarray(np.random.default_rng(9).normal(size=n), dtype)
    x = solve_spd(A, b)
    assert x.dtype == dtype
    expected = np.linalg.solve(np.asarray(A, np.float64), np.asarray(b, np.float64))
    np.testing.assert_allclose(x, expected, rtol=1e-3 if dtype == jnp.float32 else 1e-10)


def test_factors_multiply_to_the_matrix():
    A = spd(5, 0, jnp.float64)
    lower, diagonal = ldl_factor([[A[i, j] for j in range(i + 1)] for i in range(5)])
    L = np.eye(5)
    for i in range(5):
        for j in range(i):
            L[i, j] = lower[i][j]
    np.testing.assert_allclose(L @ np.diag(np.asarray(diagonal)) @ L.T, A, rtol=1e-12)


def test_derivatives():
    A, b = spd(3, 1, jnp.float64), jnp.asarray([1.0, -2.0, 0.5])
    check_grads(jax.jit(lambda A, b: solve_spd(A + A.T, b)), (A, b), order=2)
