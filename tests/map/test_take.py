"""The whole way of an image into the map: what flies, the robot, what is outside; and frames that are refused."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.capsules import Capsules
from hrcjax.map import FrameParams, empty_map, initial_stream, make_view, map_points, take_frame
from hrcjax.map.clean import drop_lonely, within_box, without_body
from hrcjax.map.stream import BAD_POSE, REPEATED
from hrcjax.sense import d435i
from hrcjax.sense.camera import render_capsules, render_scene
from hrcjax.world.scene import BOX
from hrcjax.world.scenes import Obstacle, make_scene

EYE = (0.0, -0.9, 0.8)


@pytest.fixture(scope="module")
def camera():
    return d435i(jnp.asarray(EYE, jnp.float32), jnp.asarray([0.0, 0.05, 0.05], jnp.float32), 2)


@pytest.fixture(scope="module")
def arm() -> Capsules:
    """A link across the view, some centimetres thick, and one that does not exist."""
    a, b = jnp.asarray([[-0.3, -0.2, 0.25], [0.0] * 3]), jnp.asarray([[0.3, -0.2, 0.25], [0.0] * 3])
    return Capsules(a.astype(jnp.float32), b.astype(jnp.float32), jnp.asarray([0.04, -1.0], jnp.float32))


@pytest.fixture(scope="module")
def image(camera):
    box = Obstacle(BOX, (0.1, 0.1, 0.06), (0.05, 0.05, 0.06), 0.0, 0.1)
    scene = make_scene([box], (0.0,) * 3, (0.1,) * 3, (0.0,) * 3, (1.0,) * 3)
    return jax.jit(lambda: render_scene(camera, scene))()


@pytest.fixture(scope="module")
def take(layout, camera):
    def one(state, stream, stamp, depth, body):
        return take_frame(layout, FrameParams(), state, stream, stamp, camera, depth, body, tile=2)

    return jax.jit(one)


def to_axis(points, arm) -> np.ndarray:
    """Distance of points to the axis of the first link, which lies along x."""
    a, b = np.asarray(arm.a[0]), np.asarray(arm.b[0])
    foot = np.clip(points[:, :1], a[0], b[0]) * [1.0, 0.0, 0.0] + a * [0.0, 1.0, 1.0]
    return np.linalg.norm(points - foot, axis=1)


def test_pixels_between_front_and_back_are_lost(camera) -> None:
    depth = np.full((240, 320), 1.2)
    depth[100:140, 100:180] = 0.8
    depth[100:140, 98:100] = np.random.default_rng(0).uniform(0.85, 1.15, (40, 2))  # they hang between
    clean = drop_lonely(make_view(camera, jnp.asarray(depth, jnp.float32), 4e-3, tile=2), camera)
    z = np.sum((np.asarray(clean.points) - np.asarray(camera.position)) * np.asarray(camera.rotation)[:, 2], axis=1)
    kept = z[np.asarray(clean.mask)]
    assert (np.abs(kept - 0.8) < 1e-3).sum() > 600 and (np.abs(kept - 1.2) < 1e-3).sum() > 15000
    assert (np.abs(kept - 1.0) < 0.15).sum() <= 1  # of 20 tiles


def test_the_robot_is_no_surface_and_hides_what_is_behind(layout, camera, image, take, arm) -> None:
    state, stream = empty_map(layout), initial_stream()
    for k in range(3):
        state, stream, _, refused = take(state, stream, jnp.float32(0.03 * k), image, None)
        assert int(refused) == 0
    before = map_points(state, 4096).cloud
    for k in range(3, 8):
        seen = render_capsules(camera, arm, image)
        state, stream, report, _ = take(state, stream, jnp.float32(0.03 * k), seen, arm)
    after, _, _, more = map_points(state, 4096)
    known, now = (np.asarray(c.points)[np.asarray(c.mask)] for c in (before, after))
    assert not bool(more) and int(report.removed) == 0
    assert to_axis(now, arm).min() > 0.09
    assert len(now) > 0.99 * len(known)  # those in the robot's shadow too


def test_a_ghost_within_the_robot_goes_though_nothing_sees_through_it(layout, camera, image, take, arm) -> None:
    state, stream = empty_map(layout), initial_stream()
    seen = render_capsules(camera, arm, image)
    for k in range(3):  # taken for a thing that stands there
        state, stream, _, _ = take(state, stream, jnp.float32(0.03 * k), seen, None)
    cloud = map_points(state, 4096).cloud
    points = np.asarray(cloud.points)[np.asarray(cloud.mask)]
    assert (to_axis(points, arm) < 0.05).sum() > 50
    thick = Capsules(arm.a, arm.b, arm.radius + 0.02)
    state, _, report, _ = take(state, stream, jnp.float32(0.09), seen, thick)
    cloud = map_points(state, 4096).cloud
    points = np.asarray(cloud.points)[np.asarray(cloud.mask)]
    assert int(report.removed) > 50 and (to_axis(points, arm) < 0.045).sum() == 0


def assert_same_points(state, other) -> None:
    for one, two in zip(map_points(state, 4096), map_points(other, 4096), strict=True):
        jax.tree.map(np.testing.assert_array_equal, one, two)
    np.testing.assert_array_equal(state.information, other.information)
    np.testing.assert_array_equal(state.missed, other.missed)


def test_a_refused_frame_changes_nothing(layout, image, arm, take) -> None:
    state, stream, _, _ = take(empty_map(layout), initial_stream(), jnp.float32(1.0), image, None)
    nearer = jnp.where(image > 0, image - 0.3, 0.0)
    again, kept, report, refused = take(state, stream, jnp.float32(1.0), nearer, None)
    assert int(refused) == REPEATED and int(report.dynamic) == int(report.new) == 0
    assert_same_points(again, state)
    assert float(kept.stamp) == 1.0
    low = dataclasses.replace(arm, a=arm.a.at[:, 2].set(0.0), b=arm.b.at[:, 2].set(0.0))  # it lies on the table
    again, _, _, refused = take(state, stream, jnp.float32(1.0), image, low)
    assert int(refused) == REPEATED
    assert_same_points(again, state)
    _, _, report, _ = take(state, stream, jnp.float32(1.03), image, low)
    assert int(report.removed) > 5  # believed, it takes away what would be within the robot


def test_a_robot_that_is_not_finite_refuses_the_frame(layout, image, arm, take) -> None:
    state, stream, _, _ = take(empty_map(layout), initial_stream(), jnp.float32(1.0), image, None)
    for broken in (
        dataclasses.replace(arm, a=arm.a.at[0, 1].set(jnp.nan)),
        dataclasses.replace(arm, radius=arm.radius.at[0].set(jnp.inf)),
    ):
        again, kept, _, refused = take(state, stream, jnp.float32(1.03), image, broken)
        assert int(refused) == BAD_POSE and float(kept.stamp) == 1.0
        assert_same_points(again, state)


def test_what_is_hidden_is_counted_and_not_if_the_robot_hides_it(layout, image, arm, take) -> None:
    state, stream, _, _ = take(empty_map(layout), initial_stream(), jnp.float32(0.0), image, None)
    screen = jnp.full_like(image, 0.5)
    for k in range(1, 4):
        state, stream, _, refused = take(state, stream, jnp.float32(0.03 * k), screen, None)
        assert int(refused) == 0
        points = map_points(state, 4096)
        behind = np.asarray(points.cloud.mask) & (np.asarray(points.cloud.points)[:, 2] < 0.2)
        assert behind.sum() > 200 and (np.asarray(points.unmet)[behind] == k).mean() > 0.9
    state, stream, _, _ = take(state, stream, jnp.float32(0.12), image, None)
    points = map_points(state, 4096)
    low = np.asarray(points.cloud.mask) & (np.asarray(points.cloud.points)[:, 2] < 0.15)
    assert (np.asarray(points.unmet)[low] == 0).mean() > 0.9  # met again
    eye, foot = jnp.asarray(EYE, jnp.float32), jnp.asarray([0.0, 0.05, 0.05], jnp.float32)
    middle = eye + 0.5 / jnp.linalg.norm(foot - eye) * (foot - eye)  # the screen is the robot's, all of it
    ball = Capsules(jnp.stack([middle, middle]), jnp.stack([middle, middle]), jnp.asarray([0.6, -1.0], jnp.float32))
    before = np.asarray(state.unmet)
    state, _, _, refused = take(state, stream, jnp.float32(0.15), screen, ball)
    assert int(refused) == 0
    points = map_points(state, 4096)
    far = np.linalg.norm(np.asarray(points.cloud.points) - np.asarray(middle), axis=1) > 0.7
    assert (far & np.asarray(points.cloud.mask)).sum() > 100
    assert (np.asarray(points.unmet)[far & np.asarray(points.cloud.mask)] <= before.max()).all()
    assert (np.asarray(points.unmet)[far & np.asarray(points.cloud.mask)] == 0).mean() > 0.9


def test_what_is_outside_the_box_is_not_taken(camera, image, arm) -> None:
    view = make_view(camera, image, 4e-3, tile=2)
    lower, upper = jnp.asarray([-0.2, -0.2, 0.05], jnp.float32), jnp.asarray([0.2, 0.2, 0.5], jnp.float32)
    inside = np.asarray(view.points)[np.asarray(within_box(view, lower, upper).mask)]
    assert len(inside) > 50 and (inside > lower).all() and (inside < upper).all()
    np.testing.assert_array_equal(within_box(view, lower, upper).depth, view.depth)
    none = dataclasses.replace(arm, radius=-jnp.ones_like(arm.radius))
    np.testing.assert_array_equal(without_body(view, camera, none).mask, view.mask)


def test_more_points_than_places_are_said(layout, image, take) -> None:
    state, _, _, _ = take(empty_map(layout), initial_stream(), jnp.float32(0.0), image, None)
    few, labels, _, more = map_points(state, 10)
    assert bool(more) and np.asarray(few.mask).all() and labels.shape == (10,)
