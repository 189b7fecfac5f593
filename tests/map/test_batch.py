"""Many queries at once give what each of them gives alone."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import (
    MapParams,
    View,
    batch,
    empty_map,
    map_distance_and_gradient,
    map_distances_and_gradients,
)
from hrcjax.sense import d435i

RATIO = MapParams().ratio


@pytest.fixture(scope="module")
def levels(layout, points_program):
    """A wavy floor and a post."""
    random = np.random.default_rng(0)
    floor = random.uniform([-0.5, -0.5, -0.12], [0.5, 0.5, -0.1], (3000, 3))
    floor[:, 2] += 0.03 * np.sin(8 * floor[:, 0])
    angle, height = random.uniform(0, 2 * np.pi, 600), random.uniform(-0.1, 0.4, 600)
    post = np.stack([0.2 + 0.05 * np.cos(angle), 0.05 * np.sin(angle), height], axis=1)
    points = jnp.asarray(np.concatenate([floor, post]), jnp.float32)
    count = len(points)
    camera = d435i(jnp.asarray([0.0, -1.4, 1.4], jnp.float32), jnp.zeros(3, jnp.float32), 1)
    view = View(points, jnp.ones(count, bool), jnp.full(count, 1e-6, jnp.float32), jnp.zeros((4, 4), jnp.float32))
    state, report = points_program(empty_map(layout), camera, view)
    assert int(report.lost) == int(report.outside) == int(report.waiting) == 0
    return state.levels


@pytest.mark.parametrize("correct", [False, True])
@pytest.mark.parametrize("count", [9, 1000])
def test_many_are_as_each_alone(layout, levels, count, correct) -> None:
    """Near and far, in dense groups and scattered ones, and beside a query that is not a number."""
    random = np.random.default_rng(count)
    dense = random.uniform([0.1, -0.1, -0.1], [0.35, 0.15, 0.2], (count // 2, 3))
    scattered = random.uniform([-0.9, -0.9, -0.3], [0.9, 0.9, 1.5], (count - count // 2, 3))
    x = np.concatenate([dense, scattered]).astype(np.float32)
    x[count // 3] = np.nan
    single = lambda p: map_distance_and_gradient(layout, levels, RATIO, p, correct)  # noqa: E731
    expected, slope = jax.jit(lambda x: jax.lax.map(single, x, batch_size=64))(x)
    d, g = jax.jit(lambda x: map_distances_and_gradients(layout, levels, RATIO, x, correct))(x)
    known = np.arange(count) != count // 3
    assert not np.isfinite(d[~known]).any() and np.isfinite(d[known]).all()
    np.testing.assert_allclose(d[known], expected[known], atol=2e-5)
    np.testing.assert_allclose(g[known], slope[known], atol=0.01)
    assert np.median(np.abs(g[known] - slope[known])) < 1e-5


@pytest.mark.parametrize("blocks", [1, 6])
def test_a_group_for_which_its_blocks_do_not_suffice_is_read_one_by_one(layout, levels, monkeypatch, blocks) -> None:
    monkeypatch.setattr(batch, "GROUP_BLOCKS", blocks)
    x = np.random.default_rng(2).uniform([-0.1, -0.2, -0.05], [0.5, 0.2, 0.3], (160, 3)).astype(np.float32)
    d, g = jax.jit(lambda x: map_distances_and_gradients(layout, levels, RATIO, x))(x)
    alone, slope = jax.jit(jax.vmap(lambda p: map_distance_and_gradient(layout, levels, RATIO, p)))(x)
    np.testing.assert_allclose(d, alone, atol=2e-5)
    np.testing.assert_allclose(g, slope, atol=0.01)


def test_empty_map_has_no_distance(layout) -> None:
    x = np.random.default_rng(0).uniform(-0.5, 0.5, (100, 3)).astype(np.float32)
    d, g = map_distances_and_gradients(layout, empty_map(layout).levels, RATIO, jnp.asarray(x))
    expected, _ = map_distance_and_gradient(layout, empty_map(layout).levels, RATIO, jnp.asarray(x[0]))
    np.testing.assert_array_equal(d, np.full(100, expected))
    np.testing.assert_array_equal(g, np.zeros((100, 3)))


@pytest.mark.parametrize("far", [1e4, 1e6])
def test_a_query_far_away_does_not_spoil_those_that_share_its_group(layout, levels, far) -> None:
    random = np.random.default_rng(1)
    x = random.uniform([-1.0, -1.0, 1.0], [1.0, 1.0, 2.0], (32, 3)).astype(np.float32)
    x[5] = [far, far, 1.0]
    d, g = jax.jit(lambda x: map_distances_and_gradients(layout, levels, RATIO, x))(x)
    alone, slope = jax.jit(jax.vmap(lambda p: map_distance_and_gradient(layout, levels, RATIO, p)))(x)
    near = np.arange(32) != 5
    np.testing.assert_allclose(d[near], alone[near], atol=1e-4)
    np.testing.assert_allclose(g[near], slope[near], atol=1e-3)
