"""The cameras of a cell: where they look, when they take images, and the one in the hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.rotation import rotation_vector
from hrcjax.sense.rig import EYE, cell_rig, exposures, hand_camera, stack_cameras
from hrcjax.world import scene_named
from hrcjax.world.place import path_middle, standing_place
from hrcjax.world.scene import Scene


def one_of(cameras, k: int):
    return jax.tree.map(lambda a: a[k], cameras)


def pixel(camera, point) -> tuple[float, float, float]:
    """Column, row [px] and depth [m] of a point."""
    x, y, z = np.asarray(camera.rotation).T @ (np.asarray(point) - np.asarray(camera.position))
    return x / z * float(camera.fx) + float(camera.cx), y / z * float(camera.fy) + float(camera.cy), z


SCENES = [("robotica", 0), ("hri", 0), ("clutter", 1)]


@pytest.mark.parametrize(("name", "seed"), SCENES)
def test_both_cameras_see_the_task_and_whoever_stands_behind_it(name: str, seed: int) -> None:
    scene: Scene = scene_named(name, seed)
    rig = cell_rig(scene)
    chest = [*np.asarray(standing_place(scene)), 0.4]
    for k in range(2):
        camera = one_of(rig.cameras, k)
        for point in (scene.start, scene.goal, path_middle(scene), chest):
            u, v, z = pixel(camera, point)
            assert z > 0.5 and 5 < u < camera.width - 5 and 5 < v < camera.height - 5


@pytest.mark.parametrize(("name", "seed"), SCENES)
def test_cameras_are_mirrored_about_the_path_and_the_first_is_beside_the_goal(name: str, seed: int) -> None:
    scene = scene_named(name, seed)
    rig = cell_rig(scene)
    middle, eyes = np.asarray(path_middle(scene)), np.asarray(rig.cameras.position)
    np.testing.assert_allclose(np.abs(eyes[:, 0] - middle[0]), EYE[0], atol=1e-6)
    np.testing.assert_allclose(eyes[:, 1], middle[1] - EYE[1], atol=1e-6)
    np.testing.assert_allclose(eyes[:, 2], EYE[2], atol=1e-6)
    assert (eyes[0, 0] - middle[0]) * float(scene.goal[0] - scene.start[0]) > 0 > (eyes[1, 0] - middle[0]) * float(
        scene.goal[0] - scene.start[0]
    )


def test_one_camera_is_the_first_of_two() -> None:
    scene = scene_named("robotica", 0)
    one, two = cell_rig(scene, cameras=1, rate=30.0, hand=False), cell_rig(scene, decimation=8)
    assert (one.count, two.count) == (1, 2) and one.hand is None and two.hand is not None
    assert one.rates == (30.0,) and two.rates == (15.0, 15.0)
    np.testing.assert_array_equal(one.cameras.position[0], two.cameras.position[0])
    np.testing.assert_array_equal(one.cameras.rotation[0], two.cameras.rotation[0])
    assert (one.cameras.width, two.cameras.width, two.hand.width) == (160, 80, 80)
    for count in (0, 3):
        with pytest.raises(ValueError, match=f"{count} stationary cameras; accepted: 1 or 2"):
            cell_rig(scene, cameras=count)


def test_stacked_cameras_come_apart_again() -> None:
    rig = cell_rig(scene_named("robotica", 0))
    again = stack_cameras([one_of(rig.cameras, k) for k in range(2)])
    for a, b in zip(jax.tree.leaves(again), jax.tree.leaves(rig.cameras), strict=True):
        np.testing.assert_array_equal(a, b)


def test_the_camera_in_the_hand_looks_past_the_tool_along_its_axis() -> None:
    """A point ahead of the tool stays at one pixel wherever the hand is; the tool's point is 8 cm beside the view's axis."""
    hand = cell_rig(scene_named("robotica", 0)).hand
    assert hand is not None
    random = np.random.default_rng(0)
    seen = []
    for _ in range(3):
        R, p = rotation_vector(jnp.asarray(random.normal(size=3), jnp.float32)), random.normal(size=3)
        camera = hand_camera(hand, R, jnp.asarray(p, jnp.float32))
        u, v, z = pixel(camera, p + np.asarray(R) @ [0.08, 0.0, 0.5])
        np.testing.assert_allclose([u, v, z], [float(hand.cx), float(hand.cy), 0.6], atol=1e-3)
        seen.append(pixel(camera, p))
        np.testing.assert_allclose(seen[-1][2], 0.1, atol=1e-5)
        away = np.asarray(camera.position) - p
        np.testing.assert_allclose(np.linalg.norm(away), np.hypot(0.08, 0.1), atol=1e-5)
    np.testing.assert_allclose(seen, [seen[0]] * 3, atol=1e-2)


# when images are taken ------------------------------------------------------------------------------------------------


def test_two_cameras_alternate_half_a_period_apart() -> None:
    times, index = exposures((15.0, 15.0), -0.2, 1.0)
    assert index.dtype == np.int32 and index.tolist() == [0, 1] * 18
    np.testing.assert_allclose(times, -0.2 + np.arange(36) / 30, atol=1e-12)


@pytest.mark.parametrize("rates", [(30.0,), (15.0, 15.0), (10.0, 25.0), (7.0, 13.0, 30.0)])
def test_every_camera_keeps_its_own_rate(rates: tuple[float, ...]) -> None:
    begin, end = 0.3, 2.7
    times, index = exposures(rates, begin, end)
    assert (np.diff(times) >= 0).all() and times.min() >= begin and times.max() < end
    for c, rate in enumerate(rates):
        own = times[index == c]
        np.testing.assert_allclose(np.diff(own), 1 / rate, rtol=1e-9)
        assert own[0] - begin < 1 / rate and end - own[-1] <= 1 / rate + 1e-9
        np.testing.assert_allclose(own[0], begin + c / len(rates) / rate, rtol=1e-9)


def test_an_image_at_the_end_is_none() -> None:
    times, _ = exposures((10.0,), 0.0, 0.3)
    np.testing.assert_allclose(times, [0.0, 0.1, 0.2], atol=1e-12)
    assert exposures((10.0,), 0.0, 0.0)[0].size == 0
