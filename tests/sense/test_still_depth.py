"""The depth of what is held still: what flies, is missing or was not used plays no part, and an edge is where it is."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.sense.finger_pixels import MEAN_LOSS
from hrcjax.sense.noise import NoiseParams
from hrcjax.sense.still_depth import still_depth


def test_what_flies_and_what_is_missing_is_left_out() -> None:
    images = np.array([2.0, 2.02, 2.01, 3.5, 0.0, 1.0], np.float32)[:, None, None]
    depth, count = still_depth(jnp.asarray(images), jnp.asarray([True] * 5 + [False]))
    assert float(depth[0, 0]) == pytest.approx(2.01, abs=1e-4) and float(count[0, 0]) == 3
    few, _ = still_depth(jnp.asarray(images), jnp.asarray([False] * 3 + [True, True, False]))
    assert float(few[0, 0]) == 3.5
    none, count = still_depth(jnp.asarray(0 * images), jnp.ones(6, bool))
    assert float(none[0, 0]) == 0.0 and float(count[0, 0]) == 0


def test_at_an_edge_it_is_less_biased_than_a_median_and_its_spread_is_told() -> None:
    """Of nine depths at 2 m one in four flies behind; noise as the camera's."""
    sigma = 2.0**2 * NoiseParams().subpixel / (NoiseParams().focal * NoiseParams().baseline)
    random, shape = np.random.default_rng(0), (9, 60, 60)
    flies = random.uniform(size=shape) < 0.25
    images = 2.0 + np.where(flies, random.uniform(0.0, 1.0, shape), 0.0) + sigma * random.normal(size=shape)
    depth, count = (np.asarray(a) for a in jax.jit(still_depth)(jnp.asarray(images, jnp.float32), jnp.ones(9, bool)))
    good = np.abs(depth - 2.0) < 6 * sigma
    assert good.mean() > 0.97
    assert abs(depth[good].mean() - 2.0) < 0.3 * abs(np.median(images, axis=0)[good].mean() - 2.0)
    low, high = np.percentile((depth - 2.0) * np.sqrt(count / MEAN_LOSS) / sigma, [16, 84])
    assert high - low == pytest.approx(2.0, rel=0.15)
