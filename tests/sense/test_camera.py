"""Depth images against MuJoCo's ray caster."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from hrcjax.geom.capsules import Capsules
from hrcjax.sense.camera import d435i, in_image, pixel_directions, render_capsules, render_depth, render_scene
from hrcjax.sense.points import deproject
from hrcjax.sense.rig import cell_rig
from hrcjax.world.person import person_at
from hrcjax.world.scene import BOX, COLUMN, FLOOR_Z, SPHERE, table_solid
from hrcjax.world.scenes import clutter, hri, robotica


def _mujoco_depth(camera, scene, capsules):
    spec = mujoco.MjSpec()
    kinds = {
        SPHERE: mujoco.mjtGeom.mjGEOM_SPHERE,
        COLUMN: mujoco.mjtGeom.mjGEOM_CYLINDER,
        BOX: mujoco.mjtGeom.mjGEOM_BOX,
    }
    for i in np.flatnonzero(scene.mask):
        kind, size, yaw = int(scene.kind[i]), np.asarray(scene.size[i], float), float(scene.yaw[i])
        size = [size[0], size[2], 0] if kind == COLUMN else size
        spec.worldbody.add_geom(
            type=kinds[kind], pos=np.asarray(scene.center[i]), size=size, quat=[np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
        )
    for a, b, r in zip(*(np.asarray(v, float) for v in (capsules.a, capsules.b, capsules.radius)), strict=True):
        if r >= 0:
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*a, *b], size=[r, 0, 0])
    center, half = (np.asarray(v, float) for v in table_solid(scene))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=center, size=half)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, pos=[0, 0, -0.75], size=[0, 0, 1])
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    x, y = (u - float(camera.cx)) / float(camera.fx), (v - float(camera.cy)) / float(camera.fy)
    rays = (np.stack([x, y, np.ones_like(x)], -1) @ np.asarray(camera.rotation, float).T).reshape(-1, 3)
    lengths = np.linalg.norm(rays, axis=-1)
    ids, t = np.zeros(len(rays), np.int32), np.zeros(len(rays))
    mujoco.mj_multiRay(
        model, data, np.asarray(camera.position, float), (rays / lengths[:, None]).flatten(), None, True, -1, ids, t,
        None, len(rays), 1e6,
    )  # fmt: skip
    return np.where(t >= 0, t / lengths, np.inf).reshape(camera.height, camera.width)


@pytest.mark.parametrize("name", ["robotica", "clutter"])
def test_depth_agrees_with_mujoco(name, person, arm):
    scene = robotica() if name == "robotica" else clutter(2)
    camera = jax.tree.map(lambda a: a[0], cell_rig(scene, decimation=8).cameras)
    people = person_at(person, 4.0)
    both = Capsules(*(jnp.concatenate([getattr(people, k), getattr(arm, k)]) for k in ("a", "b", "radius")))
    expected = _mujoco_depth(camera, scene, both)
    mine = np.asarray(jax.jit(render_depth)(camera, scene, people, arm))
    assert mine.dtype == np.float32 and mine.shape == (60, 80)
    finite = np.isfinite(expected)
    assert np.mean(np.isfinite(mine) == finite) > 0.999
    error = np.abs(mine - expected)[finite & np.isfinite(mine)]
    assert np.mean(error < 1e-4) > 0.998  # all but pixels that graze an edge
    assert np.median(error) < 1e-6
    absent = Capsules(people.a, people.b, jnp.full_like(people.radius, -1))
    np.testing.assert_array_equal(
        render_depth(camera, scene, absent, arm), render_capsules(camera, arm, render_scene(camera, scene))
    )


def test_camera_constants_and_decimation(dtype):
    eye, target = jnp.asarray([0.0, -1.0, 1.0], dtype), jnp.zeros(3, dtype)
    full = d435i(eye, target, 1)
    assert (full.width, full.height) == (640, 480)
    assert [float(v) for v in (full.fx, full.fy, full.cx, full.cy)] == [385, 385, 319, 237]
    small = d435i(eye, target)
    assert (small.width, small.height) == (160, 120)
    assert [float(v) for v in (small.fx, small.fy, small.cx, small.cy)] == [96.25, 96.25, 79.75, 59.25]
    x, y = pixel_directions(full)
    fine_x, fine_y = pixel_directions(small)
    assert x.dtype == dtype
    np.testing.assert_allclose(x[::4, ::4], fine_x, atol=1e-6)  # pixel n is pixel 4 n of the full image
    np.testing.assert_allclose(y[::4, ::4], fine_y, atol=1e-6)
    with pytest.raises(ValueError, match="decimation 3"):
        d435i(eye, target, 3)


def test_floor_and_nothing():
    scene = hri(jnp.float64)
    down = d435i(jnp.asarray([4.0, 4.0, 1.0]), jnp.asarray([4.0, 4.0, 0.0]), 32)
    image = render_scene(down, scene)
    np.testing.assert_allclose(image, 1.0 - FLOOR_Z, atol=1e-9)  # depth, not range: the same for every pixel
    up = d435i(jnp.asarray([0.0, 0.0, 1.0]), jnp.asarray([0.0, 0.0, 5.0]), 32)
    assert np.isinf(render_scene(up, scene)).all()


def test_a_point_of_an_image_is_projected_onto_its_pixel() -> None:
    """The points that a depth image is made into go back to whole columns and rows, with their depths."""
    camera = d435i(jnp.asarray([0.4, -1.0, 1.5], jnp.float32), jnp.asarray([0.1, 0.3, 0.2], jnp.float32), 16)
    depth = jnp.asarray(np.random.default_rng(0).uniform(0.3, 3.0, (camera.height, camera.width)), jnp.float32)
    pixels, deep = in_image(camera, deproject(camera, depth).points)
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    np.testing.assert_allclose(pixels, np.stack([u.ravel(), v.ravel()], axis=-1), atol=2e-3)
    np.testing.assert_allclose(deep, np.asarray(depth).ravel(), rtol=1e-5)
    behind = camera.position - 0.5 * camera.rotation[:, 2] + 0.1 * camera.rotation[:, 0]
    pixel, deep = in_image(camera, behind)
    assert float(deep) == pytest.approx(-0.5, abs=1e-5) and np.isfinite(pixel).all()
    slope = jax.jacfwd(lambda x: in_image(camera, x)[0])(camera.position)
    assert np.isfinite(slope).all(), "in the pinhole itself, too"
