import jax
import jax.numpy as jnp
import numpy as np
from jax.test_util import check_grads

from hrcjax.plan import band

band_solve, band_product = jax.jit(band.band_solve), jax.jit(band.band_product)


def system(count, dtype=jnp.float64, seed=0):
    draw = np.random.default_rng(seed)
    diagonal = draw.normal(size=(count, 3, 3))
    off = draw.normal(size=(count - 1, 3, 3))
    diagonal = diagonal @ diagonal.transpose(0, 2, 1) + 9 * np.eye(3)
    off = (off + off.transpose(0, 2, 1)) / 2
    b = draw.normal(size=(count, 3))
    return tuple(jnp.asarray(x, dtype) for x in (diagonal, off, 0.7, b))


def dense(diagonal, off, far):
    count = diagonal.shape[0]
    A = np.zeros((count, 3, count, 3))
    for j in range(count):
        A[j, :, j, :] = diagonal[j]
    for j in range(count - 1):
        A[j, :, j + 1, :] = A[j + 1, :, j, :] = off[j]
    for j in range(count - 2):
        A[j, :, j + 2, :] = A[j + 2, :, j, :] = far * np.eye(3)
    return A.reshape(3 * count, 3 * count)


def test_agrees_with_the_dense_solve(dtype):
    diagonal, off, far, b = system(9, dtype)
    A = dense(*(np.asarray(x, float) for x in (diagonal, off, far)))
    x, flat = band_solve(diagonal, off, far, b), np.asarray(b, float).ravel()
    assert x.dtype == dtype
    np.testing.assert_allclose(x.ravel(), np.linalg.solve(A, flat), atol=1e-5 if dtype == "float32" else 1e-12)
    np.testing.assert_allclose(band_product(diagonal, off, far, b).ravel(), A @ flat, rtol=1e-4)


def test_derivatives_and_batches():
    args = system(5)

    @jax.jit
    def solve(far, scale, b):
        return band_solve(args[0] * scale, args[1], far, b)

    check_grads(solve, (args[2], jnp.asarray(1.3), args[3]), order=1, modes=["fwd", "rev"], rtol=1e-5)
    many = jnp.stack([args[3], 2 * args[3]])
    np.testing.assert_allclose(jax.vmap(lambda b: band_solve(*args[:3], b))(many)[1], 2 * band_solve(*args), rtol=1e-10)
