import jax
import jax.numpy as jnp
import numpy as np
import pytest

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


def test_derivatives_are_those_of_the_inverse():
    """x = A^-1 b: x' = -A^-1 A' x and x'' = 2 A^-1 A' A^-1 A' x along a symmetric A'; c.x falls off by A^-1 c in b."""
    A, b, c = spd(3, 1, jnp.float64), jnp.asarray([1.0, -2.0, 0.5]), jnp.asarray([0.3, 0.7, -1.1])
    change = np.array([[0.4, -0.2, 0.1], [-0.2, 0.3, 0.5], [0.1, 0.5, -0.6]])
    inverse = np.linalg.inv(np.asarray(A))
    x = inverse @ b
    first = -inverse @ change @ x
    second = 2 * inverse @ change @ inverse @ change @ x

    def along(t):
        return solve_spd(A + t * jnp.asarray(change), b)

    zero = jnp.asarray(0.0)
    np.testing.assert_allclose(jax.jit(jax.jacfwd(along))(zero), first, rtol=1e-9)
    np.testing.assert_allclose(jax.jit(jax.jacrev(along))(zero), first, rtol=1e-9)
    np.testing.assert_allclose(jax.jit(jax.jacfwd(jax.jacrev(along)))(zero), second, rtol=1e-8)
    slope = jax.jit(jax.grad(lambda b: c @ solve_spd(A, b)))(b)
    np.testing.assert_allclose(slope, inverse @ c, rtol=1e-9)
