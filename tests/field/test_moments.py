"""The hand-written derivative of the kernel sums against autodiff of their definition, and the sums against NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.field.moments import kernel_moments, kernel_moments_plain


def arguments(dtype=np.float64, sets=2, n=9):
    rng = np.random.default_rng(3)
    mask = rng.uniform(size=n) < 0.7
    weights = rng.normal(size=(n, sets)) * mask[:, None]
    x, points = rng.normal(size=3) * 0.1, rng.normal(size=(n, 3)) * 0.1
    args = [jnp.asarray(a, dtype) for a in (x, points, weights)]
    return args[0], args[1], jnp.asarray(mask), args[2], jnp.asarray(40.0, dtype)


def test_sums(dtype):
    x, points, mask, weights, precision = arguments(dtype)
    nearest, sums, firsts = kernel_moments(x, points, mask, weights, precision)
    r2 = np.sum((np.asarray(points, float) - np.asarray(x, float)) ** 2, axis=1)
    assert nearest.dtype == sums.dtype == firsts.dtype == dtype
    np.testing.assert_allclose(nearest, r2[np.asarray(mask)].min(), rtol=1e-6)
    k = np.exp(-40.0 * r2) * np.asarray(mask)
    w = np.asarray(weights, float)
    scale = np.exp(-40.0 * float(nearest))
    tolerance = 1e-5 if dtype == "float32" else 1e-12
    np.testing.assert_allclose(np.asarray(sums) * scale, w.T @ k, rtol=tolerance)
    np.testing.assert_allclose(np.asarray(firsts) * scale, w.T @ (k[:, None] * np.asarray(points)), rtol=tolerance)


def test_far_terms_do_not_underflow_to_slow_numbers():
    """Terms under e^-60 of the largest are cut off, those above are not."""
    points = jnp.asarray([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    weights = jnp.eye(3)
    _, sums, _ = kernel_moments(jnp.zeros(3), points, jnp.ones(3, bool), weights, jnp.asarray(50.0))
    np.testing.assert_allclose(np.log(sums), [0.0, -50.0, -60.0])


@pytest.mark.parametrize("moved", ["x", "points", "weights", "precision", "all"])
def test_derivative(moved):
    x, points, mask, weights, precision = arguments()
    start = {"x": x, "points": points, "weights": weights, "precision": precision}
    chosen = start if moved == "all" else {moved: start[moved]}
    rng = np.random.default_rng(4)
    direction = {name: jnp.asarray(rng.normal(size=value.shape)) for name, value in chosen.items()}

    def call(f, change):
        a = {**start, **change}
        return f(a["x"], a["points"], mask, a["weights"], a["precision"])[1:]

    ours = jax.jit(lambda c, v: jax.jvp(lambda c: call(kernel_moments, c), (c,), (v,))[1])(chosen, direction)
    definition = jax.jit(lambda c, v: jax.jvp(lambda c: call(kernel_moments_plain, c), (c,), (v,))[1])(
        chosen, direction
    )
    for a, b in zip(ours, definition, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-12)
    back = [
        jax.jit(jax.grad(lambda c, f=f: sum(jnp.sum(jnp.sin(out)) for out in call(f, c))))(chosen)
        for f in (kernel_moments, kernel_moments_plain)
    ]
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12), *back)
