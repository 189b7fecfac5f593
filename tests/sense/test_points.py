"""From images to points: closed forms, scipy's nearest neighbours, real frames."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import cKDTree

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.segment import FAR
from hrcjax.sense.camera import Camera, d435i, render_capsules, render_scene
from hrcjax.sense.points import crop, deproject, moved, nearest_distance, remove_body, supported, valid_depth
from hrcjax.world.scene import scene_distance
from hrcjax.world.scenes import hri, robotica


def test_deprojected_points_lie_on_what_was_rendered():
    scene = robotica(dtype=jnp.float64)
    camera = d435i(jnp.asarray([1.4, 0.15, 1.3]), jnp.asarray([0.4, 0.5, 0.1]), 16)
    image = render_scene(camera, scene)
    cloud = deproject(camera, image)
    np.testing.assert_array_equal(cloud.mask, np.isfinite(image).reshape(-1))
    points = cloud.points[np.asarray(cloud.mask) & (np.asarray(cloud.points[:, 2]) > -0.7)]
    assert len(points) > 300
    np.testing.assert_allclose(jax.vmap(lambda x: scene_distance(scene, x))(points), 0, atol=1e-9)


def test_deproject_by_hand_and_invalid_pixels(dtype):
    R = jnp.asarray([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], dtype)  # looks along x, right is -y, down is -z
    camera = Camera(R, jnp.asarray([1, 2, 3], dtype), jnp.asarray(2, dtype), jnp.asarray(4, dtype),
                    jnp.asarray(1, dtype), jnp.asarray(0, dtype), 3, 2)  # fmt: skip
    depth = jnp.asarray([[2, 0, np.nan], [np.inf, 2, -1]], dtype)
    cloud = deproject(camera, depth)
    assert cloud.points.dtype == dtype
    np.testing.assert_array_equal(cloud.mask, [True, False, False, False, True, False])
    np.testing.assert_array_equal(valid_depth(depth), np.asarray(cloud.mask).reshape(2, 3))
    np.testing.assert_allclose(cloud.points[0], [3, 3, 3])  # one pixel left of the middle, half a metre a metre
    np.testing.assert_allclose(cloud.points[4], [3, 2, 2.5])  # one row down
    assert np.isfinite(cloud.points).all()
    with pytest.raises(ValueError, match="image of"):
        deproject(camera, depth.T)


def test_real_frame_projects_back_to_its_pixels(shared_data):
    lines = (shared_data / "rgbd" / "depth" / "2.pgm").read_bytes()
    raw = np.frombuffer(lines[-640 * 480 * 2 :], dtype=">u2").reshape(480, 640)
    depth = jnp.asarray(raw[::8, ::8] / 1000.0)
    k = jnp.asarray
    camera = Camera(k(np.eye(3)), k(np.zeros(3)), k(518 / 8), k(519 / 8), k(325.5 / 8), k(253.5 / 8), 80, 60)
    cloud = deproject(camera, depth)
    p = np.asarray(cloud.points)[np.asarray(cloud.mask)]
    assert len(p) > 1000 and p[:, 2].min() > 0.3 and p[:, 2].max() < 12
    v, u = np.nonzero(raw[::8, ::8])
    np.testing.assert_allclose(p[:, 0] / p[:, 2] * 518 / 8 + 325.5 / 8, u, atol=1e-9)
    np.testing.assert_allclose(p[:, 1] / p[:, 2] * 519 / 8 + 253.5 / 8, v, atol=1e-9)


def test_body_is_removed_with_scale_and_pad(dtype):
    body = Capsules(
        jnp.zeros((2, 3), dtype), jnp.asarray([[0, 0, 1], [0, 5, 0]], dtype), jnp.asarray([0.1, -1.0], dtype)
    )
    gap = 1.1 * 0.1 + 0.05
    x = jnp.asarray([[gap - 1e-3, 0, 0.5], [gap + 1e-3, 0, 0.5], [0, 0, 1 + gap - 1e-3], [0, 4, 0], [0, 0, 0.5]], dtype)
    cloud = Cloud(x, jnp.asarray([True, True, True, True, False]))
    np.testing.assert_array_equal(remove_body(cloud, body).mask, [False, True, False, True, False])
    thin = remove_body(cloud, body, 1.0, 0.0)
    np.testing.assert_array_equal(thin.mask, [True, True, True, True, False])


def test_whole_robot_disappears_from_its_own_image(arm):
    scene = hri()
    camera = d435i(jnp.asarray([1.0, 1.0, 1.0], jnp.float32), jnp.zeros(3, jnp.float32), 8)
    cloud = deproject(camera, render_capsules(camera, arm, render_scene(camera, scene)))
    lower, upper = jnp.asarray([-1, -1, 0.01], jnp.float32), jnp.asarray([1, 1, 1], jnp.float32)
    before = crop(cloud, lower, upper)
    assert int(before.mask.sum()) > 30
    assert int(remove_body(before, arm).mask.sum()) == 0


def test_crop():
    cloud = Cloud(
        jnp.asarray([[0.0, 0, 0], [1, 1, 1], [1.01, 0, 0], [0, -0.01, 0], [0.5, 0.5, 1.2]]), jnp.ones(5, bool)
    )
    np.testing.assert_array_equal(crop(cloud, jnp.zeros(3), jnp.ones(3)).mask, [True, True, False, False, False])
    none = Cloud(cloud.points, jnp.zeros(5, bool))
    assert not np.asarray(crop(none, jnp.zeros(3), jnp.ones(3)).mask).any()


@pytest.mark.parametrize("count", [1, 7, 8, 61])
def test_nearest_distance_agrees_with_a_tree(count, dtype):
    rng = np.random.default_rng(count)
    x, y = rng.normal(size=(90, 3)), rng.normal(size=(count, 3))
    mask = np.arange(count) % 3 == 0
    cloud = Cloud(jnp.asarray(y, dtype), jnp.asarray(mask))
    mine = nearest_distance(jnp.asarray(x, dtype), cloud)
    assert mine.dtype == dtype
    np.testing.assert_allclose(mine, cKDTree(y[mask]).query(x)[0], atol=1e-5)


def test_empty_cloud_and_moved():
    x = jnp.asarray([[0.0, 0, 0], [0.07, 0, 0], [0.09, 0, 0], [5, 5, 5]])
    background = Cloud(jnp.zeros((3, 3)), jnp.asarray([True, False, False]))
    cloud = Cloud(x, jnp.asarray([True, True, True, False]))
    np.testing.assert_array_equal(moved(cloud, background, 0.08).mask, [False, False, True, False])
    empty = Cloud(jnp.zeros((3, 3)), jnp.zeros(3, bool))
    np.testing.assert_allclose(nearest_distance(x, empty), FAR)
    np.testing.assert_array_equal(moved(cloud, empty, 0.08).mask, cloud.mask)
    gradient = jax.grad(lambda p: jnp.sum(nearest_distance(p, background)))(x)
    assert np.isfinite(gradient).all()  # one query lies on the data


def test_support_drops_lone_pixels_and_keeps_surfaces(dtype):
    depth = np.full((5, 6), 1.0)
    depth[2, 3] = 1.2  # hangs alone
    depth[4, 0] = 0.0
    depth[:2, 5] = 1.3  # a corner of its own, two high and one wide: one neighbour each
    kept = np.asarray(supported(jnp.asarray(depth, dtype)))
    assert not kept[2, 3] and not kept[4, 0] and not kept[:2, 5].any()
    assert kept[0, 0] and kept[2, 0] and kept[2, 2] and kept[3, 5]
    assert not np.asarray(supported(jnp.full((3, 3), np.inf, dtype))).any()
    assert np.asarray(supported(jnp.asarray(depth, dtype), 0.5, 1.0))[depth > 0].all()


def test_points_that_are_not_a_number_do_not_vanish():
    """Nobody knows where they are: neither the robot, nor outside the box, nor the background."""
    points = jnp.asarray([[0.0, 0.0, 0.0], [jnp.nan, 0.0, 0.0], [0.5, 0.0, 0.0]])
    cloud = Cloud(points, jnp.ones(3, bool))
    body = Capsules(jnp.zeros((1, 3)), jnp.zeros((1, 3)), jnp.full(1, 0.1))
    np.testing.assert_array_equal(remove_body(cloud, body).mask, [False, True, True])
    np.testing.assert_array_equal(crop(cloud, -0.1 * jnp.ones(3), 0.1 * jnp.ones(3)).mask, [True, True, False])
    known = Cloud(points[:1], jnp.ones(1, bool))
    np.testing.assert_array_equal(moved(cloud, known, 0.1).mask, [False, True, True])
    # and a background point that is nowhere explains nothing
    np.testing.assert_array_equal(moved(cloud, Cloud(points[:2], jnp.ones(2, bool)), 0.1).mask, [False, True, True])
