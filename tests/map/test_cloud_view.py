"""Clouds as views: points stay where they are, and nothing is seen through that the sensor did not see through."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.map import FACES, cloud_camera, empty_map, tiles_along, view_from_cloud
from hrcjax.map.view import TILE

NOISE, TILES = 4e-3, 32


def camera_at(position=(0.0, 0.0, 0.0), rotation=FACES[0], tiles: int = TILES):
    return cloud_camera(jnp.asarray(rotation, jnp.float32), jnp.asarray(position, jnp.float32), tiles)


def view_of(camera, cloud, gap: float = 0.02):
    cloud = np.asarray(cloud, np.float32)
    places = 2 ** int(np.ceil(np.log2(max(len(cloud), 2))))
    padded = np.zeros((places, 3), np.float32)
    padded[: len(cloud)] = cloud
    return view_from_cloud(camera, jnp.asarray(padded), jnp.asarray(np.arange(places) < len(cloud)), NOISE, gap)


def wall(z: float, spacing: float, half: float = 1.0) -> np.ndarray:
    """A square facing the sensor."""
    a = np.arange(-half, half, spacing) * z
    x, y = np.meshgrid(a, a)
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)


def test_faces_are_rotations_that_look_six_ways() -> None:
    for face in FACES:
        np.testing.assert_array_equal(face @ face.T, np.eye(3))
        assert np.linalg.det(face) == pytest.approx(1.0)
    ahead = FACES[:, :, 2]
    np.testing.assert_array_equal(ahead, [[0, 0, 1], [0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])


def test_points_come_into_the_world_and_padding_does_not() -> None:
    turned = FACES[2]  # its z is the world's x
    view = view_of(camera_at((1.0, 2.0, 3.0), turned), [[0.1, 0.2, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, -1.0]])
    np.testing.assert_array_equal(view.mask, [True, True, False, False])
    np.testing.assert_allclose(view.points[0], np.array([1.0, 2.0, 3.0]) + turned @ [0.1, 0.2, 1.0], rtol=1e-6)
    np.testing.assert_allclose(view.points[1], [3.0, 2.0, 3.0], rtol=1e-6)
    np.testing.assert_allclose(view.variance[1], (NOISE * 4) ** 2, rtol=1e-5)
    assert np.isfinite(np.asarray(view.points)).all() and np.isfinite(np.asarray(view.depth)).all()


def test_every_direction_is_in_a_face() -> None:
    cloud = np.random.default_rng(0).normal(size=(512, 3))
    seen = [np.asarray(view_of(camera_at(), cloud @ face).mask)[:512] for face in FACES]
    assert np.any(seen, axis=0).all()


def test_a_wall_is_seen_through_as_far_as_it_stands() -> None:
    view = view_of(camera_at(), wall(2.0, 0.01))
    depth = np.asarray(view.depth)
    assert depth.shape == (TILES, TILES)
    np.testing.assert_allclose(depth[4:-4, 4:-4], 2.0)


def test_a_tile_without_points_sees_nothing() -> None:
    cloud = wall(2.0, 0.01)
    view = view_of(camera_at(), cloud[cloud[:, 0] < -0.2])
    depth = np.asarray(view.depth)
    assert (depth[4:-4, 4:12] == np.float32(2.0)).all() and (depth[:, 17:] == 0).all()


def test_one_does_not_see_through_a_near_surface_between_its_points() -> None:
    """A sparse near plate before a dense far wall: no tile of the plate's own square may see the wall."""
    a = np.arange(-0.1, 0.101, 0.04)
    x, y = np.meshgrid(a, a)
    plate = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.5)], axis=1)
    camera = camera_at(tiles=64)
    cloud = np.concatenate([plate, wall(3.0, 0.01)])
    half = int(0.1 / 0.5 * float(camera.fx) / TILE)
    square = slice(32 - half, 32 + half)
    wide, narrow = (np.asarray(view_of(camera, cloud, gap).depth) for gap in (0.08, 1e-4))
    assert (wide[square, square] == 0.5).all()
    assert (narrow[square, square] > 2.9).mean() > 0.3  # what the gap is for
    assert (wide[4:12, 4:12] == 3.0).all()


def test_tiles_follow_the_size_of_the_cloud() -> None:
    assert [tiles_along(n) for n in (1, 2048, 2**15, 2**17, 2**24)] == [16, 16, 64, 128, 128]


@pytest.fixture(scope="module")
def cloud_program(layout, points_program):
    """(map, clouds in the sensor's axes, position) -> map after each cloud has been fused once."""
    look = jax.jit(lambda camera, cloud: view_from_cloud(camera, cloud, jnp.ones(len(cloud), bool), NOISE, 0.02))

    def fused(state, clouds, position):
        camera, reports = camera_at(position), []
        for cloud in clouds:
            state, report = points_program(state, camera, look(camera, jnp.asarray(cloud, jnp.float32)))
            reports.append(report)
        return state, reports

    return fused


def points_of(state) -> np.ndarray:
    rows = np.asarray(state.levels[0].rows)
    return np.moveaxis(rows[:, :3], 1, 2)[rows[:, 3] > 0]


def test_what_went_goes_and_what_is_hidden_or_between_stays(layout, cloud_program) -> None:
    """A plate before a wall; it goes, and with it its points alone."""
    sensor = (0.0, 0.0, -0.7)
    behind = wall(1.2, 0.008, 0.4)
    a = np.arange(-0.1, 0.1, 0.006)
    x, y = np.meshgrid(a, a)
    plate = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.7)], axis=1)
    hidden = behind[(np.abs(behind[:, :2]) > 0.1 * 1.2 / 0.7).any(axis=1)]
    with_plate = np.concatenate([plate, hidden])
    count = 2 ** int(np.ceil(np.log2(max(len(with_plate), len(behind)))))

    def padded(cloud):
        return np.concatenate([cloud, np.full((count - len(cloud), 3), [0.0, 0.0, -1.0])])

    state, reports = cloud_program(empty_map(layout), [padded(behind), padded(with_plate), padded(with_plate)], sensor)
    assert all(int(r.removed) == int(r.dynamic) == int(r.lost) == 0 for r in reports)
    points = points_of(state)
    near, far = points[:, 2] < 0.2, points[:, 2] > 0.4
    assert near.sum() > 50 and far.sum() > 500
    state, reports = cloud_program(state, [padded(behind)] * 3, sensor)
    after = points_of(state)
    assert (after[:, 2] < 0.2).sum() == 0
    assert (after[:, 2] > 0.4).sum() == far.sum()
    assert sum(int(r.removed) for r in reports) == near.sum()
