"""Smoothness against closed forms (minimum jerk, sine, circle, clothoid) and independent NumPy code."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from hrcjax.metrics import (
    acceleration_variance,
    dimensionless_jerk,
    jerk_rms,
    log_dimensionless_jerk,
    mean_curvature_change,
    mean_squared_difference_jerk,
    mean_squared_jerk,
    spectral_arc_length,
    total_jerk,
)

# Compiled once a shape, not operation by operation.
acceleration_variance = jax.jit(acceleration_variance)
dimensionless_jerk = jax.jit(dimensionless_jerk)
jerk_rms = jax.jit(jerk_rms)
log_dimensionless_jerk = jax.jit(log_dimensionless_jerk)
mean_curvature_change = jax.jit(mean_curvature_change)
mean_squared_difference_jerk = jax.jit(mean_squared_difference_jerk)
mean_squared_jerk = jax.jit(mean_squared_jerk)
spectral_arc_length = jax.jit(spectral_arc_length, static_argnames="padding")
total_jerk = jax.jit(total_jerk)


def minimum_jerk(amplitude: float, duration: float, n: int, direction=(0.6, 0.0, -0.8)):
    """Positions of a straight minimum-jerk reach, and the rate."""
    t = np.linspace(0, 1, n)
    along = amplitude * (10 * t**3 - 15 * t**4 + 6 * t**5)
    return jnp.asarray(along[:, None] * np.asarray(direction)), (n - 1) / duration


RNG = np.random.default_rng(0)
X = RNG.normal(size=(40, 3))
MASK = np.arange(40) < 25


def test_forms_of_the_paper_against_numpy(dtype: jnp.dtype) -> None:
    """Whole and masked: the mask is the same as cutting the run."""
    x = jnp.asarray(X, dtype)
    for part, mask in ((X, None), (X[:25], jnp.asarray(MASK))):
        jerk = np.diff(part, n=3, axis=0)
        variance = acceleration_variance(x, mask)
        assert variance.dtype == dtype
        np.testing.assert_allclose(variance, np.var(np.diff(part, n=2, axis=0), axis=0), rtol=1e-5)
        np.testing.assert_allclose(total_jerk(x, mask), np.linalg.norm(jerk, axis=1).sum(), rtol=1e-5)
        np.testing.assert_allclose(mean_squared_difference_jerk(x, mask), np.mean(jerk**2), rtol=1e-5)


def test_forms_of_the_paper_depend_on_the_rate_and_the_others_do_not() -> None:
    """Half the rate of a slow sine: third differences grow by 8, SI jerk stays."""
    t = np.arange(0, 10, 0.005)
    x = jnp.asarray(np.stack([np.sin(t), 0 * t, 0 * t], axis=-1))
    np.testing.assert_allclose(mean_squared_difference_jerk(x[::2]) / mean_squared_difference_jerk(x), 64, rtol=0.01)
    np.testing.assert_allclose(total_jerk(x[::2]) / total_jerk(x), 4, rtol=0.01)
    np.testing.assert_allclose(mean_squared_jerk(x[::2], 100.0), mean_squared_jerk(x, 200.0), rtol=0.01)


def test_jerk_of_a_sine() -> None:
    """A sin(w t) along x and z: mean squared jerk A^2 w^6 / 2 each."""
    t = np.arange(4000) / 1000.0
    w, A = 2 * np.pi * 1.5, 0.2
    x = jnp.asarray(np.stack([A * np.sin(w * t), 0 * t, 2 * A * np.cos(w * t)], axis=-1))
    np.testing.assert_allclose(mean_squared_jerk(x, 1000.0), A**2 * w**6 / 2 * 5, rtol=2e-3)
    np.testing.assert_allclose(jerk_rms(x, 1000.0), np.sqrt(2.5) * A * w**3, rtol=1e-3)


@pytest.mark.parametrize(("amplitude", "duration"), [(0.5, 2.0), (2.0, 0.7)])
def test_minimum_jerk(amplitude: float, duration: float) -> None:
    """Integral of squared jerk 720 A^2/D^5, peak speed 1.875 A/D, so 204.8 whatever the size and the duration."""
    x, rate = minimum_jerk(amplitude, duration, 2001)
    np.testing.assert_allclose(mean_squared_jerk(x, rate), 720 * amplitude**2 / duration**6, rtol=5e-3)
    np.testing.assert_allclose(dimensionless_jerk(x, rate), 204.8, rtol=5e-3)
    np.testing.assert_allclose(log_dimensionless_jerk(x, rate), -np.log(204.8), rtol=1e-3)


def test_dimensionless_jerk_of_constant_jerk() -> None:
    """x = t^3 over 1 s in 8 steps: jerk 6, greatest speed of a step 8 - 7^3 / 8^2, with and without a mask."""
    x = jnp.asarray((np.arange(12) / 8.0)[:, None] ** 3 * np.array([1.0, 0.0, 0.0]))
    expected = 36 / (8 - 7**3 / 64) ** 2
    np.testing.assert_allclose(dimensionless_jerk(x[:9], 8.0), expected, rtol=1e-12)
    np.testing.assert_allclose(dimensionless_jerk(x, 8.0, jnp.arange(12) < 9), expected, rtol=1e-12)


def test_mask_cuts_the_run() -> None:
    x, rate = minimum_jerk(0.5, 2.0, 401)
    longer = jnp.concatenate([x, x[-1] + jnp.asarray(RNG.normal(size=(50, 3)))])
    mask = jnp.arange(451) < 401
    for measure in (mean_squared_jerk, dimensionless_jerk, log_dimensionless_jerk, mean_curvature_change):
        np.testing.assert_allclose(measure(longer, rate, mask), measure(x, rate), rtol=1e-9, atol=1e-12)


def test_rest_is_finite(dtype: jnp.dtype) -> None:
    """Nothing moves, or nothing counts: 0, with finite derivatives."""
    x = jnp.ones((12, 3), dtype)
    for mask in (None, jnp.zeros(12, bool)):
        for measure in (jerk_rms, dimensionless_jerk, log_dimensionless_jerk, mean_curvature_change):
            value, slope = jax.jit(jax.value_and_grad(lambda x, f=measure, m=mask: f(x, 25.0, m)))(x)
            assert value == 0 and value.dtype == dtype and jnp.all(jnp.isfinite(slope))
        value, slope = jax.jit(jax.value_and_grad(lambda x, m=mask: spectral_arc_length(x[:, 0] - 1, 25.0, m)))(x)
        assert value == 0 and jnp.all(jnp.isfinite(slope))


def numpy_sparc(speed, rate, cutoff=10.0, threshold=0.05, padding=4):
    """The authors' definition, written anew."""
    size = 2 ** (int(np.ceil(np.log2(len(speed)))) + padding)
    magnitude = np.abs(np.fft.fft(speed, size))
    magnitude = magnitude / magnitude.max()
    f = np.arange(size) * rate / size
    magnitude, f = magnitude[f <= cutoff], f[f <= cutoff]
    above = np.nonzero(magnitude >= threshold)[0]
    magnitude, f = magnitude[above[0] : above[-1] + 1], f[above[0] : above[-1] + 1]
    return -np.sum(np.sqrt((np.diff(f) / (f[-1] - f[0])) ** 2 + np.diff(magnitude) ** 2))


def test_spectral_arc_length_against_numpy(dtype: jnp.dtype) -> None:
    x, rate = minimum_jerk(0.5, 2.0, 101)
    speed = np.linalg.norm(np.diff(np.asarray(x), axis=0), axis=1) * rate
    rough = speed + 0.1 * np.sin(0.5 * np.arange(100)) + 0.1
    for one in (speed, rough):
        value = spectral_arc_length(jnp.asarray(one, dtype), jnp.asarray(rate, dtype))
        assert value.dtype == dtype
        np.testing.assert_allclose(value, numpy_sparc(one, rate), rtol=1e-4)
        low = spectral_arc_length(jnp.asarray(one, dtype), rate, cutoff=3.0, threshold=0.01, padding=2)
        np.testing.assert_allclose(low, numpy_sparc(one, rate, 3.0, 0.01, 2), rtol=1e-4)
    assert spectral_arc_length(jnp.asarray(rough), rate) < spectral_arc_length(jnp.asarray(speed), rate)
    np.testing.assert_allclose(spectral_arc_length(jnp.asarray(speed), rate), -1.41, atol=0.02)
    np.testing.assert_allclose(
        spectral_arc_length(jnp.asarray(rough), rate, jnp.arange(100) < 60),
        numpy_sparc(np.where(np.arange(100) < 60, rough, 0), rate),
        rtol=1e-9,
    )


def test_curvature_change() -> None:
    """A circle has none; a clothoid, curvature c s, run at speed v, has c v per second."""
    t = np.arange(2000) / 500.0
    circle = jnp.asarray(0.3 * np.stack([np.cos(t), np.sin(t), 0 * t], axis=-1))
    assert mean_curvature_change(circle, 500.0) < 1e-6
    c, v = 2.0, 0.5
    fine = np.linspace(0, t[-1] * v, 200001)
    step = fine[1] - fine[0]
    heading = c * fine**2 / 2
    path = np.stack([np.cumsum(np.cos(heading)), 0 * fine, np.cumsum(np.sin(heading))], axis=-1) * step
    clothoid = np.stack([np.interp(t * v, fine, path[:, i]) for i in range(3)], axis=-1)[::20]
    np.testing.assert_allclose(mean_curvature_change(jnp.asarray(clothoid), 25.0), c * v / 25, rtol=0.02)


def test_curvature_change_leaves_out_rest() -> None:
    """Standing still between two arcs of circles adds nothing; slower than the limit counts as standing."""
    t = np.arange(100) / 25.0
    arc = 0.3 * np.stack([np.cos(t), np.sin(t), 0 * t], axis=-1)
    rest = np.repeat(arc[-1:], 30, axis=0) + 1e-4 * RNG.normal(size=(30, 3))
    x = jnp.asarray(np.concatenate([arc, rest]))
    assert mean_curvature_change(jnp.asarray(arc), 25.0) < 1e-6
    assert mean_curvature_change(x, 25.0) < 0.3
    assert mean_curvature_change(x, 25.0, slowest=0.0) > 10
    assert mean_curvature_change(jnp.asarray(arc), 25.0, slowest=1.0) == 0


def test_derivatives() -> None:
    x = jnp.asarray(X[:12])
    for measure in (jerk_rms, log_dimensionless_jerk, mean_curvature_change):
        check_grads(jax.jit(lambda x, f=measure: f(x, 2.0)), (x,), order=1, modes=["rev"], rtol=1e-2)
    _known_slopes(x)
    speed = jnp.asarray(np.abs(X[:12, 0]) + 1)
    assert abs(jax.grad(lambda s: spectral_arc_length(s, 50.0))(speed) @ speed) < 1e-9, "its size does not count"
    check_grads(jax.jit(lambda s: spectral_arc_length(s, 50.0)), (speed,), order=1, modes=["rev"], rtol=1e-2)


def _known_slopes(x) -> None:
    """Of |D x| with the matrix D of third differences; and by Euler: x . slope is the degree times the value."""
    D = np.diff(np.eye(12), n=3, axis=0) * 2.0**3
    value = np.sqrt(((D @ x) ** 2).sum() / len(D))
    np.testing.assert_allclose(jax.grad(lambda x: jerk_rms(x, 2.0))(x), D.T @ (D @ x) / len(D) / value, rtol=1e-9)
    for measure, degree in ((jerk_rms, 1), (log_dimensionless_jerk, 0), (mean_curvature_change, -1)):
        value, slope = jax.value_and_grad(lambda x, f=measure: f(x, 2.0))(x)
        np.testing.assert_allclose(jnp.sum(x * slope), degree * value, rtol=1e-9, atol=1e-9)
