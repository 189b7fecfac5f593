"""Kernels against their textbook forms, and their inverses against scipy's Lambert W and round trips."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.special
from jax.test_util import check_grads

from hrcjax.field import MATERN12, MATERN32, SQUARED_EXPONENTIAL, rational_quadratic
from hrcjax.field.kernel import (
    ROOT_BLEND,
    blended_root,
    blended_root_slope,
    lambert_depth,
    raised_root,
    raised_root_slope,
)

TEXTBOOK = {
    SQUARED_EXPONENTIAL: lambda r: np.exp(-(r**2) / 2),
    rational_quadratic(50.0): lambda r: (1 + r**2 / 100) ** -50.0,
    rational_quadratic(2.0): lambda r: (1 + r**2 / 4) ** -2.0,
    MATERN12: lambda r: np.exp(-r),
    MATERN32: lambda r: (1 + np.sqrt(3) * r) * np.exp(-np.sqrt(3) * r),
}
kernels = pytest.mark.parametrize("kernel", TEXTBOOK, ids=lambda k: k.name)


@kernels
def test_textbook(kernel, dtype):
    r = np.concatenate([[0.0], np.geomspace(1e-6, 12, 60)])
    log_k = kernel.log(jnp.asarray(r**2, dtype))
    assert log_k.dtype == dtype
    np.testing.assert_allclose(np.exp(log_k), TEXTBOOK[kernel](r), rtol=3e-5 if dtype == "float32" else 1e-9)


@kernels
def test_inverse_round_trip(kernel, dtype):
    r = np.geomspace(ROOT_BLEND * 1.05, 2000, 80)
    back = kernel.distance(kernel.log(jnp.asarray(r**2, dtype)))
    assert back.dtype == dtype
    np.testing.assert_allclose(back, r, rtol=3e-6 if dtype == "float32" else 1e-7)


@kernels
def test_derivative_of_inverse(kernel):
    """Slope of the inverse is the inverse of the slope, by differences of the textbook form."""
    inverse_slope = jax.jit(jax.grad(kernel.distance))
    for r in (0.3, 0.7, 1.5, 5.0):
        h = 1e-5
        slope = (np.log(TEXTBOOK[kernel](r + h)) - np.log(TEXTBOOK[kernel](r - h))) / (2 * h)
        got = inverse_slope(jnp.asarray(np.log(TEXTBOOK[kernel](r))))
        np.testing.assert_allclose(got, 1 / slope, rtol=1e-6)


@kernels
def test_surface_is_finite(kernel, dtype):
    """At and above the occupancy 1 the distance is 0 with slope 0; derivatives of both parts are finite everywhere."""
    slope = jax.grad(kernel.distance)
    inverse = jax.jit(jax.vmap(lambda y: (kernel.distance(y), slope(y), jax.grad(slope)(y))))
    d, first, _ = inverse(jnp.asarray([0.0, 1e-12, 0.1, 3.0], dtype))
    assert np.all(d == 0) and np.all(first == 0)
    log_o = [-1e-30, -1e-12, -1e-6, -0.01, -0.019, -0.0201, -0.04, -0.0799, -0.0801, -0.1, -5.0, -100.0]
    log_o += [] if kernel.name.startswith("rational") else [-1e6]  # which reaches -100 at 1e11 length scales, b = 2
    assert np.all(np.isfinite(inverse(jnp.asarray(log_o, dtype))))
    log = jax.jit(jax.vmap(lambda v: (kernel.log(v), jax.grad(kernel.log)(v))))
    assert np.all(np.isfinite(log(jnp.asarray([0.0, 1e-30, 1e-8, 1.0, 1e6], dtype))))


@kernels
def test_distance_rises(kernel):
    d = np.asarray(kernel.distance(-jnp.asarray(np.geomspace(1e-6, 50, 400))))
    assert np.all(np.diff(d) > 0)


def test_lambert_w(dtype):
    """-1 - W(-exp(-1 - y)), branch -1, from scipy, where scipy does not underflow; beyond, the equation itself."""
    y = np.concatenate([np.linspace(0.0201, 0.0799, 20), np.linspace(0.0801, 5, 40), np.geomspace(5, 600, 20)])
    oracle = -1 - scipy.special.lambertw(-np.exp(-1 - y), -1).real
    tolerance = 1e-6 if dtype == "float32" else 2e-8
    np.testing.assert_allclose(lambert_depth(jnp.asarray(y, dtype)), oracle, rtol=tolerance)
    t = np.asarray(lambert_depth(jnp.asarray([1e3, 1e5, 1e8], dtype)), float)
    np.testing.assert_allclose(t - np.log1p(t), [1e3, 1e5, 1e8], rtol=1e-6)
    check_grads(
        lambda y: lambert_depth(jnp.asarray(y)),
        (jnp.asarray([0.03, 0.07, 0.09, 0.5, 4.0, 90.0]),),
        2,
        eps=1e-5,
        rtol=1e-5,
    )


def test_blended_root():
    b = ROOT_BLEND**2
    v = jnp.asarray(np.linspace(0, 3 * b, 301))
    root = np.asarray(blended_root(v))
    assert np.all(root <= np.sqrt(v) + 1e-15) and np.all(np.diff(root) > 0)
    np.testing.assert_allclose(root[101:], np.sqrt(v[101:]), rtol=1e-14)
    for side in (1 - 1e-9, 1 + 1e-9):  # value and slope meet
        np.testing.assert_allclose(blended_root(jnp.asarray(b * side)), ROOT_BLEND, rtol=1e-8)
        np.testing.assert_allclose(jax.grad(blended_root)(jnp.asarray(b * side)), 0.5 / ROOT_BLEND, rtol=1e-8)
    every = jnp.asarray([-1.0, -1e-9, 1e-9, 0.3 * b, 0.99 * b, 1.01 * b, 1.0, 1e8])
    np.testing.assert_allclose(blended_root_slope(every), jax.vmap(jax.grad(blended_root))(every), rtol=1e-13)
    assert blended_root_slope(jnp.asarray(0.0)) == 0 == blended_root(jnp.asarray(-1.0))
    np.testing.assert_allclose(blended_root_slope(jnp.asarray(1e-12)), 1.5 / ROOT_BLEND, rtol=1e-6)


def test_rational_quadratic_is_cached_and_checked():
    assert rational_quadratic(60.0) is rational_quadratic(60.0)
    with pytest.raises(ValueError, match="must be positive"):
        rational_quadratic(0.0)


def test_raised_root_is_the_root_and_never_0() -> None:
    v = jnp.concatenate([-jnp.geomspace(10.0, 1e-6, 40), jnp.geomspace(1e-6, 1e15, 100)])
    root, slope = raised_root(v), jax.vmap(jax.grad(raised_root))(v)
    np.testing.assert_allclose(root[v > 0.1], np.sqrt(v[v > 0.1]), rtol=5e-3)
    assert (root > 0).all() and (slope > 0).all() and (jnp.diff(root) > 0).all()
    np.testing.assert_allclose(raised_root_slope(v), slope, rtol=1e-4)
    np.testing.assert_allclose(raised_root(jnp.asarray(0.0)), 0.1, rtol=1e-5)
