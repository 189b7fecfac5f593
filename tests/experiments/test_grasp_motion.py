"""What cameras see, the arm that goes to a grasp by its policies, who judges it, a whole small case."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import KDTree

from experiments.grasp.case import make_bench, seen_place, true_angles
from experiments.grasp.config import GraspConfig
from experiments.grasp.lift import lift
from experiments.grasp.look import Look, exact_surface, hand_cameras, look, stacked, stationary_cameras, unseen
from experiments.grasp.move import move, summary
from experiments.grasp.objects import shape_named
from experiments.grasp.perceive import POINTS, perceive
from experiments.grasp.pull import LADDER, pull
from experiments.grasp.run import run
from experiments.grasp.scene import WORK, make_scene, scene_xml
from experiments.grasp.touch import least_distances, link_distances
from hrcjax.field import FieldParams, fit_exact
from hrcjax.geom.cloud import Cloud
from hrcjax.grasp.approach import gripper_axes
from hrcjax.grasp.arm_motion import CLOSE, STRAIGHT, Moved, carried_frame, straight_joints
from hrcjax.grasp.candidates import Grasps
from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.motion_policy import MotionPolicyParams, off_surfaces
from hrcjax.grasp.reach import arm_with_gripper, reach
from hrcjax.grasp.seen_points import SeenPoints
from hrcjax.policy import CollisionParams
from hrcjax.robot import arm_capsules, load_arm, point_motion, tool_frame

GRIPPER = Gripper()
ARM = arm_with_gripper(load_arm(), GRIPPER)
DOWN = np.column_stack([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]])
"""Axes of a gripper that comes straight down and closes along y."""
ASIDE = np.array([0.02, 0.53])
"""Where an object is that does not stand in the middle [m]."""


FRAMES = 4
"""Images of each camera: of all tests, as each number compiles programs of its own."""


@contextmanager
def as_the_program() -> Iterator[None]:
    """Single precision, as the program has it: its compiled programs are the same in all tests."""
    with jax.enable_x64(False), jax.numpy_dtype_promotion("standard"):
        yield


def seen_by(looks: list[Look]) -> SeenPoints:
    with as_the_program():
        return perceive(*stacked(looks, jax.random.key(0)), FRAMES)


@pytest.fixture(scope="module")
def to_a_block() -> tuple[Moved, Moved, np.ndarray, np.ndarray]:
    """The arm goes to two faces 5 cm apart, and the same with a field that is no number."""
    with as_the_program():
        u, v = (g.ravel() for g in np.meshgrid(np.arange(-0.024, 0.025, 0.006), np.arange(0.01, 0.09, 0.006)))
        faces = [np.column_stack([np.full(len(u), s * 0.025), u + 0.5, v]) for s in (-1.0, 1.0)]
        points = np.pad(np.concatenate(faces), ((0, POINTS - 2 * len(u)), (0, 0)))  # as many as a case has
        cloud = Cloud(jnp.asarray(points, jnp.float32), jnp.arange(POINTS) < 2 * len(u))
        field = jax.jit(fit_exact)(cloud, FieldParams(length_scale=0.0055, noise=0.05))[0]
        R = gripper_axes(jnp.asarray([1.0, 0, 0], jnp.float32), 0.3, jnp.asarray([0, 0, 1.0], jnp.float32))
        p, back = jnp.asarray([0.0, 0.5, 0.06], jnp.float32), jnp.asarray(0.1, jnp.float32)
        before = reach(ARM, R, p, back).q_before
        width = jnp.asarray(0.05, jnp.float32)
        grasp = Grasps(R, p, width, width + 0.016, width, width, jnp.zeros(2, jnp.int32), jnp.asarray(True))
        good = move(ARM, GRIPPER, MotionPolicyParams(), field, grasp, back, before)
        broken = jax.tree.map(lambda a: a * jnp.nan if a.dtype == jnp.float32 else a, field)
        bad = move(ARM, GRIPPER, MotionPolicyParams(), broken, grasp, back, before)
        return jax.tree.map(np.asarray, good), jax.tree.map(np.asarray, bad), np.asarray(R), np.asarray(p)


@pytest.mark.slow
def test_the_arm_comes_to_the_grasp_along_the_approach(to_a_block) -> None:
    moved, _, R, p = to_a_block
    found = summary(moved)
    assert found["off"] < CLOSE and found["twist"] < STRAIGHT and found["finite"] and 1 < found["seconds"] < 7
    assert abs(moved.R[-1][:, 1] @ R[:, 1]) > np.cos(STRAIGHT)  # either way round
    near = (moved.way > 0.01) & (moved.way < 0.09)  # on the approach it stays on the straight line
    aside = (moved.p - p) - np.outer((moved.p - p) @ R[:, 2], R[:, 2])
    assert near.sum() > 20 and np.linalg.norm(aside[near], axis=1).max() < 0.006
    assert (np.diff(moved.way) >= 0).all() and moved.way[-1] == pytest.approx(0.1, abs=1e-5)


@pytest.mark.slow
def test_in_transit_the_joints_keep_to_their_straight_line(to_a_block) -> None:
    """The way round is that of the inverse kinematics; the field is far from the line here."""
    moved, *_ = to_a_block
    transit = moved.q[moved.way == 0]
    line = transit[-1] - transit[0]
    along = (transit - transit[0]) @ line / (line @ line)
    aside = transit - transit[0] - np.outer(along, line)
    assert np.linalg.norm(line) > 0.5 and np.abs(aside).max() < 0.05
    assert along.min() > -0.01 and along.max() < 1.02


def test_the_line_in_joint_space_by_differences() -> None:
    start, end = jnp.asarray(ARM.home), jnp.asarray(ARM.home) + jnp.asarray([0.5, -0.4, 0.3, 0.2, -0.1, 0.6])
    seconds, h = 2.0, 1e-4

    @jax.jit
    def there(t):
        q, qd = straight_joints(start, end, t / seconds, jnp.asarray(seconds))
        return q, qd, carried_frame(ARM, q, qd), tool_frame(ARM, q)

    for at in (-0.1, 0.0, 0.6, 1.3, 2.0, 2.5):
        (_, qd, frame, (R, p)), *ends = (there(at + s * h) for s in (0, -1, 1))
        (q0, _, _, (R0, p0)), (q1, _, _, (R1, p1)) = ends
        np.testing.assert_allclose(qd, (q1 - q0) / (2 * h), atol=1e-6)
        np.testing.assert_array_equal(frame.p, p)
        np.testing.assert_allclose(frame.v, (p1 - p0) / (2 * h), atol=1e-5)
        rate = np.asarray(R1 - R0) @ np.asarray(R).T / (2 * h)
        np.testing.assert_allclose(frame.omega, [rate[2, 1], rate[0, 2], rate[1, 0]], atol=1e-5)
    np.testing.assert_array_equal(there(9.0 * seconds)[0], end)


@pytest.mark.slow
def test_the_joints_keep_their_limits(to_a_block) -> None:
    moved, *_ = to_a_block
    assert moved.speed.max() <= 1.02
    speed = np.diff(moved.q, axis=0) * 125.0
    assert np.abs(speed / ARM.qd_max).max() <= 1.02
    assert np.abs(np.diff(speed, axis=0) * 125.0 / ARM.qdd_max).max() < 1.3  # differences of float32
    assert ((moved.q > ARM.q_min) & (moved.q < ARM.q_max)).all()


@pytest.mark.slow
def test_a_field_that_is_no_number_keeps_the_arm_where_it_is(to_a_block) -> None:
    _, moved, *_ = to_a_block
    assert not moved.finite.any() and not summary(moved)["finite"]
    assert np.abs(moved.q - ARM.home).max() < 1e-3 and moved.way.max() == 0


def test_surfaces_push_points_away() -> None:
    q = jnp.asarray(ARM.home)
    body = point_motion(ARM.chain, q, 0 * q, (ARM.tool_link,), ARM.tool_offset[None])
    centre = body.x[0] - jnp.asarray([0.0, 0.0, 0.1])

    def ball(x):
        return jnp.sqrt(jnp.sum((x - centre) ** 2)) - 0.05

    pulled = off_surfaces(CollisionParams(), body, jnp.asarray([0.02]), ball)
    qdd = np.linalg.solve(np.asarray(pulled.M) + 1e-6 * np.eye(6), np.asarray(pulled.f))
    assert (np.asarray(body.J[0]) @ qdd)[2] > 0.5
    far = off_surfaces(CollisionParams(r_act=0.01), body, jnp.asarray([0.02]), ball)
    assert not np.asarray(far.M).any()


def test_distances_to_the_exact_shapes() -> None:
    """Straight down over the table, and beside a box of known width."""
    scene = make_scene(shape_named("box"), (ASIDE, 0.0, 0), GRIPPER)
    centre = scene.centre()
    over = np.array([ASIDE[0] + 0.3, ASIDE[1], 0.1])
    found = least_distances(scene, np.stack([DOWN] * 3), np.stack([over, centre, centre - [0, 0, 0.06]]), 0.08)
    assert found[0] == pytest.approx(0.1 - GRIPPER.pad[1], abs=1e-3)
    assert found[1] == pytest.approx(0.04 - 0.035, abs=1e-3)  # half the opening less half the box
    assert found[2] < 0
    assert least_distances(scene, DOWN[None], centre[None], 0.06)[0] < 0


def test_links_are_judged_by_their_capsules() -> None:
    """Over the table by the lowest of them; and against a ball right below the wrist."""
    xml = scene_xml(shape_named("ball"), (ASIDE, 0.0, 0), GRIPPER)
    scene = make_scene(shape_named("ball"), (ASIDE, 0.0, 0), GRIPPER)
    ends = arm_capsules(ARM, jnp.asarray(ARM.home))
    shown = [k for k, name in enumerate(ARM.capsule_names) if name not in ("base", "shoulder", "tool")]
    low = min(min(ends.a[k][2], ends.b[k][2]) - ends.radius[k] for k in shown)
    assert link_distances(scene, xml, ARM, ARM.home[None])[0] == pytest.approx(float(min(low, 0.3)), abs=1e-4)
    k = ARM.capsule_names.index("wrist 3")
    at = np.asarray(ends.b[k]) + np.array([0.0, 0.0, -0.1])
    free = scene.model.jnt_qposadr[scene.model.body_jntadr[scene.body]]
    scene.data.qpos[free : free + 3] = at
    near = min(
        _point_to_segment(at, np.asarray(ends.a[j]), np.asarray(ends.b[j])) - float(ends.radius[j]) for j in shown
    )
    assert link_distances(scene, xml, ARM, ARM.home[None])[0] == pytest.approx(near - 0.035, abs=1e-4)


def _point_to_segment(x: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    share = np.clip((x - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0, 1)
    return float(np.linalg.norm(a + share * (b - a) - x))


def test_the_closing_axis_is_judged_with_its_sign() -> None:
    tilt = np.array([np.cos(0.3), np.sin(0.3), 0.0])
    x = np.array([1.0, 0, 0])
    normals = np.array([[-x, x], [-tilt, x], [-x, tilt], [x, -x], [x, x]])
    np.testing.assert_allclose(true_angles(normals, np.tile(x, (5, 1))), [0, 0.3, 0.3, np.pi, np.pi], atol=1e-7)


def test_a_pull_is_borne_as_far_as_friction_goes() -> None:
    """Two fingers of 40 N bear at most 2 mu 40 N along their faces."""
    borne = {}
    for mu in (0.1, 0.8):
        scene = make_scene(shape_named("box"), (ASIDE, 0.0, 0), GRIPPER, mu)
        weight = scene.model.body_mass[scene.body] * 9.81
        assert lift(scene, DOWN, scene.centre(), 0.085).lifted
        borne[mu] = pull(scene)
        assert borne[mu] in (0.0, *LADDER) and (borne[mu] + 1) * weight < 2 * mu * 40 * 1.42
        assert borne[mu] * weight > 0.25 * 2 * mu * 40
    assert borne[0.8] > 2 * borne[0.1]
    apart = make_scene(shape_named("box"), (ASIDE, 0.0, 0), GRIPPER)
    assert pull(apart) == 0.0


def test_the_hand_goes_the_way_that_the_arm_came() -> None:
    """A way that ends beside the object: there is nothing to lift; one through it moves it."""
    scene = make_scene(shape_named("box"), (ASIDE, 0.0, 0), GRIPPER)
    centre = scene.centre()
    ends = np.stack([centre + np.array([0, 0, 0.1]), centre + np.array([0.15, 0, 0.1])])
    assert not lift(scene, DOWN, ends[-1], 0.085, came=(np.stack([DOWN, DOWN]), ends)).held
    scene = make_scene(shape_named("box"), (ASIDE, 0.0, 0), GRIPPER)
    through = np.stack([centre + np.array([0.15, 0, 0]), centre])
    assert lift(scene, DOWN, centre, 0.055, came=(np.stack([DOWN, DOWN]), through)).pushed > 0.01


def test_the_hand_looks_where_the_stationary_cameras_saw_something() -> None:
    """Not where the object is: that is what they do not know."""
    scene = make_scene(shape_named("cylinder"), (ASIDE, 0.0, 0), GRIPPER)
    fixed = [look(scene, camera) for camera in stationary_cameras()]
    assert all(one.own.any() and not one.own[[0, -1]].any() and not one.own[:, [0, -1]].any() for one in fixed)
    seen = seen_by(fixed)
    at = seen_place(seen)
    assert 1e-4 < np.linalg.norm(at - ASIDE) < 0.03
    for camera in hand_cameras(at):
        one = look(scene, camera)
        assert one.own.any() and not np.isfinite(unseen(one).depth).any()
    nothing = seen_by([unseen(one) for one in fixed])
    np.testing.assert_array_equal(seen_place(nothing), [0.0, 0.5])


def test_points_lie_on_the_surface() -> None:
    """Of a ball, whose surface is known: noise of 4 mm a pixel at 1 m becomes tenths of a millimetre."""
    scene = make_scene(shape_named("ball"), (np.array(WORK), 0.0, 0), GRIPPER)
    looks = [look(scene, camera) for camera in stationary_cameras() + hand_cameras(np.array(WORK))]
    surface, normals = exact_surface(looks)
    np.testing.assert_allclose(np.linalg.norm(surface - scene.centre(), axis=1), 0.035, atol=1e-4)
    np.testing.assert_allclose(normals, (surface - scene.centre()) / 0.035, atol=1e-2)
    seen = seen_by(looks)
    points = np.asarray(seen.cloud.points, float)[np.asarray(seen.cloud.mask)]
    off = np.abs(np.linalg.norm(points - scene.centre(), axis=1) - 0.035)
    assert len(points) > 200 and not bool(seen.more)
    assert np.median(off) < 4e-4 and np.percentile(off, 95) < 2e-3
    toward = np.asarray(seen.toward, float)[np.asarray(seen.cloud.mask)]
    assert (np.sum(toward * (points - scene.centre()), axis=1) > 0).mean() > 0.97
    covered = KDTree(points).query(surface)[0]
    assert np.percentile(covered, 95) < 0.008


@pytest.mark.slow
def test_a_whole_case_lifts_and_is_resumed(tmp_path, capsys) -> None:
    assert make_bench(2, True, (0.8,)).gripper.stroke == 0.085
    config = replace(GraspConfig(), shapes=("cylinder",), poses=1, frames=FRAMES, slippery=(), out=tmp_path / "run", figures=False, json=tmp_path / "rows.json")  # fmt: skip
    with as_the_program():
        assert run(config) == 0
        file = tmp_path / "run" / "cases" / "cylinder--0.npz"
        made = file.stat().st_mtime_ns
        assert run(config) == 0
    assert file.stat().st_mtime_ns == made
    rows = json.loads((tmp_path / "rows.json").read_text())["grasp"]
    stored = np.load(file)
    assert 0 < np.linalg.norm(stored["aim"] - stored["place"]) < 0.04  # it looks where it saw, not where the object is
    assert (
        rows["reach_error_mm"]["value"] < 5
        and rows["reach_error_deg"]["value"] < 3
        and rows["reach_lifted"]["value"] == 1
    )
    grazed = rows["reach_clearance_mm"]["value"] <= 0 or rows["reach_links_mm"]["value"] <= 0
    assert rows["reached"]["value"] == 1 - grazed == 1 - rows["reach_touched"]["value"], (
        "a grazed object was not reached"
    )
    assert rows["lifted_share"]["value"] == 1 and rows["normal_error"]["value"] < 4
    assert "lifted_share" in capsys.readouterr().out
