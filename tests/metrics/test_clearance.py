"""Smallest distances and times in zones."""

import jax.numpy as jnp
import numpy as np

from hrcjax.metrics import min_clearance, time_below, time_in_zones

D = np.array([0.5, 0.2, 0.3, -0.1, 0.9])
MASK = jnp.array([True, True, True, False, True])


def test_min_clearance(dtype: jnp.dtype) -> None:
    d = jnp.asarray(D, dtype)
    assert min_clearance(d) == jnp.asarray(-0.1, dtype) and min_clearance(d).dtype == dtype
    assert min_clearance(d, MASK) == jnp.asarray(0.2, dtype)


def test_time_below(dtype: jnp.dtype) -> None:
    d = jnp.asarray(D, dtype)
    np.testing.assert_allclose(time_below(d, 0.3, 0.25), 0.5)
    np.testing.assert_allclose(time_below(d, 0.3, 0.25, MASK), 0.25)
    assert time_below(d, 0.3, 0.25).dtype == dtype
    assert time_below(d, jnp.asarray([0.6, 0.1, 0.1, 0.1, 0.1], dtype), 0.25) == 0.5


def test_time_in_zones(dtype: jnp.dtype) -> None:
    zone = jnp.asarray([0, 0, 1, 3, 3, 3, 2, 0, 0, 0], jnp.int32)
    times = time_in_zones(zone, jnp.asarray(0.5, dtype))
    assert times.dtype == dtype
    np.testing.assert_array_equal(times, [2.5, 0.5, 0.5, 1.5])
    np.testing.assert_array_equal(time_in_zones(zone, 0.5, jnp.arange(10) < 5), [1.0, 0.5, 0.0, 1.0])
