import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads

from hrcjax.geom.bending_energy import bending_energy

energy = jax.jit(bending_energy)
slope = jax.jit(jax.value_and_grad(bending_energy))


def arc(radius, angle, count):
    t = np.linspace(0, angle, count)
    return jnp.asarray(np.stack([radius * np.cos(t), radius * np.sin(t), 0 * t], axis=1))


@pytest.mark.parametrize("radius", [0.1, 3.0])
@pytest.mark.parametrize("angle", [2 * np.pi, 1.0])
def test_arc_converges_with_the_square_of_the_spacing(radius, angle):
    errors = [float(energy(arc(radius, angle, n))) * radius / angle - 1 for n in (17, 33, 65)]
    assert abs(errors[-1]) < 5e-4
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4, rtol=0.02)


def test_helix():
    """Radius a, pitch 2 pi b: curvature a / (a^2 + b^2)."""
    t = np.linspace(0, 5, 400)
    w = jnp.asarray(np.stack([0.3 * np.cos(t), 0.3 * np.sin(t), 0.2 * t], axis=1))
    k, speed = 0.3 / 0.13, np.sqrt(0.13)
    np.testing.assert_allclose(energy(w), k**2 * speed * 5, rtol=1e-4)


def test_uneven_spacing_converges():
    t = np.linspace(0, 1, 400) ** 1.5 * 2
    w = jnp.asarray(np.stack([np.cos(t), np.sin(t), 0 * t], axis=1))
    np.testing.assert_allclose(energy(w), 2, rtol=1e-3)


def test_one_corner():
    """Three points: the turn of 90 degrees over the mean segment, held over the whole path."""
    w = jnp.asarray([[0.0, 0, 0], [1, 0, 0], [1, 3, 0]])
    np.testing.assert_allclose(energy(w), 2 / 2**2 * 4, rtol=1e-12)


def test_straight_line_has_none(dtype):
    w = jnp.asarray(np.linspace([0, 0, 0], [1, 2, 3], 20), dtype)
    value, gradient = slope(w)
    assert value.dtype == dtype
    np.testing.assert_allclose(value, 0, atol=1e-8)
    assert np.isfinite(gradient).all()


@pytest.mark.parametrize("where", [0, 7, 16])
def test_repeated_waypoints_change_nothing(where, dtype):
    w = arc(0.5, 2.0, 17).astype(dtype)
    twice = jnp.concatenate([w[:where], w[where : where + 1], w[where : where + 1], w[where:]])
    np.testing.assert_allclose(energy(twice), energy(w), rtol=1e-5)
    assert np.isfinite(slope(twice)[1]).all()


def test_all_waypoints_coincide(dtype):
    w = jnp.ones((5, 3), dtype)
    value, gradient = slope(w)
    assert float(value) == 0.0 and np.isfinite(gradient).all()


def test_derivatives():
    w = arc(0.4, 2.0, 9) + 0.01 * np.random.default_rng(0).normal(size=(9, 3))
    check_grads(energy, (w,), order=2, modes=["fwd", "rev"], rtol=1e-3, atol=1e-3)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.floats(0.1, 10))
def test_scales_with_the_inverse_size_and_ignores_motion(seed, size):
    draw = np.random.default_rng(seed)
    w = np.cumsum(draw.normal(size=(12, 3)), axis=0)
    turn = np.linalg.qr(draw.normal(size=(3, 3)))[0]
    base = float(energy(jnp.asarray(w)))
    np.testing.assert_allclose(energy(jnp.asarray(size * w @ turn + 5)), base / size, rtol=1e-8)
    np.testing.assert_allclose(energy(jnp.asarray(w[::-1].copy())), base, rtol=1e-8)


def test_two_waypoints_are_refused():
    with pytest.raises(ValueError, match="3 or more"):
        bending_energy(jnp.zeros((2, 3)))
