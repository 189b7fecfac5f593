"""What was sensed lies on what is there, and on nothing else."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import point_segment_distance
from hrcjax.map import MapLayout
from hrcjax.sense import NoiseParams, d435i
from hrcjax.sim.sensing import CELL_LAYOUT, SenseParams, crop_box, sense_sequence
from hrcjax.world import motion_named, person_at, scene_distance, scene_named

STAMPS = jnp.asarray(3.2 + np.arange(25) / 30, jnp.float32)
"""The hand goes into the path meanwhile."""
PARAMS = SenseParams()
_sense = jax.jit(sense_sequence, static_argnums=(7, 8, 9))


@pytest.fixture(scope="module")
def scene():
    return scene_named("robotica", 0)


@pytest.fixture(scope="module")
def person(scene):
    return motion_named("reach_in", scene, 0, 10.0, 30.0)


@pytest.fixture(scope="module")
def camera():
    return d435i(jnp.asarray([1.4, 0.15, 1.3], jnp.float32), jnp.asarray([0.4, 0.5, 0.1], jnp.float32), 4)


@pytest.fixture(scope="module")
def arm() -> Capsules:
    """An arm folded at the base, away from the path, at every stamp."""
    a = jnp.asarray([[0.0, 0.0, 0.0], [0.0, 0.0, 0.15], [-0.25, 0.0, 0.4]], jnp.float32)
    b = jnp.asarray([[0.0, 0.0, 0.15], [-0.25, 0.0, 0.4], [-0.3, 0.2, 0.2]], jnp.float32)
    one = Capsules(a, b, jnp.full((3,), 0.06, jnp.float32))
    return jax.tree.map(lambda v: jnp.broadcast_to(v, (len(STAMPS), *v.shape)), one)


@pytest.fixture(scope="module")
def sense(camera, scene, arm):
    """(person, key, params, places) -> frames."""

    def run(person, key=0, params=PARAMS, places=(96, 512), stamps=STAMPS):
        return _sense(camera, scene, person, arm, stamps, jax.random.key(key), params, CELL_LAYOUT, *places)

    return run


@pytest.fixture(scope="module")
def frames(sense, person):
    return sense(person)


def _points(cloud, frame=None) -> np.ndarray:
    points, mask = (np.asarray(v if frame is None else v[frame]) for v in (cloud.points, cloud.mask))
    return points[mask]


def _to_person(person, t, x) -> np.ndarray:
    capsules = person_at(person, t)
    distance = jax.vmap(jax.vmap(point_segment_distance, in_axes=(None, 0, 0)), in_axes=(0, None, None))
    return np.min(distance(x, capsules.a, capsules.b) - capsules.radius, axis=1)


def test_static_points_lie_on_the_obstacles(frames, scene) -> None:
    assert frames.static.points.shape == (96, 3) and not bool(frames.static_overflow)
    points = _points(frames.static)
    assert len(points) >= 20
    distance = jax.vmap(lambda x: scene_distance(scene, x, table=False))(points)
    assert np.abs(distance).max() < 0.03
    assert np.abs(np.median(distance)) < 0.01
    for k in range(4):  # every column is seen
        beside = np.linalg.norm(points[:, :2] - np.asarray(scene.center)[k, :2], axis=1)
        assert beside.min() < 0.05


def test_moving_points_lie_on_the_person(frames, person) -> None:
    assert frames.moving.points.shape == (25, 512, 3)
    np.testing.assert_array_equal(frames.stamp, STAMPS)
    assert np.asarray(frames.valid).all() and not np.asarray(frames.overflow).any()
    for k in (2, 12, 24):
        points = _points(frames.moving, k)
        assert len(points) > 150
        distance = _to_person(person, float(STAMPS[k]), points)
        assert distance.min() > -0.1 and distance.max() < 0.06 and np.mean(np.abs(distance) < 0.05) > 0.9
    hand = person_at(person, float(STAMPS[24])).b[9]
    assert np.min(np.linalg.norm(_points(frames.moving, 24) - hand, axis=1)) < 0.1  # the hand in the path is among them


def test_where_a_hand_was_nothing_is_left(frames, person) -> None:
    before, after = (person_at(person, float(STAMPS[k])).b[9] for k in (12, 24))
    assert np.linalg.norm(after - before) > 0.05
    left = _points(frames.moving, 24)
    far = left[np.linalg.norm(left - before, axis=1) < 0.1]
    assert len(far) == 0 or np.max(_to_person(person, float(STAMPS[24]), far)) < 0.08


def test_nobody_leaves_next_to_nothing(sense, scene) -> None:
    frames = sense(motion_named("nobody", scene, 0, 10.0, 30.0), key=2)
    assert int(frames.moving.mask.sum(axis=1).max()) <= 3
    assert np.asarray(frames.valid).all() and not np.asarray(frames.overflow).any()


def test_overflow_keeps_the_nearest_to_the_robot(sense, person, frames) -> None:
    few = sense(person, places=(8, 16))
    assert bool(few.static_overflow)
    np.testing.assert_array_equal(few.overflow, np.asarray(frames.moving.mask).sum(axis=1) > 16)
    assert np.asarray(few.overflow)[2:].all()
    all_static = np.linalg.norm(_points(frames.static), axis=1)
    np.testing.assert_allclose(np.linalg.norm(few.static.points, axis=1), np.sort(all_static)[:8], atol=1e-5)


def test_a_map_without_places_is_told(camera, scene, person, arm) -> None:
    small = MapLayout(lower=(-2.0, -2.0, 0.0), shape=(20, 20, 8), spacing=0.05, capacity=8, levels=2, refitted=0)
    some = jax.tree.map(lambda v: v[:4], arm)
    frames = _sense(camera, scene, person, some, STAMPS[:4], jax.random.key(0), PARAMS, small, 96, 512)
    assert np.asarray(frames.overflow).all()


def test_blind_camera_is_not_an_empty_cell(sense, person) -> None:
    blind = sense(person, params=eqx.tree_at(lambda p: p.noise, PARAMS, NoiseParams(far=0.5)))
    assert not np.asarray(blind.valid).any()
    assert not np.asarray(blind.moving.mask).any()


def test_frames_that_come_twice_are_not_believed_and_change_nothing(sense, person, frames) -> None:
    stamps = STAMPS.at[12:].add(-1 / 30)  # frame 12 repeats the stamp of frame 11
    again = sense(person, stamps=stamps)
    np.testing.assert_array_equal(np.flatnonzero(~np.asarray(again.valid)), [12])
    np.testing.assert_array_equal(_points(again.moving, 11), _points(again.moving, 12))


def test_crop_box() -> None:
    lower, upper = crop_box(PARAMS, jnp.dtype("float32"))
    np.testing.assert_allclose(lower, [-2, -2, 0.03])
    np.testing.assert_allclose(upper, [2, 2, 1.3])


def test_frames_repeat_differ_by_key_and_check_their_count(sense, camera, scene, person, arm, frames) -> None:
    np.testing.assert_array_equal(sense(person).moving.points, frames.moving.points)
    assert not np.array_equal(sense(person, key=5).moving.points, frames.moving.points)
    with pytest.raises(ValueError, match="25 poses of the arm for 4 stamps"):
        sense_sequence(camera, scene, person, arm, STAMPS[:4], jax.random.key(0), PARAMS)
