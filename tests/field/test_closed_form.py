"""The one-pass distance, gradient and Hessian against autodiff of the definition."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads
from samples import cloud, sphere

from hrcjax.field import MATERN32, FieldParams, distance, distance_and_gradient, fit, hessian

FIELD = fit(cloud(sphere(60, 0.1, (1.0, 0.5, -0.4)), missing=2), FieldParams(0.03, 0.02))
SIGNED = fit(cloud(sphere(60, 0.1, (1.0, 0.5, -0.4)), missing=2), FieldParams(0.03, 0.02), solver="cholesky")
PLACES = jnp.asarray(
    sphere(6, 0.1003, (1, 0.5, -0.4)).tolist() + sphere(6, 0.2, (1, 0.5, -0.4)).tolist() + [[3.0, 3, 1]]
)


@pytest.mark.parametrize("field", [FIELD, SIGNED], ids=["lumped", "exact"])
def test_same_as_autodiff(field):
    def both(x):
        definition = jax.value_and_grad(distance, argnums=1)(field, x)
        second = jax.hessian(distance, argnums=1)(field, x)
        back = jax.jacrev(lambda at: distance_and_gradient(field, at)[1])(x)
        first = jax.grad(lambda at: distance_and_gradient(field, at)[0])(x)
        return definition, distance_and_gradient(field, x), second, hessian(field, x), back, first

    (d, g), (d1, g1), H, H1, H2, g2 = jax.jit(jax.vmap(both))(PLACES)
    np.testing.assert_allclose(d1, d, rtol=1e-10, atol=1e-14)
    for one in (g1, g2):
        np.testing.assert_allclose(one, g, rtol=1e-8, atol=1e-10)
    for one in (H1, H2):
        np.testing.assert_allclose(one, H, rtol=1e-7, atol=1e-7 * np.abs(H).max())
    assert np.any(d[:6] < 0.006) and np.all(d[6:] > 0.05)


def test_single_precision():
    """Digits survive a cloud 1 m from the origin, at 1 cm and at 3 m."""
    low = jax.tree.map(lambda a: a.astype(jnp.float32) if a.dtype == jnp.float64 else a, FIELD)
    x = np.asarray([[1.11, 0.5, -0.4], [1.0, 0.5, -0.25], [3.0, 2.5, 0.6]])
    d, g = jax.vmap(lambda at: distance_and_gradient(low, at))(jnp.asarray(x, jnp.float32))
    d64, g64 = jax.vmap(lambda at: distance_and_gradient(FIELD, at))(jnp.asarray(x))
    assert d.dtype == g.dtype == jnp.float32
    np.testing.assert_allclose(d, d64, atol=2e-5)
    np.testing.assert_allclose(g, g64, atol=2e-4)


@pytest.mark.slow
def test_derivatives_of_the_gradient():
    """Second order through the closed form: query and length scale, forward and reverse, against differences."""

    def f(x, length_scale):
        d, g = distance_and_gradient(fit(cloud(sphere(20, 0.1)), FieldParams(length_scale, 0.02)), jnp.asarray(x))
        return d + g[0] * g[2]

    check_grads(f, (jnp.asarray([0.05, 0.12, 0.03]), jnp.asarray(0.04)), 1, eps=1e-6, rtol=1e-5)


def test_other_kernels_fall_back():
    field = fit(cloud(sphere(20, 0.1)), FieldParams(0.05), MATERN32)
    x = jnp.asarray([0.05, 0.12, 0.03])
    d, g = distance_and_gradient(field, x)
    want = jax.value_and_grad(distance, argnums=1)(field, x)
    np.testing.assert_allclose(d, want[0])
    np.testing.assert_allclose(g, want[1])
