"""Mean depth, normals and pixels of a view, against closed forms."""

import jax.numpy as jnp
import numpy as np
import pytest
from made_views import UP, views_of

from hrcjax.sense import NoiseParams, d435i
from hrcjax.task_space.view import in_image, mean_depth, normals, points, steady, turned, view_of


def test_the_mean_leaves_out_pixels_that_fly_and_that_are_seldom_measured() -> None:
    draw, noise = np.random.default_rng(0), NoiseParams()
    images = np.full((16, 2, 2), 1.5) + draw.normal(size=(16, 2, 2)) * 1.5**2 * noise.subpixel / (385 * 0.05)
    images[:4, 0, 1] = 2.5  # flies in a quarter of the images
    images[2:, 1, 1] = 0.0  # measured twice
    depth, deviation = mean_depth(images, noise)
    assert abs(depth[0, 0] - 1.5) < 4 * deviation[0, 0] and abs(depth[0, 1] - 1.5) < 4 * deviation[0, 1]
    assert deviation[0, 0] == pytest.approx(1.5**2 * 0.08 / (385 * 0.05) / 4, rel=0.2)
    assert depth[1, 1] == 0 and deviation[1, 1] == 0


def test_images_of_another_size_are_refused() -> None:
    with pytest.raises(ValueError, match="rows, columns"):
        view_of(d435i(jnp.zeros(3), jnp.ones(3), 8), np.zeros((1, 3, 3)))


def test_normals_of_the_table_point_up_and_points_come_back_to_their_pixels() -> None:
    view = views_of([], 4)[0]
    place = points(view)
    on = np.abs(place[..., 2]) < 1e-4
    n, exists = normals(view)
    assert (exists & on).sum() > 5000
    inner = exists & on & (np.abs(place[..., 0] - 0.3) < 0.5) & (np.abs(place[..., 1] - 0.3) < 0.3)
    assert np.degrees(np.arccos(np.clip(n[inner] @ UP, -1, 1))).max() < 0.2
    pixel, z = in_image(view, place[10:40:7, 20:60:9])
    rows, columns = np.mgrid[10:40:7, 20:60:9]
    np.testing.assert_allclose(pixel, np.stack([columns, rows], -1), atol=1e-4)
    np.testing.assert_allclose(z, view.depth[10:40:7, 20:60:9], rtol=1e-5)


def test_a_turned_view_has_turned_points() -> None:
    view, angle = views_of([], 8)[0], 0.3
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    np.testing.assert_allclose(points(turned(view, R, UP)), points(view) @ R.T + UP, atol=1e-9)


def test_a_lone_pixel_is_not_steady() -> None:
    view = views_of([], 8)[0]
    depth = view.depth.copy()
    depth[20, 30] *= 0.7
    found = steady(view._replace(depth=depth))
    assert not found[20, 30] and found[20, 33]
