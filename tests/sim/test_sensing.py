"""What was sensed lies on what is there, and on nothing else; what a camera suffers is told."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.field.grid import GridLayout, fit_grid
from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import point_segment_distance
from hrcjax.presence import CELL_VOXELS, centres, unpack_columns
from hrcjax.robot import Arm, arm_capsules
from hrcjax.sense import FaultSchedule, health, join_faults, no_faults, one_fault
from hrcjax.sense import faults as faulty
from hrcjax.sense.camera import render_scene
from hrcjax.sense.rig import Rig, cell_rig, exposures
from hrcjax.sim import Cell, SenseParams, sense_sequence
from hrcjax.sim.prepare import posture_at
from hrcjax.sim.scan import scan_postures
from hrcjax.sim.sensing import Frames
from hrcjax.sim.survey import SCENE_LAYOUT, STILL, Survey, crop_box, survey
from hrcjax.sim.watch import stage_of
from hrcjax.world import Person, Scene, motion_named, person_at, scene_distance, scene_named

BEGIN, END = 2.4, 3.2
"""The hand goes into the path meanwhile [s]."""
PERIOD = 1 / 15
LATENCY = 0.05
PARAMS = SenseParams()
SHORT = SenseParams(settled=1000.0)
"""The set-up ends with the scan: in small images the map does not settle."""
DUMMY = fit_grid(GridLayout((0.0, 0.0, 0.0), (4, 4, 4), 0.1), jnp.zeros((4, 4, 4), jnp.float32))
STAMPS, CAMERAS = exposures((15.0, 15.0), BEGIN, END)
_sense = jax.jit(sense_sequence, static_argnums=(0, 1, 2))
_stage = jax.jit(stage_of)


class Place(NamedTuple):
    """A scene with its cameras, an arm at its start, and the survey."""

    scene: Scene
    rig: Rig
    arm: Arm
    q: jax.Array
    survey: Survey


def surveyed(cell: Cell, name: str, seed: int, decimation: int, params: SenseParams = PARAMS) -> Place:
    scene = scene_named(name, seed)
    rig, q = cell_rig(scene, decimation=decimation), posture_at(cell, scene.start)
    postures = scan_postures(cell.arm, scene, q)
    found = survey(cell.arm, SCENE_LAYOUT, CELL_VOXELS, rig, scene, postures, jax.random.key(0), params)
    return Place(scene, rig, cell.arm, q, found)


@pytest.fixture(scope="module")
def place(cell: Cell) -> Place:
    """The papers' scene."""
    return surveyed(cell, "robotica", 0, 8, SHORT)


@pytest.fixture(scope="module")
def cluttered(cell: Cell) -> Place:
    """A scene of many obstacles."""
    return surveyed(cell, "clutter", 1, 8, SHORT)


@pytest.fixture(scope="module")
def person(place: Place) -> Person:
    return motion_named("reach_in", place.scene, 0, 8.0, 30.0)


def sense(
    place: Place,
    person: Person,
    faults: FaultSchedule | None = None,
    key: int = 0,
    capacity: int = 1152,
    stamps=STAMPS,
    cameras=CAMERAS,
) -> Frames:
    one = arm_capsules(place.arm, place.q)
    robot = jax.tree.map(lambda v: jnp.broadcast_to(v, (len(STAMPS), *v.shape)), one)
    stage = _stage(place.rig, place.scene, person, no_faults(2) if faults is None else faults)
    times, cameras = jnp.asarray(stamps, jnp.float32), jnp.asarray(cameras)
    return _sense(
        CELL_VOXELS, capacity, LATENCY, place.survey, DUMMY, stage, robot, times, cameras, jax.random.key(key), PARAMS
    )  # fmt: skip


@pytest.fixture(scope="module")
def frames(place: Place, person: Person) -> Frames:
    return sense(place, person)


def points_of(frames: Frames, k: int) -> np.ndarray:
    return np.asarray(frames.moving.points[k])[np.asarray(frames.moving.mask[k])]


def to_person(person: Person, t: float, x: np.ndarray) -> np.ndarray:
    capsules = person_at(person, t)
    distance = jax.vmap(jax.vmap(point_segment_distance, in_axes=(None, 0, 0)), in_axes=(0, None, None))
    return np.min(np.asarray(distance(x, capsules.a, capsules.b) - capsules.radius), axis=1)


def map_points_of(survey: Survey) -> np.ndarray:
    rows = np.moveaxis(np.asarray(survey.map.levels[0].rows), 1, 2).reshape(-1, 4)
    return rows[rows[:, 3] > 0, :3]


# the set-up -----------------------------------------------------------------------------------------------------------


def test_the_set_up_ends_with_the_scan_of_thirteen_postures(place: Place) -> None:
    assert bool(place.survey.settled) and int(place.survey.rounds) == 12 + STILL and not bool(place.survey.overflow)


@pytest.mark.parametrize("which", ["place", "cluttered"])
def test_the_map_has_every_obstacle_and_nothing_else(which: str, request: pytest.FixtureRequest) -> None:
    place: Place = request.getfixturevalue(which)
    scene, points = place.scene, map_points_of(place.survey)
    distance = np.abs(np.asarray(jax.vmap(lambda x: scene_distance(scene, x))(jnp.asarray(points))))
    # points behind the crop box's lower side are none; edges of images in small pixels are less sharp
    assert np.median(distance) < 0.01 and np.quantile(distance, 0.95) < 0.05 and distance.max() < 0.15
    for k in np.flatnonzero(np.asarray(scene.mask)):
        beside = np.abs(np.linalg.norm(points - np.asarray(scene.center)[k], axis=1))
        assert (beside < float(np.linalg.norm(scene.size[k])) + 0.03).sum() >= 8, f"obstacle {k}"


@pytest.mark.parametrize("which", ["place", "cluttered"])
def test_what_is_watched_was_free_and_what_stands_there_is_not(which: str, request: pytest.FixtureRequest) -> None:
    place: Place = request.getfixturevalue(which)
    x = centres(CELL_VOXELS, jnp.float32)
    gap = np.asarray(jax.jit(jax.vmap(lambda x: scene_distance(place.scene, x)))(x))
    watched = np.asarray(unpack_columns(CELL_VOXELS, place.survey.empty.watched))
    assert watched.mean() > 0.3
    assert not watched[gap < -0.025].any(), "inside of an obstacle"
    near = np.linalg.norm(np.asarray(x) - np.asarray((place.scene.start + place.scene.goal) / 2), axis=1) < 0.3
    assert watched[near & (gap > 0.15)].mean() > 0.9, "about the path all free space is"
    unseen = np.asarray(place.survey.unseen)
    assert not (unseen & watched).any()
    lower, upper = (np.asarray(v) for v in crop_box(PARAMS, jnp.dtype("float32")))
    assert not unseen[~np.all((np.asarray(x) > lower) & (np.asarray(x) < upper), axis=1)].any()


def test_the_settled_picture_is_that_of_the_empty_cell(place: Place) -> None:
    settled = np.asarray(place.survey.empty.settled)
    exact = np.asarray(jax.vmap(lambda c: render_scene(c, place.scene))(place.rig.cameras))
    known = (settled > 0) & np.isfinite(exact)
    assert known[exact < 2.0].mean() > 0.95, "all that is near is known"
    error = (settled - exact)[known]
    assert np.median(np.abs(error)) < 0.01 and np.mean(np.abs(error) < 0.05) > 0.9


def test_crop_box() -> None:
    lower, upper = crop_box(PARAMS, jnp.dtype("float32"))
    np.testing.assert_allclose(lower, [-2, -2, 0.03])
    np.testing.assert_allclose(upper, [2, 2, 1.3])


# people ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", ["place", "cluttered"])
def test_an_empty_cell_has_no_moving_point(which: str, request: pytest.FixtureRequest) -> None:
    place: Place = request.getfixturevalue(which)
    nobody = motion_named("nobody", place.scene, 0, 8.0, 30.0)
    frames = sense(place, nobody, key=1)
    assert not np.asarray(frames.moving.mask).any() and np.asarray(frames.valid).all()
    assert not np.asarray(frames.guarded).any() and not np.asarray(frames.reasons).any()


def test_moving_points_lie_on_the_person(frames: Frames, person: Person) -> None:
    """Points of his hidden sides within two voxels of him; those in the path are on his hand."""
    assert frames.moving.points.shape == (24, 1152, 3) and frames.beyond.shape == (24,)
    assert np.asarray(frames.valid).all() and not np.asarray(frames.reasons).any()
    for k in (3, 12, 23):
        points = points_of(frames, k)
        assert len(points) > 150
        distance = to_person(person, float(STAMPS[k]), points)
        assert distance.max() < 0.15 and distance.min() > -0.15
        assert np.mean(np.abs(distance) < 0.05) > 0.6
    hand = np.asarray(person_at(person, float(STAMPS[23])).b[9])
    assert np.min(np.linalg.norm(points_of(frames, 23) - hand, axis=1)) < 0.1


def test_the_surface_that_cameras_see_has_points_beside_it(frames: Frames, place: Place, person: Person) -> None:
    """Nothing that a camera shows is farther than a voxel from a point, as far as the arm reaches."""
    k = 23
    camera = jax.tree.map(lambda a: a[int(CAMERAS[k])], place.rig.cameras)
    capsules = person_at(person, float(STAMPS[k]))
    nearest = np.linalg.norm(np.asarray(capsules.b)[9])
    assert nearest < 1.1 and isinstance(capsules, Capsules)
    toward = np.asarray(camera.position) - np.asarray(capsules.b)[9]
    tip = np.asarray(capsules.b)[9] + float(capsules.radius[9]) * toward / np.linalg.norm(toward)
    assert np.min(np.linalg.norm(points_of(frames, k) - tip, axis=1)) < 0.07


def test_where_a_hand_was_nothing_is_left(frames: Frames, person: Person) -> None:
    before, after = (np.asarray(person_at(person, float(STAMPS[k])).b[9]) for k in (10, 23))
    assert np.linalg.norm(after - before) > 0.05
    left = points_of(frames, 23)
    far = left[np.linalg.norm(left - before, axis=1) < 0.1]
    assert len(far) == 0 or np.max(to_person(person, float(STAMPS[23]), far)) < 0.12


def test_a_full_cloud_keeps_the_nearest_and_bounds_the_rest(place: Place, person: Person, frames: Frames) -> None:
    few = sense(place, person, capacity=24)
    for k in (3, 23):
        every, kept = points_of(frames, k), points_of(few, k)
        far = np.linalg.norm(every, axis=1)
        np.testing.assert_allclose(kept, every[:24], atol=1e-6)
        assert 0 < float(few.beyond[k]) <= far[24:].min()
        assert float(frames.beyond[k]) == 10.0


# faults ---------------------------------------------------------------------------------------------------------------

FAULT = (BEGIN + 0.31, BEGIN + 0.59)
"""Four images of each camera."""
NAMED = {
    faulty.FROZEN: health.IDENTICAL,
    faulty.BLOCKED: health.BLOCKED_VIEW,
    faulty.BLURRED: health.BLURRED_VIEW,
    faulty.HALF_EMPTY: health.PART_EMPTY,
    faulty.DROPPED: health.NO_IMAGE,
    faulty.LATE: health.LATE_ARRIVAL,
    faulty.SKEWED: health.SKEWED_STAMP,
}


@pytest.mark.parametrize("kind", NAMED)
@pytest.mark.parametrize("camera", [0, 1])
def test_what_a_camera_suffers_is_told_of_it_and_in_its_time(
    place: Place, person: Person, kind: int, camera: int
) -> None:
    frames = sense(place, person, one_fault(kind, camera, *FAULT, 2))
    bad = (camera == CAMERAS) & (FAULT[0] <= STAMPS) & (FAULT[1] > STAMPS)
    assert bad.sum() >= 4
    np.testing.assert_array_equal(frames.valid, ~bad)
    np.testing.assert_array_equal(frames.camera, CAMERAS)
    reasons = np.asarray(frames.reasons)
    assert not reasons[:, 1 - camera].any()
    # until the camera's next good image
    last, good = np.zeros(len(STAMPS), bool), np.full(len(STAMPS), BEGIN)
    for k in range(len(STAMPS)):
        own = CAMERAS[k] == camera
        last[k] = bad[k] if own else (last[k - 1] if k else False)
        good[k] = STAMPS[k] if own and not bad[k] else (good[k - 1] if k else BEGIN)
    np.testing.assert_array_equal((reasons[:, camera] & NAMED[kind]) > 0, last)
    np.testing.assert_array_equal(reasons[:, camera] > 0, last)
    missing = STAMPS - good >= float(PARAMS.presence.late) * PERIOD
    assert 4 <= missing.sum() < len(STAMPS)
    # slowed from the first refused image on
    guarded = np.asarray(frames.guarded)
    assert guarded[missing | last].all() and not guarded[: np.argmax(bad)].any()


def test_after_a_fault_an_empty_cell_is_empty_again(place: Place) -> None:
    """While a camera is missing the arm is slowed, and nobody is made up."""
    nobody = motion_named("nobody", place.scene, 0, 8.0, 30.0)
    frames = sense(place, nobody, one_fault(faulty.DROPPED, 0, *FAULT, 2))
    dropped = (CAMERAS == 0) & (FAULT[0] <= STAMPS) & (FAULT[1] > STAMPS)
    first, last = np.flatnonzero(dropped)[[0, -1]]
    guarded, some = np.asarray(frames.guarded), np.asarray(frames.moving.mask).any(axis=1)
    assert not guarded[:first].any() and guarded[first : last + 2].all() and not guarded[last + 2 :].any()
    assert not some.any()


@pytest.mark.parametrize("kind", [faulty.FROZEN, faulty.BLOCKED, faulty.PERSON_LOST])
def test_whom_one_camera_does_not_show_the_other_does(place: Place, person: Person, kind: int) -> None:
    frames = sense(place, person, one_fault(kind, 0, BEGIN, np.inf, 2))
    for k in (10, 23):
        assert int(CAMERAS[k]) == 1 or bool(frames.valid[k]) == (kind == faulty.PERSON_LOST)
        # in small images one camera alone does not resolve a hand: the body it does
        assert (np.abs(to_person(person, float(STAMPS[k]), points_of(frames, k))) < 0.07).sum() > 40


def test_both_cameras_blocked_leave_no_valid_frame(place: Place, person: Person) -> None:
    faults = join_faults(*(one_fault(faulty.BLOCKED, c, BEGIN + 0.2, np.inf, 2) for c in (0, 1)))
    frames = sense(place, person, faults)
    np.testing.assert_array_equal(frames.valid, STAMPS < BEGIN + 0.2)
    assert np.asarray(frames.guarded)[-5:].all()
    assert (np.asarray(frames.reasons)[-1] & health.BLOCKED_VIEW > 0).all()


def test_who_is_lost_to_both_cameras_stays_and_there_is_no_full_speed(place: Place, person: Person) -> None:
    """No image is refused: only the memory of him helps. Points stay where he was, and spread."""
    lost = BEGIN + 0.3
    faults = join_faults(*(one_fault(faulty.PERSON_LOST, c, lost, np.inf, 2) for c in (0, 1)))
    frames = sense(place, person, faults)
    assert np.asarray(frames.valid).all()
    after = lost + PERIOD <= STAMPS
    assert after.sum() >= 10
    np.testing.assert_array_equal(np.asarray(frames.guarded)[after], True)
    assert not np.asarray(frames.guarded)[lost > STAMPS].any()
    for k in np.flatnonzero(after):
        points = points_of(frames, k)
        capsules = person_at(person, float(STAMPS[k]))
        # nobody is nearer to the base than the points say, but for a voxel
        nearest = float(np.min(np.linalg.norm(np.asarray(capsules.b), axis=1) - np.asarray(capsules.radius)))
        assert len(points) > 100 and np.linalg.norm(points, axis=1).min() < nearest + 0.05


def test_who_is_lost_and_then_seen_through_is_gone(place: Place, person: Person) -> None:
    """The fault ends when nobody is there any more."""
    leaves = BEGIN + 0.5
    times = np.arange(person.present.shape[0]) / float(person.rate)
    gone = Person(person.a, person.b, person.radius, person.rate, jnp.asarray(times < leaves))
    faults = join_faults(*(one_fault(faulty.PERSON_LOST, c, BEGIN + 0.2, leaves, 2) for c in (0, 1)))
    frames = sense(place, gone, faults)
    after = np.flatnonzero(leaves + 2 * PERIOD < STAMPS)
    hand = np.asarray(person_at(person, leaves).b[9])
    assert len(after) >= 4
    for k in after:
        assert np.linalg.norm(points_of(frames, k) - hand, axis=1).min(initial=9.0) > 0.1, "both cameras look there"
    assert len(points_of(frames, after[-1])) < 0.5 * len(points_of(frames, after[0] - 5))


# repetition -----------------------------------------------------------------------------------------------------------


def test_frames_repeat_differ_by_key_and_check_their_count(place: Place, person: Person, frames: Frames) -> None:
    np.testing.assert_array_equal(sense(place, person).moving.points, frames.moving.points)
    assert not np.array_equal(sense(place, person, key=5).moving.points, frames.moving.points)
    with pytest.raises(ValueError, match="24 poses of the arm for 4 stamps"):
        sense(place, person, stamps=STAMPS[:4], cameras=CAMERAS[:4])
