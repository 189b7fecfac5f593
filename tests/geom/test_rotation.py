"""Rotations against scipy, and the small-angle series against high precision."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hrcjax.geom.rotation import look_at, rotation_rpy, rotation_vector, rotation_z, skew

angles = st.floats(-3.0, 3.0)
_look_jacobian = jax.jit(jax.jacobian(lambda e: look_at(e, jnp.zeros_like(e))))
_jacobian = jax.jacfwd(rotation_vector)
_second = jax.jit(lambda v: (_jacobian(v), jax.jacfwd(_jacobian)(v)))
_rpy, _vector, _z = jax.jit(rotation_rpy), jax.jit(rotation_vector), jax.jit(rotation_z)


@settings(max_examples=30, deadline=None)
@given(angles, angles, angles)
def test_roll_pitch_yaw_and_vector_agree_with_scipy(a, b, c):
    np.testing.assert_allclose(_rpy(a, b, c), Rotation.from_euler("xyz", [a, b, c]).as_matrix(), atol=1e-12)
    v = np.array([a, b, c])
    np.testing.assert_allclose(_vector(jnp.asarray(v)), Rotation.from_rotvec(v).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(_z(a), Rotation.from_euler("z", a).as_matrix(), atol=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-6, 9.9e-3, 1.01e-2, 0.3])
def test_rotation_vector_is_smooth_at_zero(size, dtype):
    v = np.array([0.6, -0.48, 0.64]) * size
    R = _vector(jnp.asarray(v, dtype))
    assert R.dtype == dtype
    tight = 1e-13 if dtype == jnp.float64 else 2e-6
    np.testing.assert_allclose(R, Rotation.from_rotvec(v).as_matrix(), atol=tight, rtol=0)
    value, second = _second(jnp.asarray(v))
    for axis in range(3):
        e = np.eye(3)[axis] * 1e-4
        first = (_vector(jnp.asarray(v + e)) - _vector(jnp.asarray(v - e))) / 2e-4
        np.testing.assert_allclose(value[..., axis], first, atol=1e-7)
        slope = (_second(jnp.asarray(v + e))[0] - _second(jnp.asarray(v - e))[0]) / 2e-4
        np.testing.assert_allclose(second[..., axis], slope, atol=1e-6)


def test_rotation_vector_differentiates_to_the_cross_product():
    w = jnp.asarray([0.2, -0.5, 0.9])
    turned = jax.jvp(lambda v: rotation_vector(v) @ w, (jnp.zeros(3),), (jnp.asarray([1.0, 2.0, 3.0]),))[1]
    np.testing.assert_allclose(turned, np.cross([1.0, 2.0, 3.0], w), atol=1e-12)
    np.testing.assert_allclose(skew(jnp.asarray([1.0, 2.0, 3.0])) @ w, np.cross([1.0, 2.0, 3.0], w), atol=1e-12)


def test_look_at_has_the_camera_axes():
    R = look_at(jnp.asarray([0.0, -2.0, 0.0]), jnp.zeros(3))
    np.testing.assert_allclose(R[:, 2], [0, 1, 0], atol=1e-12)  # forward to the target
    np.testing.assert_allclose(R[:, 0], [1, 0, 0], atol=1e-12)  # right
    np.testing.assert_allclose(R[:, 1], [0, 0, -1], atol=1e-12)  # down
    sideways = look_at(jnp.asarray([0.0, -2.0, 0.0]), jnp.zeros(3), up=jnp.asarray([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(sideways[:, 1], [-1, 0, 0], atol=1e-12)


@pytest.mark.parametrize("eye", [(0.3, 0.2, 1.5), (0.0, 0.0, 2.0), (0.0, 0.0, -1.0), (1e-9, 0.0, 1.0)])
def test_look_at_is_a_rotation_even_along_the_vertical(eye, dtype):
    R = jax.jit(look_at)(jnp.asarray(eye, dtype), jnp.zeros(3, dtype))
    assert R.dtype == dtype
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=3e-6)
    assert np.linalg.det(R) == pytest.approx(1, abs=3e-6)
    assert np.isfinite(_look_jacobian(jnp.asarray(eye, dtype))).all()
