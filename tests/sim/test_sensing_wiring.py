"""Which image is taken when, of what and by whom, and what becomes of it: map and track in the test's hands."""

import dataclasses
import importlib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.field.grid import GridLayout, fit_grid
from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.map import FrameReport, MapLayout, MapParams, empty_map
from hrcjax.presence import Empty, Presence, VoxelLayout
from hrcjax.presence.sight import all_sights
from hrcjax.robot import arm_capsules, tool_frame
from hrcjax.sense import faults, health, initial_health, join_faults, no_faults, one_fault, render_depth
from hrcjax.sense.camera import render_capsules
from hrcjax.sense.rig import Rig, cell_rig, hand_camera
from hrcjax.sim import Cell, SenseParams, sense_sequence
from hrcjax.sim import watch as watch_module
from hrcjax.sim.survey import MOST_ROUNDS, STILL, Survey
from hrcjax.sim.watch import stage_of
from hrcjax.world import motion_named, person_at, scene_named

survey_module = importlib.import_module("hrcjax.sim.survey")
"""The package has a function of this name."""
LAYOUT = MapLayout(lower=(-2.0, -2.0, 0.0), shape=(20, 20, 8), spacing=0.05, capacity=8, levels=2, refitted=0)
VOXELS = VoxelLayout((-2.0, -2.0, 0.0), (8, 8, 4), 0.5)
SCENE = scene_named("robotica", 0)
RIG = cell_rig(SCENE, decimation=16)
LATENCY = 0.05
STAMPS = jnp.asarray([1.0, 1.03, 1.07, 1.1, 1.13], jnp.float32)
CAMERAS = jnp.asarray([0, 1, 0, 1, 1], jnp.int32)
WORKER = motion_named("stand_and_work", SCENE, 0, 2.0, 30.0)


def robots() -> Capsules:
    """A ball over the table that is somewhere else in every image."""
    at = jnp.asarray([[0.2, 0.3, 0.4]], jnp.float32) + 0.1 * jnp.arange(5).astype(jnp.float32)[:, None]
    return Capsules(at[:, None], at[:, None], jnp.full((5, 1), 0.15, jnp.float32))


def surveyed(overflow: jax.Array) -> Survey:
    first = jax.tree.map(lambda a: a[0], RIG.cameras)
    image, columns = jnp.zeros((2, first.height, first.width), jnp.float32), jnp.zeros((8, 8), jnp.uint32)
    state = jax.tree.map(lambda a: jnp.stack([a, a]), initial_health(first.height, first.width))
    empty = Empty(image, all_sights(VOXELS, RIG.cameras), columns)
    unseen = jnp.arange(VOXELS.count) % 3 == 0
    return Survey(empty_map(LAYOUT, jnp.float32), empty, state, unseen, jnp.asarray(1), jnp.asarray(True), overflow)


@pytest.fixture(scope="module")
def watched():
    """(schedule, images after which a camera is missing or somebody lost) -> frames, and what track and judge were given."""
    taken, judged = [], []
    judge = watch_module.judge_image

    def program(schedule, missing, lost, overflow):
        def update_track(layout, params, empty, track, index, cameras, period, exposed, good, depth, robot, box):
            jax.debug.callback(lambda *v: taken.append(v), index, exposed, good, depth, robot, period, ordered=True)
            away = jnp.any(missing & (exposed == STAMPS))
            return eqx.tree_at(lambda t: (t.time, t.missing), track, (exposed, away))

        def presence_cloud(layout, params, empty, track, period, robot, capacity):
            points = jnp.broadcast_to(track.time, (capacity, 3)) + robot.a[0]
            there = jnp.any(lost & (track.time == STAMPS))
            return Presence(Cloud(points, jnp.arange(capacity) < 2), 2 * track.time, there)

        def judge_image(params, state, depth, stamp, arrived, learning):
            jax.debug.callback(lambda *v: judged.append(v), stamp, arrived, learning, state.stamp, ordered=True)
            return judge(params, state, depth, stamp, arrived, learning)

        scene = fit_grid(GridLayout((0.0, 0.0, 0.0), (4, 4, 4), 0.1), jnp.zeros((4, 4, 4), jnp.float32))
        with pytest.MonkeyPatch.context() as patch:
            for fake in (update_track, presence_cloud, judge_image):
                patch.setattr(watch_module, fake.__name__, fake)
            stage = stage_of(RIG, SCENE, WORKER, schedule)
            return sense_sequence(
                VOXELS,
                3,
                LATENCY,
                surveyed(overflow),
                scene,
                stage,
                robots(),
                STAMPS,
                CAMERAS,
                jax.random.key(0),
                SenseParams(),
            )

    compiled = jax.jit(program)

    def run(*schedules, missing=(), lost=(), overflow=False):
        taken.clear(), judged.clear()
        two = join_faults(*schedules, *[no_faults(2)] * (2 - len(schedules)))
        of = [jnp.asarray(np.isin(np.arange(5), images)) for images in (missing, lost)]
        frames = jax.block_until_ready(compiled(two, *of, jnp.asarray(overflow)))
        jax.effects_barrier()
        return frames, [np.stack(column) for column in zip(*taken, strict=True)], np.array(judged, float)

    return run


def test_every_image_is_of_its_own_camera_stamp_robot_and_people(watched) -> None:
    frames, (index, exposed, good, depth, robot, period), judged = watched()
    np.testing.assert_array_equal(index, CAMERAS)
    np.testing.assert_array_equal(exposed, STAMPS)
    np.testing.assert_allclose(period, 1 / 15, rtol=1e-6)
    assert good.all() and np.asarray(frames.valid).all()
    for k in range(5):
        camera = jax.tree.map(lambda a, k=k: a[CAMERAS[k]], RIG.cameras)
        arm = jax.tree.map(lambda a, k=k: a[k], robots())
        alone = render_capsules(camera, arm, jnp.full(depth[k].shape, jnp.inf, jnp.float32))
        np.testing.assert_allclose(robot[k], alone, rtol=1e-5)
        exact = np.asarray(render_depth(camera, SCENE, person_at(WORKER, STAMPS[k]), arm))
        measured = depth[k] > 0
        assert measured.mean() > 0.7
        noise = 0.08 / (385.0 * 0.05) * exact**2  # of a D435i [m]
        assert np.mean((np.abs(depth[k] - exact) < 0.001 + 3 * noise)[measured]) > 0.85
        assert np.median((np.abs(depth[k] - exact) / noise)[measured]) < 1.0
    np.testing.assert_allclose(judged[:, 0], STAMPS)
    np.testing.assert_allclose(judged[:, 1] - judged[:, 0], LATENCY, atol=1e-6)
    assert not judged[:, 2].any(), "nothing is learnt with people about"
    assert not np.isfinite(judged[:2, 3]).any()
    np.testing.assert_allclose(judged[2:, 3], STAMPS[jnp.asarray([0, 1, 3])], err_msg="each camera has its own memory")


def test_a_frame_is_what_the_track_tells_after_its_image(watched) -> None:
    frames, *_ = watched(missing=(2,), lost=(2, 3))
    assert frames.moving.points.shape == (5, 3, 3) and frames.moving.mask.tolist() == [[True, True, False]] * 5
    np.testing.assert_allclose(frames.moving.points[:, 0], STAMPS[:, None] + robots().a[:, 0], rtol=1e-6)
    np.testing.assert_allclose(frames.beyond, 2 * STAMPS)
    np.testing.assert_array_equal(frames.stamp, STAMPS)
    np.testing.assert_array_equal(frames.camera, CAMERAS)
    assert frames.guarded.tolist() == [False, False, True, True, False]
    assert watched(missing=(4,))[0].guarded.tolist() == [False] * 4 + [True]


def test_what_the_set_up_knew_goes_along(watched) -> None:
    for overflow in (False, True):
        frames = watched(overflow=overflow)[0]
        assert bool(frames.static_overflow) == overflow
        assert frames.unseen.shape == (VOXELS.count,) and int(frames.unseen.sum()) == len(range(0, VOXELS.count, 3))
        assert frames.map.levels[0].rows.shape[0] == LAYOUT.capacity
        assert not np.asarray(frames.scene.coefficients).any()


def test_a_missing_image_is_told_refused_and_not_remembered(watched) -> None:
    frames, (_, _, good, *_), judged = watched(one_fault(faults.DROPPED, 1, 1.0, 1.05, 2))
    assert good.tolist() == frames.valid.tolist() == [True, False, True, True, True]
    assert frames.reasons.tolist() == [[0, 0], [0, health.NO_IMAGE], [0, health.NO_IMAGE], [0, 0], [0, 0]]
    assert judged[3, 3] == -np.inf, "the next image is the first of this camera"


def test_stamps_and_delays_are_those_that_the_camera_gives(watched) -> None:
    skewed, late = one_fault(faults.SKEWED, 0, 1.05, 1.2, 2, -0.02), one_fault(faults.LATE, 1, 1.12, 1.2, 2, 0.3)
    frames, (_, exposed, good, *_), judged = watched(skewed, late)
    np.testing.assert_allclose(judged[:, 0], np.add(STAMPS, [0, 0, -0.02, 0, 0]), atol=1e-6)
    np.testing.assert_allclose(judged[:, 1], np.add(STAMPS + LATENCY, [0, 0, 0, 0, 0.3]), atol=1e-6)
    np.testing.assert_array_equal(exposed, STAMPS)
    assert good.tolist() == [True] * 4 + [False] and frames.reasons[-1].tolist() == [0, health.LATE_ARRIVAL]


# the set-up -----------------------------------------------------------------------------------------------------------

FIELDS = [field.name for field in dataclasses.fields(FrameReport)]


class Told(eqx.Module):
    """What the map reports of each image, in the place of its parameters."""

    map: MapParams
    report: dict[str, jax.Array]


@pytest.fixture(scope="module")
def set_up(cell: Cell):
    """(rig, report of each image) -> survey, the images taken (stamp, camera's place, arm's capsules), and the postures."""
    postures = jnp.asarray(cell.arm.home, jnp.float32) + 0.2 * jnp.arange(3).astype(jnp.float32)[:, None]
    taken = []

    def take_frame(layout, params, state, stream, stamp, camera, depth, body, box, tile):
        jax.debug.callback(lambda *v: taken.append(v), stamp, camera.position, body.a, ordered=True)
        assert tile == 1  # an image of 40 columns is not thinned
        numbers = FrameReport(**{name: column[state.frames] for name, column in params.report.items()})
        return dataclasses.replace(state, frames=state.frames + 1), stream, numbers, jnp.zeros((), jnp.int32)

    def program(rig, params):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(survey_module, "take_frame", take_frame)
            patch.setattr(survey_module, "settle", lambda layout, params, state: state)
            of_all = survey_module.survey.__wrapped__
            return of_all(cell.arm, LAYOUT, VOXELS, rig, SCENE, postures, jax.random.key(0), params)

    compiled = jax.jit(program)

    def run(rig: Rig = RIG, **report):
        taken.clear()
        of = {name: jnp.asarray(np.broadcast_to(report.pop(name, 0), (3 * MOST_ROUNDS,)), jnp.int32) for name in FIELDS}
        assert not report, "no such number in the report"
        found = jax.block_until_ready(
            compiled(rig, eqx.tree_at(lambda p: p.frame, SenseParams(), Told(MapParams(), of)))
        )
        jax.effects_barrier()
        return found, [np.stack(column) for column in zip(*taken, strict=True)], postures

    return run


def test_all_cameras_look_in_every_posture_and_then_from_the_last(cell: Cell, set_up) -> None:
    found, (stamps, eyes, bodies), postures = set_up()
    assert int(found.rounds) == 3 - 1 + STILL and bool(found.settled) and not bool(found.overflow)
    assert len(stamps) == 3 * int(found.rounds) and (np.diff(stamps) > 0).all()
    for k in range(len(stamps)):
        q = postures[min(k // 3, 2)]
        np.testing.assert_allclose(bodies[k], arm_capsules(cell.arm, q).a, atol=1e-5)
        expected = (
            hand_camera(RIG.hand, *tool_frame(cell.arm, q)).position if k % 3 == 2 else RIG.cameras.position[k % 3]
        )
        np.testing.assert_allclose(eyes[k], expected, atol=1e-5)
    np.testing.assert_array_equal(np.asarray(found.health.stamp), -np.inf)
    np.testing.assert_array_equal(np.asarray(found.health.learnt), int(found.rounds))


def test_without_a_camera_in_the_hand_the_others_look(set_up) -> None:
    found, (stamps, eyes, _), _ = set_up(cell_rig(SCENE, cameras=1, hand=False, decimation=16))
    assert len(stamps) == int(found.rounds) == 3 - 1 + STILL and found.empty.settled.shape[0] == 1
    np.testing.assert_allclose(eyes, np.broadcast_to(RIG.cameras.position[0], eyes.shape))


@pytest.mark.parametrize(
    ("until", "each", "rounds"),
    [(6, 1, 6 + STILL), (6, 0, 2 + STILL), (MOST_ROUNDS, 1, MOST_ROUNDS), (2, 5, 2 + STILL)],
)
def test_it_ends_after_three_rounds_with_no_more_than_two_changes(set_up, until: int, each: int, rounds: int) -> None:
    """One change in each of the three images of a round is too much; a restless map ends it, too, and is told."""
    which = np.arange(3 * MOST_ROUNDS) < 3 * until
    found, *_ = set_up(new=np.where(which, each, 0), removed=np.where(np.arange(which.size) % 3 == 0, 1, 0))
    assert int(found.rounds) == rounds and bool(found.settled) == (rounds < MOST_ROUNDS)


@pytest.mark.parametrize("name", ["lost", "unseen", "left_out"])
def test_whatever_is_left_out_of_the_map_is_told(set_up, name: str) -> None:
    assert bool(set_up(**{name: np.arange(3 * MOST_ROUNDS) == 4})[0].overflow)


def test_what_is_no_lack_of_places_is_no_overflow(set_up) -> None:
    others = [name for name in FIELDS if name not in ("lost", "unseen", "left_out", "new", "removed")]
    assert not bool(set_up(**dict.fromkeys(others, 1))[0].overflow)
