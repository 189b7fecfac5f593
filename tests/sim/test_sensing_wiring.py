"""What the map tells frame by frame, and what sensing makes of it: a map in the test's hands in place of the real one."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.map import DYNAMIC, NEW, STATIC, FrameReport, MapPoints
from hrcjax.sense import d435i
from hrcjax.sim import sensing
from hrcjax.sim.sensing import SETUP_FRAMES, SenseParams, sense_sequence
from hrcjax.world import motion_named, scene_named

FRAMES = 5
STAMPS = jnp.asarray(1.0 + np.arange(FRAMES) / 30, jnp.float32)
WHOLE = np.zeros(SETUP_FRAMES + FRAMES)


@pytest.fixture
def sensed(monkeypatch: pytest.MonkeyPatch):
    """(points and what else the map says, each by image) -> frames."""
    camera = d435i(jnp.asarray([1.4, 0.15, 1.3], jnp.float32), jnp.asarray([0.4, 0.5, 0.1], jnp.float32), 16)
    scene = scene_named("robotica", 0)
    person = motion_named("nobody", scene, 0, 2.0, 30.0)
    axis = jnp.zeros((FRAMES, 1, 3), jnp.float32)
    arm = Capsules(axis, axis + 0.1, jnp.full((FRAMES, 1), 0.05, jnp.float32))

    def run(at_points=None, labels=None, unmet=None, more=WHOLE, refused=WHOLE, places=(8, 8), **report):
        count = len(WHOLE)
        points = np.zeros((count, 1, 3)) if at_points is None else at_points
        labels = np.full(points.shape[:2], STATIC) if labels is None else labels
        unmet = np.zeros(points.shape[:2]) if unmet is None else unmet
        of = {name: jnp.asarray(report.pop(name, WHOLE), jnp.int32) for name in FIELDS}
        assert not report, "no such number in the report"

        def take_frame(layout, params, state, stream, stamp, *_):
            k = state.frames
            numbers = FrameReport(**{name: column[k] for name, column in of.items()})
            return dataclasses.replace(state, frames=k + 1), stream, numbers, jnp.asarray(refused, jnp.int32)[k]

        def map_points(state, most):
            k = state.frames - 1
            cloud = Cloud(jnp.asarray(points, jnp.float32)[k], jnp.ones(points.shape[1], bool))
            told = (jnp.asarray(v, jnp.int32)[k] for v in (labels, unmet))
            return MapPoints(cloud, *told, jnp.asarray(more, bool)[k])

        monkeypatch.setattr(sensing, "take_frame", take_frame)
        monkeypatch.setattr(sensing, "map_points", map_points)
        key, params, layout = jax.random.key(0), SenseParams(), sensing.CELL_LAYOUT
        return jax.jit(lambda stamps: sense_sequence(camera, scene, person, arm, stamps, key, params, layout, *places))(
            STAMPS
        )

    return run


FIELDS = [field.name for field in dataclasses.fields(FrameReport)]


def at(*images: int) -> np.ndarray:
    """1 at these images, counted from the first; the cell is empty in the first SETUP_FRAMES."""
    return np.isin(np.arange(SETUP_FRAMES + FRAMES), images).astype(int)


def points_of(cloud: Cloud, frame=None) -> list[list[float]]:
    points, mask = (np.asarray(v if frame is None else v[frame]) for v in (cloud.points, cloud.mask))
    return sorted(np.round(points[mask].astype(float), 4).tolist())


@pytest.mark.parametrize("name", ["lost", "unseen", "left_out", "more"])
def test_whatever_is_left_out_of_the_map_is_told(sensed, name: str) -> None:
    frames = sensed(**{name: at(SETUP_FRAMES + 1, SETUP_FRAMES + 4)})
    assert np.asarray(frames.overflow).tolist() == [False, True, False, False, True]
    assert not bool(frames.static_overflow)
    for image in (0, SETUP_FRAMES - 1):
        frames = sensed(**{name: at(image)})
        assert bool(frames.static_overflow) and not np.asarray(frames.overflow).any()


def test_what_is_no_lack_of_places_is_no_overflow(sensed) -> None:
    everywhere = at(*range(SETUP_FRAMES + FRAMES))
    others = {name: everywhere for name in FIELDS if name not in ("lost", "unseen", "left_out")}
    frames = sensed(**others)
    assert not np.asarray(frames.overflow).any() and not bool(frames.static_overflow)


def test_a_refused_image_says_nothing(sensed) -> None:
    frames = sensed(refused=4 * at(3, SETUP_FRAMES + 2))
    assert np.asarray(frames.valid).tolist() == [True, True, False, True, True]
    np.testing.assert_array_equal(frames.stamp, STAMPS)


def test_what_stood_there_is_what_the_last_empty_image_knows_as_static(sensed) -> None:
    points = np.zeros((SETUP_FRAMES + FRAMES, 3, 3))
    points[:] = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 0.7]])
    points[: SETUP_FRAMES - 1] += 0.3  # before it was elsewhere
    points[SETUP_FRAMES:] += 0.6  # and later too
    labels = np.tile([NEW, STATIC, DYNAMIC], (SETUP_FRAMES + FRAMES, 1))
    assert points_of(sensed(points, labels).static) == [[0.0, 1.0, 0.5]]


def test_what_moves_is_far_from_what_stood_there_and_was_met_lately(sensed) -> None:
    points = np.zeros((SETUP_FRAMES + FRAMES, 4, 3))
    points[:] = [0.5, 0.0, 0.5]
    first = SETUP_FRAMES
    points[first:, 1, 0] = 0.5 + 0.079  # nearer than the threshold of 8 cm
    points[first:, 2, 0] = 0.5 + 0.081  # farther
    points[first:, 3, 1] = 0.2
    unmet = np.zeros((SETUP_FRAMES + FRAMES, 4))
    unmet[first:, 3] = [0, 1, 2, 127, 0]  # forgotten after two images that did not meet it
    labels = np.full(points.shape[:2], STATIC)
    labels[first:] = NEW
    frames = sensed(points, labels, unmet)
    assert points_of(frames.static) == [[0.5, 0.0, 0.5]]
    near, side = [0.581, 0.0, 0.5], [0.5, 0.2, 0.5]
    assert [points_of(frames.moving, k) for k in range(FRAMES)] == [
        [side, near],
        [side, near],
        [near],
        [near],
        [side, near],
    ]


def test_clouds_without_places_keep_the_nearest_to_the_robot_and_say_so(sensed) -> None:
    points = np.zeros((SETUP_FRAMES + FRAMES, 3, 3))
    points[:] = np.array([[1.5, 0.0, 0.5], [0.3, 0.0, 0.5], [0.9, 0.0, 0.5]])
    points[SETUP_FRAMES + 2 :, 0] = [0.0, 0.4, 0.5]
    points[SETUP_FRAMES + 2 :, 2] = [0.0, 0.7, 0.5]
    few = sensed(points, places=(2, 1))
    assert bool(few.static_overflow) and points_of(few.static) == [[0.3, 0.0, 0.5], [0.9, 0.0, 0.5]]
    enough = sensed(points, places=(3, 1))
    assert not bool(enough.static_overflow)
    assert np.asarray(enough.overflow).tolist() == [False, False, True, True, True]
    assert points_of(enough.moving, 4) == [[0.0, 0.4, 0.5]]
