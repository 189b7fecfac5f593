"""The sensor's errors: their size, where the holes are, and what is invalid."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.sense.camera import d435i
from hrcjax.sense.noise import NoiseParams, depth_deviation, measure, shadow

PARAMS = NoiseParams()
_measure = jax.jit(measure)


def _camera(decimation=4, dtype=jnp.float64):
    return d435i(jnp.asarray([0.0, 0.0, 1.0], dtype), jnp.zeros(3, dtype), decimation)


@pytest.mark.parametrize(("z", "millimetres"), [(0.5, 1.0), (1.0, 4.2), (1.5, 9.3), (2.0, 16.6), (3.0, 37.4)])
@pytest.mark.parametrize("decimation", [1, 4])
def test_deviation_is_the_sensors_whatever_the_decimation(z, millimetres, decimation):
    assert float(depth_deviation(jnp.asarray(z), PARAMS)) * 1000 == pytest.approx(millimetres, abs=0.06)
    camera = _camera(decimation)
    measured = _measure(jnp.full((camera.height, camera.width), z), camera, jax.random.key(0), PARAMS)
    measured = np.asarray(measured)[:, 20:]
    assert (measured > 0).all()
    expected = np.hypot(millimetres, 1 / np.sqrt(12))
    assert measured.std() * 1000 == pytest.approx(expected, rel=0.04)
    assert measured.mean() == pytest.approx(z, abs=2e-3)


def test_rounding_and_its_derivative(dtype):
    camera = _camera(16, dtype)
    exact = jnp.full((camera.height, camera.width), 1.2345, dtype)
    measured = _measure(exact, camera, jax.random.key(1), PARAMS)
    assert measured.dtype == dtype
    steps = np.asarray(measured, float) / 0.001
    np.testing.assert_allclose(steps, np.round(steps), atol=2e-3)
    quiet = NoiseParams(subpixel=0.0)
    slope = jax.grad(lambda z: jnp.sum(measure(exact * 0 + z, camera, jax.random.key(1), quiet)))(1.2345)
    assert float(slope) == pytest.approx(camera.width * camera.height)


@pytest.mark.parametrize("depth", [0.2, 7.0, np.inf, np.nan])
def test_out_of_range_is_zero(depth):
    camera = _camera(16)
    measured = _measure(jnp.full((camera.height, camera.width), depth), camera, jax.random.key(0), PARAMS)
    np.testing.assert_array_equal(measured, 0)


def _board(camera, near=0.6, far=1.8):
    image = np.full((camera.height, camera.width), far)
    image[30:90, 60:100] = near
    return image


def test_shadow_lies_left_of_a_near_board_and_is_as_wide_as_the_disparity():
    camera = _camera()
    hidden = np.asarray(shadow(jnp.asarray(_board(camera)), camera, PARAMS))
    assert not hidden[:, 60:].any() and not hidden[:30].any() and not hidden[90:].any()
    width = 96.25 * 0.05 * (1 / 0.6 - 1 / 1.8)  # 5.3 pixels
    assert hidden[60].sum() == int(width)
    assert hidden[60, 60 - int(width) : 60].all()
    quiet = NoiseParams(subpixel=0.0, flying=1e-12)
    measured = np.asarray(_measure(jnp.asarray(_board(camera)), camera, jax.random.key(0), quiet))
    np.testing.assert_array_equal(measured == 0, hidden)


def test_flying_pixels_are_between_and_at_edges_only():
    camera = _camera()
    image = _board(camera)
    quiet = NoiseParams(subpixel=0.0)
    measured = np.asarray(_measure(jnp.asarray(image), camera, jax.random.key(3), quiet))
    flies = (np.abs(measured - image) > 2e-3) & (measured > 0)
    edge = np.zeros_like(flies)
    edge[29:91, 59:101] = True
    edge[31:89, 61:99] = False
    assert not flies[~edge].any()
    seen = edge & (measured > 0)
    assert flies.sum() / seen.sum() == pytest.approx(0.25, abs=0.08)
    between = measured[flies]
    assert between.min() >= 0.6 and between.max() <= 1.8
    assert between.min() < 0.8 and between.max() > 1.6  # over all of the gap


def test_keys_matter_and_repeat():
    camera = _camera(16)
    exact = jnp.full((camera.height, camera.width), 1.0)
    one, two = (_measure(exact, camera, jax.random.key(k), PARAMS) for k in (0, 1))
    assert not np.array_equal(one, two)
    np.testing.assert_array_equal(one, _measure(exact, camera, jax.random.key(0), PARAMS))
