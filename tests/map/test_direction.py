"""Directions next to surfaces: of a board that is seen from above, of a ball that is seen from all around."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import MapParams, View, empty_map, map_distance_and_gradient, map_distances_and_gradients
from hrcjax.sense import d435i

RATIO = MapParams().ratio
CENTRE, RADIUS = np.array([0.0, 0.0, 0.25]), 0.15


@pytest.fixture(scope="module")
def levels(layout, points_program):
    """2 mm of noise; the ball's two halves from two sides, the board from above."""
    random = np.random.default_rng(0)
    way = random.normal(size=(6000, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    board = np.concatenate([random.uniform(-0.55, 0.55, (6000, 2)), np.full((6000, 1), -0.1)], axis=1)
    ball = CENTRE + RADIUS * way
    state = empty_map(layout)
    seen = (
        (board, [0.1, 0.0, 1.5]),
        (ball[way[:, 0] > 0.1], [1.5, 0.0, 0.4]),
        (ball[way[:, 0] < -0.1], [-1.5, 0.1, 0.4]),
    )
    for points, eye in seen:
        points = np.resize(points, (6000, 3)) + random.normal(scale=0.002, size=(6000, 3))
        view = View(
            jnp.asarray(points, jnp.float32),
            jnp.ones(6000, bool),
            jnp.full(6000, 4e-6),
            jnp.full((1, 1), 1e-3, jnp.float32),
        )
        camera = d435i(jnp.asarray(eye, jnp.float32), jnp.asarray(CENTRE, jnp.float32), 1)
        state, report = points_program(state, camera, view)
        assert int(report.lost) == 0
    return state.levels


@pytest.fixture(scope="module")
def read(layout, levels):
    return jax.jit(lambda x: map_distances_and_gradients(layout, levels, RATIO, x))


@pytest.mark.parametrize("off", [-0.004, -0.001, 0.0, 0.002, 0.005])
def test_it_is_the_normal_on_the_side_of_the_sensor(read, off: float) -> None:
    """On both sides of the noisy points, where the derivative of the distance points to either side."""
    random = np.random.default_rng(1)
    flat = np.concatenate([random.uniform(-0.4, 0.4, (200, 2)), np.full((200, 1), -0.1 + off)], axis=1)
    way = random.normal(size=(400, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    way = way[np.abs(way[:, 0]) > 0.3][:200]
    x = np.concatenate([flat, CENTRE + (RADIUS + off) * way]).astype(np.float32)
    normal = np.concatenate([np.tile([0, 0, 1.0], (200, 1)), way])
    g = np.asarray(read(x)[1])
    cosine = np.sum(g * normal, axis=1) / np.linalg.norm(g, axis=1)
    assert np.mean(cosine) > 0.97 and np.mean(cosine > 0.9) > 0.97
    assert np.mean(np.abs(np.linalg.norm(g, axis=1) - 1.0) < 0.2) > 0.9


def test_farther_away_it_is_the_derivative(layout, levels, read) -> None:
    x = np.random.default_rng(2).uniform([-0.4, -0.4, -0.08], [0.4, 0.4, 0.6], (100, 3)).astype(np.float32)
    derivative = jax.jit(lambda x: map_distances_and_gradients(layout, levels, RATIO, x, oriented=False))
    d, g = (np.asarray(v) for v in read(x))
    plain, slope = (np.asarray(v) for v in derivative(x))
    far = d > 0.9 * RATIO * 0.025
    assert far.sum() > 80
    np.testing.assert_allclose(d, plain, atol=1e-5)
    np.testing.assert_allclose(g[far], slope[far], atol=1e-4)


def test_it_is_continuous_and_has_derivatives(layout, levels) -> None:
    """Along a line through the board."""
    z = np.linspace(-0.13, -0.07, 601)
    x = np.stack([np.full(601, 0.103), np.full(601, -0.207), z], axis=1).astype(np.float32)
    one = jax.jit(jax.vmap(lambda x: map_distance_and_gradient(layout, levels, RATIO, x)[1]))
    g = np.asarray(one(x))
    assert np.abs(np.diff(g, axis=0)).max() < 0.05
    slope = jax.jit(jax.vmap(jax.jacfwd(lambda x: map_distance_and_gradient(layout, levels, RATIO, x)[1])))(x[::20])
    assert np.isfinite(slope).all()


def test_a_view_from_nowhere_tells_no_side(layout, points_program) -> None:
    """A cloud whose sensor is not known sees through nothing."""
    points = jnp.asarray(np.random.default_rng(0).uniform([-0.3, -0.3, 0], [0.3, 0.3, 0.001], (6000, 3)), jnp.float32)
    camera = d435i(jnp.asarray([0.0, 0.0, 1.5], jnp.float32), jnp.asarray([0.01, 0.0, 0.0], jnp.float32), 1)
    for depth, told in ((0.0, False), (1e-3, True)):
        view = View(points, jnp.ones(6000, bool), jnp.full(6000, 4e-6), jnp.full((1, 1), depth, jnp.float32))
        state, _ = points_program(empty_map(layout), camera, view)
        rows, toward = np.asarray(state.levels[0].rows), np.moveaxis(np.asarray(state.levels[0].toward), 1, 2)
        there = rows[:, 3] > 0
        assert there.sum() > 400 and not toward[~there].any()
        assert (toward[there][:, 2] > 100).all() if told else not toward.any()


def test_where_nothing_is_mapped_there_is_no_direction(layout) -> None:
    read = jax.jit(lambda x: map_distance_and_gradient(layout, empty_map(layout).levels, RATIO, x))
    _, g = read(jnp.asarray([0.1, 0.0, 0.2], jnp.float32))
    assert not np.any(g)
