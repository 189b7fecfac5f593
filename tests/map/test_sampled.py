"""A map at the nodes of a grid: its own distance near surfaces, that to the nearest point elsewhere, FAR if it is empty."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.distance import cdist

from hrcjax.field import FAR, GridLayout, fit_grid, grid_distance, grid_nodes
from hrcjax.map import MapParams, View, empty_map, labelled_points, map_distance_and_gradient, sample_map
from hrcjax.sense import d435i

RATIO = MapParams().ratio
GRID = GridLayout((-0.3, -0.3, -0.15), (13, 13, 11), 0.05)


@pytest.fixture(scope="module")
def state(layout, points_program):
    """A floor and a post."""
    random = np.random.default_rng(0)
    floor = random.uniform([-0.5, -0.5, -0.12], [0.5, 0.5, -0.118], (3000, 3))
    angle, height = random.uniform(0, 2 * np.pi, 600), random.uniform(-0.1, 0.2, 600)
    post = np.stack([0.2 + 0.05 * np.cos(angle), 0.05 * np.sin(angle), height], axis=1)
    points = jnp.asarray(np.concatenate([floor, post]), jnp.float32)
    count = len(points)
    camera = d435i(jnp.asarray([0.0, -1.4, 1.4], jnp.float32), jnp.zeros(3, jnp.float32), 1)
    view = View(points, jnp.ones(count, bool), jnp.full(count, 1e-6, jnp.float32), jnp.zeros((4, 4), jnp.float32))
    return points_program(empty_map(layout), camera, view)[0]


@pytest.mark.parametrize("corrected", [True, False])
def test_near_the_map_itself_and_far_the_nearest_point(layout, state, corrected) -> None:
    sampled = np.asarray(sample_map(layout, state, RATIO, GRID, corrected)).reshape(-1)
    x = grid_nodes(GRID)
    nearest = cdist(np.asarray(x), labelled_points(state)[0]).min(axis=1)
    own, _ = jax.jit(
        lambda x: jax.lax.map(
            lambda p: map_distance_and_gradient(layout, state.levels, RATIO, p, corrected), x, batch_size=64
        )
    )(x)
    near, far = nearest < 0.0799, nearest > 0.1201
    assert min(near.sum(), far.sum(), (~near & ~far).sum()) > 100
    np.testing.assert_allclose(sampled[near], own[near], atol=2e-5)
    np.testing.assert_allclose(sampled[far], nearest[far], atol=1e-6)
    between = ~near & ~far
    low, high = np.minimum(own, nearest), np.maximum(own, nearest)
    assert np.all((sampled >= low - 2e-5) & (sampled <= high + 2e-5))
    assert np.any((sampled - low > 2e-4)[between] & (high - sampled > 2e-4)[between])


def test_floor_read_through_the_grid(layout, state) -> None:
    """The distance to a plane, within 3 mm, from a spacing of the grid on; no step where the nearest point takes over."""
    fine = GridLayout((-0.4, -0.4, -0.18), (24, 24, 18), 0.025)
    field = fit_grid(fine, sample_map(layout, state, RATIO, fine))
    z = np.linspace(-0.09, 0.05, 141)
    x = jnp.asarray(np.stack([0 * z - 0.2, 0 * z + 0.01, z], axis=1), jnp.float32)
    d = np.asarray(jax.jit(jax.vmap(grid_distance, in_axes=(None, 0)))(field, x))
    np.testing.assert_allclose(d, z + 0.119, atol=3e-3)
    np.testing.assert_allclose(np.diff(d), 1e-3, atol=1.5e-4)


def test_an_empty_map_is_far_everywhere(layout) -> None:
    np.testing.assert_array_equal(sample_map(layout, empty_map(layout), RATIO, GRID), np.full(GRID.shape, FAR))


def test_a_grid_far_from_all_points(layout, state) -> None:
    away = GridLayout((2.0, 2.0, 2.0), (4, 4, 4), 0.1)
    nearest = cdist(np.asarray(grid_nodes(away)), labelled_points(state)[0]).min(axis=1)
    np.testing.assert_allclose(sample_map(layout, state, RATIO, away), nearest.reshape(4, 4, 4), rtol=1e-6)
