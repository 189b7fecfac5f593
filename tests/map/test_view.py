"""Tiles of an image: planes, edges, flying pixels, holes."""

import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import make_view
from hrcjax.sense import d435i


@pytest.fixture(scope="module")
def camera():
    return d435i(jnp.asarray([0.3, -0.2, 1.0]), jnp.asarray([0.4, 0.3, 0.0]), 4)


def directions(camera) -> np.ndarray:
    x = (np.arange(camera.width) - float(camera.cx)) / float(camera.fx)
    y = (np.arange(camera.height) - float(camera.cy)) / float(camera.fy)
    return np.stack([np.broadcast_to(x, (120, 160)), np.broadcast_to(y[:, None], (120, 160)), np.ones((120, 160))], -1)


def test_points_of_a_slanted_plane_lie_on_it(camera) -> None:
    """The table's top, z = 0, seen aslant: the mean of a tile is a point of the plane."""
    world = directions(camera) @ np.asarray(camera.rotation).T
    depth = -1.0 / world[..., 2]
    view = make_view(camera, jnp.asarray(depth), 4e-3, gap=0.2)
    assert view.mask.all() and view.points.shape == (30 * 40, 3)
    np.testing.assert_allclose(view.points[:, 2], 0.0, atol=1e-9)


def test_variance_is_that_of_a_mean(camera) -> None:
    view = make_view(camera, jnp.full((120, 160), 2.0), 4e-3)
    np.testing.assert_allclose(view.variance, (4e-3 * 4) ** 2 / 16, rtol=1e-6)


def test_a_flying_pixel_moves_nothing_and_alone_is_no_tile(camera) -> None:
    depth = np.full((120, 160), 1.0)
    depth[4, 8] = 0.7  # a corner of a tile
    view = make_view(camera, jnp.asarray(depth), 4e-3)
    depth_of = (np.asarray(view.points) - np.asarray(camera.position)) @ np.asarray(camera.rotation)[:, 2]
    np.testing.assert_allclose(depth_of, 1.0, atol=1e-9)
    lonely = np.zeros((120, 160))
    lonely[5, 9] = 0.7
    assert not make_view(camera, jnp.asarray(lonely), 4e-3).mask.any()


def test_seen_through_as_far_as_the_nearest_pixel_and_not_at_all_where_the_camera_is_blind(camera) -> None:
    depth = np.full((120, 160), 1.5)
    depth[0, 0] = 0.9
    depth[4:8, 0] = np.nan
    depth[4:8, 4] = 0.0
    depth[7, 5] = np.nan
    view = make_view(camera, jnp.asarray(depth), 4e-3)
    assert view.depth[0, 0] == pytest.approx(0.9)
    assert view.depth[1, 0] == 1.5  # four holes in sixteen pixels
    assert view.depth[1, 1] == 0.0  # five
    assert view.depth[1, 2] == 1.5
