import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.plan.hinge import hinge
from hrcjax.plan.stored import stored


def test_it_is_half_the_square_of_a_violation_and_0_otherwise():
    e = 1e-3
    value, push, held = hinge(jnp.asarray([-0.02, 0.01, jnp.inf, -1.0]), e)
    np.testing.assert_allclose(value, [0.0002 + e * e / 6, 0, 0, 0.5 + e * e / 6], rtol=1e-12)
    np.testing.assert_allclose(push, [0.02, 0, 0, 1], rtol=1e-12)
    np.testing.assert_array_equal(held, [1, 0, 0, 1])


def test_derivatives_are_those_of_its_value():
    e = 1e-3
    spare = jnp.linspace(-3e-3, 3e-3, 61)

    def value(s):
        return hinge(s, e)[0]

    np.testing.assert_allclose(-jax.vmap(jax.grad(value))(spare), hinge(spare, e)[1], atol=1e-15)
    away = jnp.asarray([-2e-3, -0.7e-3, 0.2e-3, 2e-3])
    np.testing.assert_allclose(jax.vmap(jax.grad(jax.grad(value)))(away), hinge(away, e)[2], atol=1e-12)


def test_stored_is_the_identity(dtype):
    x = jnp.asarray([0.0, -1.5, 3e4], dtype)
    np.testing.assert_array_equal(stored(x), x)
    np.testing.assert_array_equal(jax.vmap(jax.grad(stored))(x), jnp.ones(3))
    np.testing.assert_array_equal(jax.grad(lambda x: jnp.sum(jax.jvp(stored, (x,), (x,))[1]))(x), jnp.ones(3))
