"""Scalars written out, against NumPy; constants must vanish, and angles keep their derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from hrcjax.robot import unrolled as u


def test_vectors_against_numpy():
    rng = np.random.default_rng(0)
    a, b, c = rng.normal(size=(3, 3))
    A, B = rng.normal(size=(2, 3, 3))
    v, w, x = (u.constant_vector(k) for k in (a, b, c))
    np.testing.assert_allclose(u.add(v, w, x), a + b + c)
    np.testing.assert_allclose(u.scale(2.5, v), 2.5 * a)
    np.testing.assert_allclose(u.dot(v, w), a @ b)
    np.testing.assert_allclose(u.cross(v, w), np.cross(a, b))
    np.testing.assert_allclose(u.apply(u.constant_matrix(A), v), A @ a)
    np.testing.assert_allclose(u.product(u.constant_matrix(A), u.constant_matrix(B)), A @ B)
    np.testing.assert_allclose(u.transpose(u.constant_matrix(A)), A.T)
    np.testing.assert_allclose(u.turn(0.6, 0.8, v), [0.6 * a[0] - 0.8 * a[1], 0.8 * a[0] + 0.6 * a[1], a[2]])
    np.testing.assert_allclose(u.apply(u.spin(v, w), x), np.cross(b, c) + np.cross(a, np.cross(a, c)))


@pytest.mark.parametrize("k", [0.0, 1.0, -1.0, 2.0])
def test_constants_beside_arrays(k):
    x = jnp.asarray(3.0)
    for value, expected in [
        (u.times(k, x), 3 * k),
        (u.times(x, k), 3 * k),
        (u.plus(k, x), 3 + k),
        (u.plus(x, k), 3 + k),
        (u.minus(k, x), k - 3),
        (u.minus(x, k), 3 - k),
    ]:
        assert float(value) == expected


def test_zeros_and_ones_cost_nothing():
    x = jnp.asarray(3.0)
    assert u.times(0.0, x) == 0.0
    assert isinstance(u.times(x, 0.0), float)
    assert u.times(1.0, x) is x
    assert u.plus(0.0, x, 0.0) is x
    assert u.minus(x, 0.0) is x


def test_cos_sin(dtype):
    angles = jnp.linspace(-7, 7, 29).astype(dtype)
    c, s = jax.vmap(u.cos_sin)(angles)
    tight = 4 * jnp.finfo(dtype).eps
    np.testing.assert_allclose(c, np.cos(np.asarray(angles, np.float64)), atol=tight)
    np.testing.assert_allclose(s, np.sin(np.asarray(angles, np.float64)), atol=tight)
    assert c.dtype == s.dtype == dtype


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, np.pi, -2.1])
def test_cos_sin_derivatives(angle):
    check_grads(u.cos_sin, (jnp.asarray(angle),), order=2, modes=("fwd", "rev"))


def test_as_array_follows_the_dtype(dtype):
    out = u.as_array([1.0, jnp.asarray(2.0, dtype), 0.0, 4.0], (2, 2), dtype)
    assert out.dtype == dtype
    assert out.tolist() == [[1, 2], [0, 4]]
