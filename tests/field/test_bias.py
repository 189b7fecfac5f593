"""The law of over-estimation against fields of sampled spheres and cylinders, and its inverse against scipy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize
from samples import cloud, cylinder, sphere

from hrcjax.field import FieldParams, convex_bias, distance, fit, lower_bound


@pytest.mark.parametrize(("radius", "scale", "count"), [(0.1, 0.031, 300), (0.3, 0.06, 400), (0.04, 0.031, 100)])
def test_sphere(radius, scale, count):
    """Within 0.1 mm where l < R / 3; where l is near R the law is above the reading, by less than 1 mm."""
    field = fit(cloud(sphere(count, radius)), FieldParams(scale), solver="cholesky")
    d = np.asarray([0.02, 0.05, 0.1, 0.3])
    read = np.asarray(jax.vmap(lambda x: distance(field, x))(jnp.asarray((radius + d)[:, None] * [0.36, -0.48, 0.8])))
    law = d + np.asarray(jax.vmap(lambda d: convex_bias(d, radius, scale))(jnp.asarray(d)))
    if scale < radius / 2:
        np.testing.assert_allclose(read, law, atol=1e-4)
    else:
        assert np.all(law > read) and np.all(law < read + 1e-3)
    assert np.all(read > d + 0.004)
    bound = np.asarray(jax.vmap(lambda d: lower_bound(d, radius, scale))(jnp.asarray(read)))
    assert np.all(bound < d + 1e-4) and np.all(bound > d - 2e-3)


def test_cylinder_is_bounded_by_the_sphere():
    field = fit(cloud(cylinder(0.04, 0.0155, 0.15)), FieldParams(0.031))
    for d in (0.02, 0.05, 0.1):
        read = distance(field, jnp.asarray([0.04 + d, 0.0, 0.0]))
        assert d + 0.003 < read < d + convex_bias(jnp.asarray(d), 0.04, 0.031)
        assert d - 0.01 < lower_bound(read, 0.04, 0.031) < d


def test_figures_of_the_law(dtype):
    """R = 4 cm at 5 cm, by hand: sqrt(0.0025 + 2 l^2 ln 2.25) - 0.05."""
    for scale in (0.031, 0.071):
        got = convex_bias(jnp.asarray(0.05, dtype), 0.04, scale)
        np.testing.assert_allclose(got, np.sqrt(0.0025 + 2 * scale**2 * np.log(2.25)) - 0.05, rtol=1e-5)
        assert got.dtype == dtype
    assert convex_bias(jnp.asarray(0.0, dtype), 0.04, 0.031) == 0


@pytest.mark.parametrize(("radius", "scale"), [(0.04, 0.031), (0.04, 0.2), (0.3, 0.01), (1e-3, 0.05), (0.05, 0.0)])
def test_lower_bound_inverts_the_law(radius, scale, dtype):
    readings = np.asarray([1e-4, 1e-3, 0.01, 0.05, 0.3, 3.0])
    got = jax.jit(jax.vmap(lambda d: lower_bound(d, radius, scale)))(jnp.asarray(readings, dtype))
    want = [
        scipy.optimize.brentq(lambda d, r=r: d * d + 2 * scale**2 * np.log1p(d / radius) - r * r, 0, r, xtol=1e-16)
        for r in readings
    ]
    np.testing.assert_allclose(got, want, rtol=2e-4 if dtype == "float32" else 1e-9, atol=1e-8)
    assert got.dtype == dtype


def test_lower_bound_at_zero(dtype):
    for d_hat in (0.0, -0.01):
        d, slope = jax.value_and_grad(lower_bound)(jnp.asarray(d_hat, dtype), 0.04, 0.031)
        assert d == 0 and np.isfinite(slope)
    assert np.isfinite(jax.grad(lower_bound)(jnp.asarray(0.0, dtype), 0.04, 0.0))
    assert np.isfinite(jax.grad(convex_bias)(jnp.asarray(0.0, dtype), 0.04, 0.031))


def test_derivatives_are_those_of_the_law():
    """d^2 + 2 l^2 ln(1 + d/R) = r^2, differentiated by r, R and l."""
    R, scale = 0.04, 0.031
    for reading in (0.01, 0.08):
        d, got = jax.jit(jax.value_and_grad(lower_bound, argnums=(0, 1, 2)))(*map(jnp.asarray, (reading, R, scale)))
        whole = d + scale**2 / (R + d)
        want = reading, scale**2 * d / (R * (R + d)), -2 * scale * np.log1p(d / R)
        np.testing.assert_allclose(got, np.array(want) / whole, rtol=1e-8)
