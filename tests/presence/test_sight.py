"""What an image sees through, before and behind: rays of a camera that looks straight down, on paper."""

import jax
import jax.numpy as jnp
import numpy as np
from overhead import EXACT, down, grid_of, middles
from scipy.ndimage import minimum_filter

from hrcjax.geom.rotation import look_at
from hrcjax.presence.params import PresenceParams
from hrcjax.presence.sight import all_sights, least_around, seen_before, seen_behind, seen_free, sight_of
from hrcjax.presence.voxels import VoxelLayout
from hrcjax.sense import d435i
from hrcjax.sense.rig import stack_cameras

BOX = VoxelLayout((-0.4, -0.4, 0.0), (8, 8, 8), 0.1)
EYE = down(16, 12, 16.0, 2.05)
"""At the floor, z = 0, a pixel is 13 cm: 12 rows of it reach over +-0.77 m."""


def image(depth: float) -> np.ndarray:
    return np.full((12, 16), depth)


def free(depth: np.ndarray, params=EXACT, **more) -> np.ndarray:
    return grid_of(BOX, seen_free(BOX, params, sight_of(BOX, EYE), jnp.asarray(depth), **more))


def test_middles_are_seen_where_a_pinhole_shows_them(dtype) -> None:
    camera = down(16, 12, 16.0, 2.05, dtype, x=0.317, y=0.013)
    sight = sight_of(BOX, camera)
    x = middles(BOX).reshape(-1, 3) - np.array([0.317, 0.013, 2.05])
    depth = -x[:, 2]
    u, v = 16.0 * x[:, 0] / depth + 7.5, -16.0 * x[:, 1] / depth + 5.5
    inside = (u > -0.5) & (u < 15.5) & (v > -0.5) & (v < 11.5)
    assert 0 < inside.sum() < BOX.count
    np.testing.assert_allclose(sight.depth, depth, rtol=1e-6)
    expected = np.where(inside, np.round(v) * 16 + np.round(u), -1)
    sure = np.minimum(abs(u - np.floor(u) - 0.5), abs(v - np.floor(v) - 0.5)) > 1e-4
    assert sure.mean() > 0.9
    np.testing.assert_array_equal(np.asarray(sight.pixel)[sure], expected[sure])


def test_what_is_behind_the_lens_or_on_it_is_not_in_the_image() -> None:
    within_box = sight_of(BOX, down(16, 12, 16.0, 0.4))  # the camera is in the box
    z = middles(BOX).reshape(-1, 3)[:, 2]
    assert (np.asarray(within_box.pixel)[z > 0.34] == -1).all() and (np.asarray(within_box.pixel)[z < 0.34] >= 0).any()


def test_a_turned_camera_sees_the_middle_that_it_looks_at() -> None:
    target = middles(BOX)[3, 5, 2]
    camera = d435i(jnp.asarray([1.0, -0.7, 1.2]), jnp.asarray(target), 8)
    sight = sight_of(BOX, camera)
    index = (3 * 8 + 5) * 8 + 2
    u, v = int(sight.pixel[index]) % 80, int(sight.pixel[index]) // 80
    assert abs(u - float(camera.cx)) <= 0.5 and abs(v - float(camera.cy)) <= 0.5
    np.testing.assert_allclose(sight.depth[index], np.linalg.norm(target - [1.0, -0.7, 1.2]), rtol=1e-6)
    np.testing.assert_allclose(camera.rotation, look_at(camera.position, jnp.asarray(target)), atol=1e-6)


def test_least_of_nine_pixels() -> None:
    picture = np.random.default_rng(0).random((12, 16))
    np.testing.assert_array_equal(least_around(jnp.asarray(picture)), minimum_filter(picture, 3, mode="nearest"))


def test_before_a_wall_is_free_and_behind_it_not() -> None:
    """The wall is the plane z = 0.35, in the fourth layer: it holds the wall, half a voxel above it is not free either."""
    z = middles(BOX)[..., 2]
    np.testing.assert_array_equal(free(image(2.05 - 0.35 + 1e-3)), z > 0.35 + 0.05 - 1e-3)
    np.testing.assert_array_equal(free(image(2.05 - 0.31)), z > 0.31 + 0.05)
    assert not free(image(1.0)).any() and free(image(5.0)).all()


def test_nothing_measured_sees_through_nothing() -> None:
    """A pixel without measurement takes all voxels of which it is among the nine about the middle."""
    assert not free(image(0.0)).any()
    depth = image(3.0)
    depth[4, 9] = 0.0
    sight = sight_of(BOX, EYE)
    v, u = np.divmod(np.asarray(sight.pixel).reshape(BOX.shape), 16)
    beside_hole = (abs(v - 4) <= 1) & (abs(u - 9) <= 1)
    assert 0 < beside_hole.sum() < BOX.count / 2
    np.testing.assert_array_equal(free(depth), ~beside_hole)


def test_outside_of_the_image_nothing_is_known() -> None:
    narrow = down(16, 12, 60.0, 2.05)
    sight = sight_of(BOX, narrow)
    outside = np.asarray(sight.pixel).reshape(BOX.shape) < 0
    assert 0 < outside.sum() < BOX.count
    seen = grid_of(BOX, seen_free(BOX, EXACT, sight, jnp.asarray(image(9.0))))
    np.testing.assert_array_equal(seen, ~outside)
    assert not (grid_of(BOX, seen_before(BOX, sight, jnp.asarray(image(9.0)))) & outside).any()
    assert not (grid_of(BOX, seen_behind(BOX, sight, jnp.asarray(image(0.1)))) & outside).any()


def test_noise_takes_a_margin_that_grows_with_the_square_of_depth() -> None:
    params = PresenceParams(pixel_noise=0.01, deviations=2.0)
    depth = 2.05 - middles(BOX)[..., 2]
    for surely in (1.0, 2.0):
        margin = surely * 2.0 * 0.01 * depth**2
        for wall in (1.6, 1.83, 2.03):
            np.testing.assert_array_equal(free(image(wall), params, surely=surely), wall > depth + 0.05 + margin)


def test_before_is_without_a_margin_and_of_the_one_pixel() -> None:
    sight = sight_of(BOX, EYE)
    picture = np.where(np.arange(16) < 8, 1.7, 1.9) * np.ones((12, 1))
    picture[4, 9] = 0.0
    measured = picture.reshape(-1)[np.asarray(sight.pixel).reshape(BOX.shape)]
    expected = measured > 2.05 - middles(BOX)[..., 2]
    got = grid_of(BOX, seen_before(BOX, sight, jnp.asarray(picture)))
    np.testing.assert_array_equal(got, expected)
    assert not got[np.asarray(sight.pixel).reshape(BOX.shape) == 4 * 16 + 9].any()


def test_behind_somebody_and_in_a_ring_of_four_pixels_is_shadow() -> None:
    sight = sight_of(BOX, EYE)
    shown = image(0.0)
    shown[5, 6] = 1.6
    shown[5, 7] = 1.8
    v, u = np.divmod(np.asarray(sight.pixel).reshape(BOX.shape), 16)
    depth = 2.05 - middles(BOX)[..., 2]
    near, far = (np.where((abs(v - 5) <= 4) & (abs(u - at) <= 4), z, np.inf) for at, z in ((6, 1.6), (7, 1.8)))
    np.testing.assert_array_equal(
        grid_of(BOX, seen_behind(BOX, sight, jnp.asarray(shown))), np.minimum(near, far) < depth
    )
    assert not grid_of(BOX, seen_behind(BOX, sight, jnp.asarray(image(0.0)))).any()


def test_several_cameras_are_each_itself() -> None:
    cameras = [down(16, 12, 16.0, 2.05), down(16, 12, 20.0, 1.9, x=0.2)]
    for one, both in zip(
        map(lambda c: sight_of(BOX, c), cameras),
        [jax.tree.map(lambda a, k=k: a[k], all_sights(BOX, stack_cameras(cameras))) for k in (0, 1)],
        strict=True,
    ):
        np.testing.assert_array_equal(one.pixel, both.pixel)
        np.testing.assert_allclose(one.depth, both.depth, rtol=1e-12)
