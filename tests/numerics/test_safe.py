import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_divide, safe_norm, safe_sqrt, unit


def test_values_agree_with_numpy(dtype):
    x = jnp.asarray([[3.0, 4.0, 12.0], [0.1, -0.2, 0.2]], dtype)
    np.testing.assert_allclose(safe_norm(x), [13.0, 0.3], rtol=1e-6)
    np.testing.assert_allclose(unit(x), np.asarray(x) / np.array([[13.0], [0.3]]), rtol=1e-6)
    np.testing.assert_allclose(safe_sqrt(x[0]), np.sqrt([3.0, 4.0, 12.0]), rtol=1e-6)
    np.testing.assert_allclose(safe_divide(x[0], x[1]), [30.0, -20.0, 60.0], rtol=1e-6)
    assert safe_norm(x).dtype == dtype


def test_singular_points_are_zero_with_zero_derivative(dtype):
    zero = jnp.zeros(3, dtype)
    assert safe_norm(zero) == 0
    np.testing.assert_array_equal(jax.grad(safe_norm)(zero), 0)
    np.testing.assert_array_equal(jax.hessian(safe_norm)(zero), 0)
    np.testing.assert_array_equal(unit(zero), 0)
    np.testing.assert_array_equal(jax.jacfwd(unit)(zero), 0)
    assert safe_sqrt(jnp.asarray(-1.0, dtype)) == 0
    assert jax.grad(safe_sqrt)(jnp.asarray(0.0, dtype)) == 0
    assert safe_divide(jnp.asarray(1.0, dtype), jnp.asarray(0.0, dtype), 7.0) == 7
    assert jax.grad(safe_divide, argnums=1)(jnp.asarray(1.0, dtype), jnp.asarray(0.0, dtype)) == 0


def test_derivatives_elsewhere_are_the_true_ones():
    x, size = jnp.asarray([0.3, -0.4, 1.2]), 1.3
    u = np.asarray(x) / size
    across = (np.eye(3) - np.outer(u, u)) / size
    np.testing.assert_allclose(jax.grad(safe_norm)(x), u, rtol=1e-12)
    np.testing.assert_allclose(jax.hessian(safe_norm)(x), across, rtol=1e-12, atol=1e-15)
    for derivative in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(derivative(unit)(x), across, rtol=1e-12, atol=1e-15)
    a, b = 0.3, -0.4

    def ratio(v):
        return safe_divide(v[0], v[1])

    np.testing.assert_allclose(jax.grad(ratio)(x[:2]), [1 / b, -a / b**2], rtol=1e-12)
    np.testing.assert_allclose(jax.hessian(ratio)(x[:2]), [[0, -1 / b**2], [-1 / b**2, 2 * a / b**3]], rtol=1e-12)
    np.testing.assert_allclose(jax.grad(safe_sqrt)(x[0]), 0.5 / np.sqrt(0.3), rtol=1e-12)


def test_nan_stays_nan():
    """A speed that is not a number must not read as standing still."""
    assert np.isnan(safe_sqrt(jnp.asarray(jnp.nan))) and np.isnan(safe_norm(jnp.asarray([0.0, jnp.nan])))
