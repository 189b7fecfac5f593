"""Masked sums, differences and resampling."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.metrics import resample
from hrcjax.metrics.samples import difference_mask, differences, masked_max, masked_mean, masked_min

# Compiled once a shape, not operation by operation.
resample = jax.jit(resample, static_argnames="count")


def test_masked() -> None:
    x, mask = jnp.array([1.0, 2.0, 30.0, -7.0]), jnp.array([True, True, False, False])
    assert masked_mean(x, mask) == 1.5 and masked_mean(x) == 6.5
    assert masked_max(x, mask) == 2 and masked_max(x) == 30
    assert masked_min(x, mask) == 1 and masked_min(x) == -7
    none = jnp.zeros(4, bool)
    assert masked_mean(x, none) == 0 and masked_max(x, none) == -jnp.inf and masked_min(x, none) == jnp.inf


def test_a_difference_counts_where_all_its_samples_do() -> None:
    mask = jnp.array([True, True, True, True, False, True, True])
    np.testing.assert_array_equal(difference_mask(mask, 3), [True, False, False, False])
    np.testing.assert_array_equal(difference_mask(mask, 1), [True, True, True, False, False, True])
    assert difference_mask(None, 3) is None
    assert differences(jnp.arange(12.0).reshape(4, 3) ** 2, 3).shape == (1, 3)
    with pytest.raises(ValueError, match="at least 4"):
        differences(jnp.zeros((3, 3)), 3)


def test_resampling_is_exact_for_cubics(dtype: jnp.dtype) -> None:
    """Up and down, at the ends too; samples beyond the end repeat the last."""

    def cubic(t):
        return np.stack([1 - t + 2 * t**2 - t**3, 3 * t, t**3], axis=-1)

    x = jnp.asarray(cubic(np.arange(11) / 10), dtype)
    for rate in (25.0, 7.0, 10.0):
        count = int(rate) + 1
        got = resample(x, 10.0, rate, count)
        assert got.dtype == dtype
        tolerance = 1e-5 if dtype == jnp.float32 else 1e-10
        np.testing.assert_allclose(got, cubic(np.arange(count) / rate), atol=tolerance)
    np.testing.assert_allclose(resample(x, 10.0, 10.0, 14)[10:], jnp.broadcast_to(x[10], (4, 3)), atol=1e-5)
    with pytest.raises(ValueError, match="at least 4"):
        resample(x[:3], 1.0, 1.0, 3)


def test_resampling_is_linear_in_the_samples() -> None:
    x = jnp.asarray(np.random.default_rng(0).normal(size=(9, 2)))
    J = jax.jit(jax.jacobian(lambda x: resample(x, 8.0, 5.0, 5)[:, 0]))(x)
    np.testing.assert_allclose(jnp.einsum("stn,tn->s", J, x), resample(x, 8.0, 5.0, 5)[:, 0], atol=1e-12)
