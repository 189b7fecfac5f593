"""Queries far away, or not finite, among others."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import MapParams, View, empty_map, map_distance_and_gradient, map_distances_and_gradients
from hrcjax.sense import d435i

RATIO = MapParams().ratio


@pytest.fixture(scope="module")
def levels(layout, points_program):
    """A floor."""
    points = np.random.default_rng(0).uniform([-0.5, -0.5, -0.12], [0.5, 0.5, -0.1], (2000, 3))
    camera = d435i(jnp.asarray([0.0, -1.4, 1.4], jnp.float32), jnp.zeros(3, jnp.float32), 1)
    count = len(points)
    view = View(
        jnp.asarray(points, jnp.float32),
        jnp.ones(count, bool),
        jnp.full(count, 1e-6, jnp.float32),
        jnp.zeros((4, 4), jnp.float32),
    )
    return points_program(empty_map(layout), camera, view)[0].levels


@pytest.fixture(scope="module")
def both(layout, levels):
    """Queries -> distances and gradients read together, and each alone."""
    together = jax.jit(lambda x: map_distances_and_gradients(layout, levels, RATIO, x))
    alone = jax.jit(jax.vmap(lambda p: map_distance_and_gradient(layout, levels, RATIO, p)))
    return lambda x: (*map(np.asarray, together(x)), *map(np.asarray, alone(x)))


@pytest.mark.parametrize(
    "far", [[50.0, 50.0, 1.0], [0.0, 0.0, 1e4], [-1e6, 1e6, 1.0], [1e10, 0, 0], [np.nan] * 3, [0, np.inf, 0]]
)
@pytest.mark.parametrize(("low", "high"), [([-1, -1, 1], [1, 1, 2]), ([-0.2, -0.2, 1.8], [0.2, 0.2, 2.2]), ([-0.3, -0.3, 0], [0, 0, 0.3])])  # fmt: skip
def test_one_query_does_not_spoil_those_that_share_its_group(both, far, low, high) -> None:
    x = np.random.default_rng(1).uniform(low, high, (32, 3)).astype(np.float32)
    x[5] = far
    d, g, alone, slope = both(x)
    near = np.arange(32) != 5
    np.testing.assert_allclose(d[near], alone[near], atol=2e-5)
    np.testing.assert_allclose(g[near], slope[near], atol=1e-3)
    if np.isfinite(far).all():
        assert np.isfinite(d[5]) and d[5] > 10
    else:
        assert np.isnan(d[5]) and np.isnan(g[5]).all()


@pytest.mark.parametrize("away", [100.0, 800.0])
def test_a_group_that_is_far_away_reads_as_each_alone(both, away) -> None:
    x = np.random.default_rng(2).uniform([-1, -1, away], [1, 1, away + 1], (32, 3)).astype(np.float32)
    d, g, alone, slope = both(x)
    np.testing.assert_allclose(d, alone, rtol=1e-6)
    np.testing.assert_allclose(g, slope, atol=1e-3)


@pytest.mark.parametrize("away", [1e4, 1e6, 1e10])
def test_very_far_away_the_distance_is_that_to_the_floor(both, away) -> None:
    x = np.tile(np.asarray([[0.0, 0.0, away]], np.float32), (32, 1))
    d, g, _, _ = both(x)
    np.testing.assert_allclose(d, away, rtol=1e-3)
    np.testing.assert_allclose(np.abs(g[:, 2]), 1.0, atol=1e-3)


def test_few_queries_that_are_not_finite_have_no_distance(both) -> None:
    d, g, _, _ = both(np.asarray([[0, 0, 0.1], [np.inf, 0, 0], [0, np.nan, 0]], np.float32))
    assert np.isfinite(d[0]) and np.isfinite(g[0]).all() and np.isnan(d[1:]).all() and np.isnan(g[1:]).all()
