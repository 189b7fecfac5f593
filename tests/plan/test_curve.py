import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from hrcjax.geom.resample import resample_path as resample_
from hrcjax.plan import path_curve as path_curve_
from hrcjax.plan.curve import equally_spaced

path_curve, resample = jax.jit(path_curve_), jax.jit(resample_, static_argnums=1)
point = jax.jit(lambda c, s: c.point(s))
tangent = jax.jit(lambda c, s: c.tangent(s))
curvature = jax.jit(lambda c, s: c.curvature(s))

T = np.linspace(0, 2, 24)
ARC = np.stack([0.4 * np.cos(T), 0.4 * np.sin(T), 0.1 * T], axis=1)


def test_is_the_natural_cubic_spline():
    w = np.cumsum(np.random.default_rng(0).normal(size=(7, 3)), axis=0)
    curve, oracle = path_curve(jnp.asarray(w)), CubicSpline(np.arange(7), w, bc_type="natural")
    L = float(curve.length)
    for u in (0.0, 0.3, 2.0, 3.99, 5.5, 6.0):
        np.testing.assert_allclose(point(curve, u / 6 * L), oracle(u), atol=1e-12)
        np.testing.assert_allclose(tangent(curve, u / 6 * L), oracle(u, 1) * 6 / L, atol=1e-12)
        np.testing.assert_allclose(curvature(curve, u / 6 * L), oracle(u, 2) * 36 / L**2, atol=1e-10)


def test_length_and_curvature_of_a_helix():
    curve = path_curve(jnp.asarray(ARC))
    np.testing.assert_allclose(curve.length, np.hypot(0.4, 0.1) * 2, rtol=1e-3)
    k = 0.4 / (0.4**2 + 0.1**2)
    np.testing.assert_allclose(np.linalg.norm(curvature(curve, 0.5 * curve.length)), k, rtol=0.02)


def test_speed_is_one_within_a_percent(dtype):
    curve = path_curve(jnp.asarray(resample(jnp.asarray(ARC), 24), dtype))
    s = jnp.linspace(0, 1, 301, dtype=dtype) * curve.length
    speed = np.linalg.norm(jax.vmap(lambda s: tangent(curve, s))(s), axis=1)
    assert speed.dtype == dtype
    assert abs(speed - 1).max() < 0.01


def test_tangent_and_curvature_are_derivatives_and_ends_hold():
    curve = path_curve(jnp.asarray(ARC))
    s = 0.37 * curve.length
    np.testing.assert_allclose(jax.jacfwd(lambda s: point(curve, s))(s), tangent(curve, s), rtol=1e-10)
    np.testing.assert_allclose(jax.jacfwd(lambda s: tangent(curve, s))(s), curvature(curve, s), rtol=1e-9)
    np.testing.assert_allclose(point(curve, -1.0), ARC[0], atol=1e-12)
    np.testing.assert_allclose(point(curve, curve.length + 1), ARC[-1], atol=1e-12)
    np.testing.assert_allclose(curvature(curve, curve.length), 0, atol=1e-9)


def test_equal_spacing_slides_points_along_the_curve():
    uneven = T + 0.03 * np.sin(3 * T) * T * (2 - T)
    w = jnp.asarray(np.stack([0.4 * np.cos(uneven), 0.4 * np.sin(uneven), 0 * T], axis=1))
    out = np.asarray(jax.jit(equally_spaced)(w))
    steps = np.linalg.norm(np.diff(out, axis=0), axis=1)
    before = np.linalg.norm(np.diff(w, axis=0), axis=1)
    assert before.std() / before.mean() > 0.05 and steps.std() / steps.mean() < 0.005
    np.testing.assert_allclose(np.linalg.norm(out, axis=1), 0.4, rtol=5e-5)
    np.testing.assert_array_equal(out[[0, -1]], w[jnp.asarray([0, -1])])


def test_coincident_waypoints_are_finite():
    curve, pull = jax.vjp(lambda w: point(path_curve(w), 0.0), jnp.ones((5, 3)))
    np.testing.assert_allclose(curve, 1)
    assert np.isfinite(pull(jnp.ones(3))[0]).all()


def test_two_waypoints_are_refused():
    with pytest.raises(ValueError, match="3 or more"):
        path_curve(jnp.zeros((2, 3)))
