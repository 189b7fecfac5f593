"""The lower bound of the distance against the exact distance of a scene that no constant was chosen on."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import MapLayout, MapParams, View, distance_and_deviation, distance_bound, empty_map, fuse
from hrcjax.sense import NoiseParams, d435i
from hrcjax.sense.camera import render_scene
from hrcjax.sense.noise import measure
from hrcjax.world.scene import BOX, COLUMN, SPHERE, scene_distance
from hrcjax.world.scenes import Obstacle, make_scene

pytestmark = pytest.mark.slow

RATIO = MapParams().ratio


@pytest.fixture(scope="module")
def scene():
    solids = [
        Obstacle(BOX, (-0.2, 0.1, 0.08), (0.07, 0.05, 0.08), 0.4, 0.1),
        Obstacle(COLUMN, (0.15, -0.1, 0.1), (0.04, 0.04, 0.1), 0.0, 0.1),
        Obstacle(SPHERE, (0.15, 0.2, 0.07), (0.07, 0.07, 0.07), 0.0, 0.1),
    ]
    return make_scene(solids, (0.0,) * 3, (0.1,) * 3, (0.0,) * 3, (1.0,) * 3)


@pytest.fixture(scope="module")
def state(layout, program, scene):
    """The scene from twelve places round about."""

    @jax.jit
    def look(eye, key):
        camera = d435i(eye, jnp.asarray([0.0, 0.05, 0.05], jnp.float32), 1)
        return camera, measure(render_scene(camera, scene), camera, key, NoiseParams())

    state = empty_map(layout)
    for k in range(12):
        eye = jnp.asarray([0.9 * np.cos(k / 2), 0.9 * np.sin(k / 2), 0.9 - 0.05 * k], jnp.float32)
        state, _ = program(state, *look(eye, jax.random.key(k)))
    return state


@pytest.fixture(scope="module")
def measured(layout, state, scene):
    """Queries within 20 cm of surfaces: exact distance, the map's, its deviation, its bound [m]."""
    x = np.random.default_rng(0).uniform([-0.35, -0.35, 0.0], [0.35, 0.35, 0.4], (3000, 3)).astype(np.float32)
    truth = np.asarray(jax.jit(jax.vmap(lambda x: scene_distance(scene, x)))(x))
    near = (truth > 0) & (truth < 0.2)
    program = jax.jit(
        lambda x: jax.lax.map(
            lambda x: (*distance_and_deviation(layout, state, RATIO, x), distance_bound(layout, state, RATIO, x)),
            x,
            batch_size=64,
        )
    )
    return truth[near], *(np.asarray(v) for v in program(x[near]))


def test_distance_is_right_to_some_millimetres(measured) -> None:
    truth, d, _, _ = measured
    assert np.sqrt(np.mean((d - truth) ** 2)) < 0.005


def test_bound_of_95_per_cent_holds_about_as_often(measured) -> None:
    truth, d, deviation, bound = measured
    assert 0.93 <= np.mean(bound <= truth) <= 0.99
    assert np.percentile(bound - truth, 99) < 0.003
    np.testing.assert_allclose(bound, np.maximum(d - 1.645 * deviation, 0), atol=1e-6)


def test_deviation_is_larger_far_away_and_derivatives_are_finite(layout, state) -> None:
    place = jnp.asarray([[0.0, -0.25, 0.05], [0.0, 0.0, 0.5], [0.0, 0.0, 2.5], [-0.13, 0.1, 0.08]], jnp.float32)
    deviation = jax.jit(jax.vmap(lambda x: distance_and_deviation(layout, state, RATIO, x)[1]))(place)
    assert float(deviation[0]) < 0.004 < float(deviation[1]) < float(deviation[2])
    slope = jax.jit(jax.vmap(jax.grad(lambda x: distance_bound(layout, state, RATIO, x))))(place)
    assert np.isfinite(slope).all()


def test_bound_holds_over_a_small_thing_that_coarse_levels_take_for_part_of_the_floor() -> None:
    layout, params = MapLayout(), MapParams(near=0.0, far=20.0)
    a, b = np.arange(-1.95, 1.95, 0.025), np.arange(-0.05, 0.05, 0.02) + 0.2
    floor = np.stack([*np.meshgrid(a, a), np.full((a.size, a.size), 0.02)], axis=-1).reshape(-1, 3)
    lamp = np.stack(np.meshgrid(b, b, b + 0.15), axis=-1).reshape(-1, 3)
    x = jnp.asarray(np.concatenate([floor, lamp]), jnp.float32)
    view = View(x, jnp.ones(len(x), bool), jnp.full(len(x), 1e-6, jnp.float32), jnp.zeros((1, 1), jnp.float32))
    camera = d435i(jnp.asarray([0.0, 0.0, 3.5], jnp.float32), jnp.asarray([0.01, 0.0, 0.0], jnp.float32), 1)
    take = jax.jit(lambda state: fuse(layout, params, state, camera, view))
    state = empty_map(layout)
    for _ in range(12):
        state, report = take(state)
    assert int(report.waiting) == int(report.unseen) == 0
    way = np.random.default_rng(1).normal(size=(300, 3))
    way = way[way[:, 2] > 0.75 * np.linalg.norm(way, axis=1)]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    x = np.concatenate([[0.2, 0.2, 0.35] + r * way for r in (0.5, 0.9, 1.3, 1.8)]).astype(np.float32)
    truth = np.linalg.norm(np.concatenate([floor, lamp])[None] - x[:, None], axis=2).min(axis=1)
    both = jax.jit(lambda x: jax.lax.map(lambda x: distance_bound(layout, state, RATIO, x), x, batch_size=64))
    bound = np.asarray(both(x))
    assert np.mean(bound <= truth) > 0.95
    assert np.median(truth - bound) < 0.15


def test_deviation_is_larger_at_edges_and_in_hollows_than_on_a_plane(layout, points_program) -> None:
    """A step of 15 cm: its upper edge, the corner at its foot, the floor before it."""
    a, b = np.arange(-0.4, 0.4, 0.0237), np.arange(0.0, 0.15, 0.0237)
    floor = np.stack([*np.meshgrid(a[a > 0], a), np.zeros(((a > 0).sum(), a.size)).T], axis=-1).reshape(-1, 3)
    top = np.stack([*np.meshgrid(a[a < 0], a), np.full(((a < 0).sum(), a.size), 0.15).T], axis=-1).reshape(-1, 3)
    wall = np.stack(np.meshgrid([0.0], a, b), axis=-1).reshape(-1, 3)
    x = jnp.asarray(np.concatenate([floor, top, wall]) + np.array([0.011, 0.0, 0.007]), jnp.float32)
    view = View(x, jnp.ones(len(x), bool), jnp.full(len(x), 1e-8, jnp.float32), jnp.zeros((4, 4), jnp.float32))
    camera = d435i(jnp.asarray([1.0, 0.0, 1.4], jnp.float32), jnp.zeros(3, jnp.float32), 1)
    state = empty_map(layout)
    for _ in range(3):
        state, report = points_program(state, camera, view)
    assert int(report.waiting) == 0
    place = jnp.asarray([[0.3, 0.1, 0.07], [0.1, 0.1, 0.26], [0.07, 0.1, 0.06]], jnp.float32)
    plane, edge, hollow = np.asarray(
        jax.jit(jax.vmap(lambda x: distance_and_deviation(layout, state, RATIO, x)[1]))(place)
    )
    assert plane < 0.0032 and edge > plane + 0.0005 and hollow > plane + 0.001, (plane, edge, hollow)
