"""What was sensed lies on what is there, and on nothing else."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import point_segment_distance
from hrcjax.sense.camera import render_capsules, render_scene
from hrcjax.sense.noise import NoiseParams
from hrcjax.sense.observe import SenseParams, background, crop_box, moving_points, points_of, sense_sequence
from hrcjax.world.motions import nobody
from hrcjax.world.person import person_at
from hrcjax.world.scene import scene_distance

STAMPS = jnp.asarray([0.0, 2.5, 4.0, 7.9], jnp.float32)
PARAMS = SenseParams()
_sense = jax.jit(sense_sequence, static_argnums=(7, 8))


def _stack(arm, n=4):
    return Capsules(*(jnp.broadcast_to(v, (n, *v.shape)) for v in (arm.a, arm.b, arm.radius)))


@pytest.fixture(scope="module")
def frames(camera, scene, person, arm):
    return _sense(camera, scene, person, _stack(arm), STAMPS, jax.random.key(0), PARAMS, 96, 512)


def _to_person(person, t, x):
    capsules = person_at(person, t)
    distance = jax.vmap(jax.vmap(point_segment_distance, in_axes=(None, 0, 0)), in_axes=(0, None, None))
    return np.min(distance(x, capsules.a, capsules.b) - capsules.radius, axis=1)


def test_static_points_lie_on_the_obstacles(frames, scene):
    assert frames.static.points.shape == (96, 3) and not bool(frames.static_overflow)
    points = frames.static.points[np.asarray(frames.static.mask)]
    assert len(points) >= 15
    distance = jax.vmap(lambda x: scene_distance(scene, x, table=False))(points)
    assert np.abs(distance).max() < 0.04
    assert np.abs(np.median(distance)) < 0.015
    for k in range(4):  # every column is seen
        beside = np.linalg.norm(np.asarray(points)[:, :2] - np.asarray(scene.center)[k, :2], axis=1)
        assert beside.min() < 0.06


def test_moving_points_lie_on_the_person(frames, person):
    assert frames.moving.points.shape == (4, 512, 3) and frames.moving.mask.shape == (4, 512)
    np.testing.assert_array_equal(frames.stamp, STAMPS)
    assert np.asarray(frames.valid).all() and not np.asarray(frames.overflow).any()
    for k, t in enumerate(STAMPS):
        points = frames.moving.points[k][np.asarray(frames.moving.mask[k])]
        if k in (1, 2):
            assert len(points) > 80
        if len(points):
            distance = _to_person(person, float(t), points)
            assert np.mean(np.abs(distance) < 0.05) > 0.95
    hand = person_at(person, 4.0).b[9]
    x = frames.moving.points[2][np.asarray(frames.moving.mask[2])]
    assert np.min(np.linalg.norm(x - hand, axis=1)) < 0.13  # the hand in the path is among them


def test_nobody_leaves_next_to_nothing(camera, scene, arm):
    empty = nobody(scene)
    frames = _sense(camera, scene, empty, _stack(arm), STAMPS, jax.random.key(2), PARAMS, 96, 512)
    assert int(frames.moving.mask.sum(axis=1).max()) <= 2
    assert np.asarray(frames.valid).all()


def test_overflow_keeps_the_nearest_to_the_robot(camera, scene, person, arm, frames):
    few = _sense(camera, scene, person, _stack(arm), STAMPS, jax.random.key(0), PARAMS, 8, 16)
    assert bool(few.static_overflow)
    np.testing.assert_array_equal(few.overflow, np.asarray(few.moving.mask).all(axis=1))
    assert np.asarray(few.overflow)[2]
    all_static = np.linalg.norm(frames.static.points, axis=1)[np.asarray(frames.static.mask)]
    np.testing.assert_allclose(np.linalg.norm(few.static.points, axis=1), np.sort(all_static)[:8], atol=1e-5)


def test_blind_camera_is_not_an_empty_cell(camera, scene, person, arm):
    near = eqx.tree_at(lambda p: p.noise, PARAMS, NoiseParams(far=0.5))
    frames = _sense(camera, scene, person, _stack(arm), STAMPS, jax.random.key(0), near, 96, 512)
    assert not np.asarray(frames.valid).any()
    assert not np.asarray(frames.moving.mask).any()


def test_threshold_crop_and_body(camera, scene, person, arm):
    image = render_scene(camera, scene)
    lower, upper = crop_box(PARAMS, jnp.dtype("float32"))
    np.testing.assert_allclose(lower, [-2, -2, 0.03])
    np.testing.assert_allclose(upper, [2, 2, 1.3])
    depth = render_capsules(camera, arm, render_capsules(camera, person_at(person, 4.0), image))
    cloud = points_of(camera, depth, arm, PARAMS)
    points = cloud.points[np.asarray(cloud.mask)]
    assert (points[:, 2] >= 0.03).all()
    on_arm = jax.vmap(lambda x: jnp.min(jax.vmap(point_segment_distance, in_axes=(None, 0, 0))(x, arm.a, arm.b)))(
        points
    )
    assert float(np.min(on_arm)) > 1.1 * 0.06 + 0.05 - 1e-5
    static, _ = background(camera, image, arm, jax.random.key(0), PARAMS, capacity=96)
    moving, _ = moving_points(camera, depth, arm, static, PARAMS, 512)
    x = moving.points[np.asarray(moving.mask)]
    truth = np.asarray(jax.vmap(lambda p: scene_distance(scene, p, table=False))(x))
    assert truth.min() > 0.02  # none of the obstacles moves
    wide, _ = moving_points(camera, depth, arm, static, SenseParams(threshold=0.3), 512)
    assert int(wide.mask.sum()) < int(moving.mask.sum())


def test_frames_repeat_differ_by_key_and_check_their_count(camera, scene, person, arm, frames):
    again = _sense(camera, scene, person, _stack(arm), STAMPS, jax.random.key(0), PARAMS, 96, 512)
    np.testing.assert_array_equal(again.moving.points, frames.moving.points)
    other = _sense(camera, scene, person, _stack(arm), STAMPS, jax.random.key(5), PARAMS, 96, 512)
    assert not np.array_equal(other.moving.points, frames.moving.points)
    with pytest.raises(ValueError, match="3 poses of the arm for 4 stamps"):
        sense_sequence(camera, scene, person, _stack(arm, 3), STAMPS, jax.random.key(0), PARAMS)
