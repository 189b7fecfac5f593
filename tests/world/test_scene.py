"""Scene distances against C MuJoCo; masks; derivatives."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import FAR
from hrcjax.world.scene import (
    BOX,
    COLUMN,
    SPHERE,
    TABLE_THICKNESS,
    capsules_obstacle_distances,
    capsules_scene_distance,
    obstacle_distances,
    scene_distance,
    table_solid,
)
from hrcjax.world.scenes import Obstacle, make_scene

OBSTACLES = [
    Obstacle(SPHERE, (0.3, 0.5, 0.2), (0.06, 0.9, 0.9), 0.0, 0.06),
    Obstacle(COLUMN, (0.5, 0.2, 0.15), (0.04, 0.9, 0.15), 0.0, 0.04),
    Obstacle(BOX, (-0.2, 0.4, 0.1), (0.05, 0.12, 0.1), 0.6, 0.08),
]


def _scene(dtype):
    return make_scene(OBSTACLES, (0.0, 0.5, 0.2), (0.5, 0.5, 0.2), (-1.0, 0.0, 0.0), (1.0,) * 3, dtype)


def _model(capsules):
    spec = mujoco.MjSpec()
    add = spec.worldbody.add_geom
    sphere, column, box = OBSTACLES
    add(type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=sphere.center, size=[0.06, 0, 0])
    add(type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=column.center, size=[0.04, 0.15, 0])
    add(type=mujoco.mjtGeom.mjGEOM_BOX, pos=box.center, size=box.size, quat=[np.cos(0.3), 0, 0, np.sin(0.3)])
    for a, b, r in zip(*(np.asarray(v, float) for v in (capsules.a, capsules.b, capsules.radius)), strict=True):
        add(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*a, *b], size=[r, 0, 0])
    model = spec.compile()
    model.opt.ccd_tolerance = 1e-9
    model.opt.ccd_iterations = 200
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_capsules_to_obstacles_agree_with_mujoco(dtype):
    rng = np.random.default_rng(0)
    n = 12
    a = rng.uniform((-0.5, 0, 0), (0.8, 0.8, 0.6), (n, 3))
    capsules = Capsules(
        jnp.asarray(a, dtype), jnp.asarray(a + rng.uniform(-0.3, 0.3, (n, 3)), dtype), jnp.full(n, 0.05, dtype)
    )
    scene = _scene(dtype)
    mine = jax.jit(capsules_obstacle_distances)(scene, capsules)
    assert mine.dtype == dtype and mine.shape == (n, 16)
    model, data = _model(capsules)
    compared = 0
    for i in range(n):
        for j in range(3):
            expected = mujoco.mj_geomDistance(model, data, 3 + i, j, 5.0, None)
            if expected > 1e-3:
                assert float(mine[i, j]) == pytest.approx(expected, abs=1e-5)
                compared += 1
            else:
                assert float(mine[i, j]) < 2e-3
    assert compared > 20
    assert (np.asarray(mine)[:, 3:] == FAR).all()
    np.testing.assert_allclose(jax.jit(capsules_scene_distance)(scene, capsules), np.min(mine, axis=1))
    absent = Capsules(capsules.a, capsules.b, capsules.radius.at[0].set(-1))
    assert float(capsules_scene_distance(scene, absent)[0]) == FAR


def test_point_distances_masks_and_table(dtype):
    scene = _scene(dtype)
    x = jnp.asarray([0.3, 0.5, 0.36], dtype)
    each = np.asarray(obstacle_distances(scene, x))
    assert each.dtype == dtype
    assert each[0] == pytest.approx(0.1, abs=1e-6)
    assert each[1] == pytest.approx(np.hypot(np.hypot(0.2, 0.3) - 0.04, 0.06), abs=1e-6)
    assert (each[3:] == FAR).all()
    assert float(scene_distance(scene, x)) == pytest.approx(0.1, abs=1e-6)
    low = jnp.asarray([0.0, 0.0, 0.05], dtype)
    assert float(scene_distance(scene, low)) == pytest.approx(0.05, abs=1e-6)
    assert float(scene_distance(scene, low, table=False)) > 0.2
    under = jnp.asarray([0.0, 0.0, -0.3], dtype)
    assert float(scene_distance(scene, under)) == pytest.approx(0.3 - TABLE_THICKNESS, abs=1e-6)
    center, half = table_solid(scene)
    assert float(center[2] + half[2]) == 0 and float(half[2]) == pytest.approx(TABLE_THICKNESS / 2)
    np.testing.assert_allclose((center - half)[:2], scene.table_lower, atol=1e-6)


def test_gradients_are_finite_everywhere_dangerous():
    scene = _scene(jnp.float64)
    gradient = jax.jit(jax.grad(scene_distance, argnums=1))
    for x in [(0.3, 0.5, 0.2), (0.5, 0.2, 0.15), (-0.2, 0.4, 0.1), (0.36, 0.5, 0.2), (0.0, 0.0, 0.0), (3.0, 3.0, 3.0)]:
        assert np.isfinite(gradient(scene, jnp.asarray(x))).all()
    by_scene = jax.grad(lambda s, x: scene_distance(s, x), allow_int=True)(scene, jnp.asarray([0.3, 0.5, 0.36]))
    np.testing.assert_allclose(by_scene.center[0], [0, 0, -1], atol=1e-12)
    assert float(by_scene.size[0, 0]) == pytest.approx(-1)
    assert np.isfinite(by_scene.center).all() and np.isfinite(by_scene.size).all()
