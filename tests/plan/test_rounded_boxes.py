"""Obstacles as rounded boxes: distances and normals against one box at a time and its derivative."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from hrcjax.geom.segment import FAR
from hrcjax.geom.shape import box_distance
from hrcjax.plan.rounded_boxes import RoundedBoxes, least_distance, nearest_obstacles


def some(turned):
    rng = np.random.default_rng(0)
    center, half = rng.uniform(-0.6, 0.6, (5, 3)), rng.uniform(0.05, 0.2, (5, 3))
    half[1] = 0.0  # a sphere
    radius = np.array([0.0, 0.15, 0.05, 0.0, -1.0])
    rotation = Rotation.random(5, rng=np.random.default_rng(1)).as_matrix() if turned else None
    arrays = [jnp.asarray(x, jnp.float32) for x in (center, half, radius)]
    return RoundedBoxes(*arrays, None if rotation is None else jnp.asarray(rotation, jnp.float32))


def alone(solids, box, x):
    away = x - solids.center[box]
    if solids.rotation is not None:
        away = solids.rotation[box].T @ away
    found = box_distance(away, jnp.zeros(3, x.dtype), solids.half[box]) - solids.radius[box]
    return jnp.where(solids.radius[box] < 0, FAR, found)


def test_distances_and_normals_are_those_of_each_box():
    points = np.random.default_rng(2).uniform(-0.8, 0.8, (400, 3)).astype(np.float32)
    x = [jnp.asarray(points[:, k].reshape(20, 20)) for k in range(3)]
    for turned in (False, True):
        solids = some(turned)
        every = jax.vmap(lambda x, s=solids: jnp.stack([alone(s, box, x) for box in range(5)]))(jnp.asarray(points))
        slopes = jax.vmap(jax.jacfwd(lambda x, s=solids: jnp.stack([alone(s, box, x) for box in range(5)])))(
            jnp.asarray(points)
        )
        order = np.argsort(np.asarray(every), axis=1)
        found = nearest_obstacles(solids, x, 2)
        for place in range(2):
            there = np.take_along_axis(np.asarray(every), order[:, place, None], 1)[:, 0]
            np.testing.assert_allclose(np.asarray(found.distance[place]).reshape(-1), there, atol=5e-5)
            clear = np.diff(np.take_along_axis(np.asarray(every), order, 1), axis=1).min(axis=1) > 1e-3
            slope = np.take_along_axis(np.asarray(slopes), order[:, place, None, None], 1)[:, 0]
            mine = np.stack([np.asarray(n[place]).reshape(-1) for n in found.normal], axis=1)
            assert clear.sum() > 300
            np.testing.assert_allclose(mine[clear], slope[clear], atol=2e-4)
        np.testing.assert_allclose(
            np.asarray(least_distance(solids, x)).reshape(-1), np.asarray(every).min(axis=1), atol=1e-6
        )
    assert (np.asarray(every).min(axis=1) < 0).any()


def test_many_obstacles_are_those_of_a_tree():
    """300 balls, as a cloud of points: SciPy's nearest two."""
    rng = np.random.default_rng(3)
    center, points = rng.uniform(-0.8, 0.8, (300, 3)), rng.uniform(-0.9, 0.9, (500, 3))
    balls = RoundedBoxes(jnp.asarray(center, jnp.float32), jnp.zeros((300, 3), jnp.float32), jnp.full(300, 0.02))
    x = [jnp.asarray(points[:, k, None], jnp.float32) for k in range(3)]
    far, index = KDTree(center).query(points, 2)
    found = jax.jit(lambda solids: nearest_obstacles(solids, x, 2))(balls)
    clear = far[:, 1] - far[:, 0] > 5e-4
    assert clear.sum() > 450
    np.testing.assert_allclose(np.asarray(found.distance)[..., 0].T, far - 0.02, atol=5e-4)
    away = (points[:, None] - center[index]) / far[..., None]
    normal = np.stack([np.asarray(n)[..., 0].T for n in found.normal], axis=-1)
    np.testing.assert_allclose(normal[clear, 0], away[clear, 0], atol=2e-4)
    np.testing.assert_allclose(np.asarray(least_distance(balls, x))[:, 0], far[:, 0] - 0.02, atol=1e-5)


def test_more_obstacles_than_can_be_numbered_are_refused() -> None:
    many = RoundedBoxes(jnp.zeros((1025, 3)), jnp.ones((1025, 3)), jnp.zeros(1025))
    with pytest.raises(ValueError, match="at most 1024"):
        nearest_obstacles(many, [jnp.zeros((1, 1))] * 3, 1)
