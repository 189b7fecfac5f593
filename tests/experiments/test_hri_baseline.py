"""The baseline's parts: octree, collision check, planner, timing, stop. Distances are checked against the exact ones."""

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from experiments.hri.baseline.arm_spheres import ArmSpheres
from experiments.hri.baseline.baseline import EASE, Baseline, blocked_at
from experiments.hri.baseline.brake import brake
from experiments.hri.baseline.collision import FAR, CollisionScene, DistanceGrid
from experiments.hri.baseline.frame import Eye, Frame
from experiments.hri.baseline.octree import LOWER, Octree
from experiments.hri.baseline.planning import plan
from experiments.hri.baseline.settings import BaselineSettings
from experiments.hri.baseline.start_state import freed_start
from experiments.hri.baseline.timing import rounded, timed
from hrcjax.cells.ur5 import TOOL
from hrcjax.robot import arm_capsules, load_arm, points_on_links, tool_frame, with_tool

ARM = with_tool(load_arm("ur5"), *TOOL)
SPHERES = ArmSpheres(ARM)
SETTINGS = BaselineSettings(resolution=0.05, clamp=(0.12, 0.97))
A = np.array([-1.778, -1.485, 1.639, -1.725, -1.571, 0.0])
B = np.array([-0.264, -1.483, 1.637, -1.725, -1.571, 0.0])
_GRID = np.meshgrid(np.linspace(-0.5, 0.5, 60), np.linspace(-0.3, 0.3, 40))
EYE = Eye(np.array([0.0, -1.0, 0.6]), np.stack([_GRID[0].ravel(), np.ones(2400), _GRID[1].ravel()], axis=1))
"""A camera that looks along +y: its depths are distances in y."""


def octree_of(wall: np.ndarray) -> SimpleNamespace:
    """A stand-in that has only the occupied voxels of some points."""
    edge = SETTINGS.resolution
    first = np.floor(np.array(LOWER) / edge).astype(int)
    occupied = np.zeros((44, 44, 26), bool)
    at = np.floor(wall / edge).astype(int) - first
    occupied[tuple(at.T)] = True
    return SimpleNamespace(occupied=occupied, first=first, edge=edge)


def box(lower: tuple[float, float, float], upper: tuple[float, float, float]) -> np.ndarray:
    axes = [np.arange(a, b, 0.02) for a, b in zip(lower, upper, strict=True)]
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)


POST = box((-0.44, 0.36, 0.06), (-0.34, 0.46, 0.45))
"""A post in the straight way of the tool from A to B."""
PANEL = box((-1.04, 0.9, 0.06), (1.0, 0.96, 0.9))
"""A wall behind all that the arm reaches."""


def image(depth: np.ndarray | float, robot: np.ndarray | float = np.inf, t: float = 0.0) -> Frame:
    n = len(EYE.rays)
    return Frame(t, EYE, np.broadcast_to(depth, n).astype(float), np.broadcast_to(robot, n).astype(float))


def test_spheres_cover_the_capsules_and_ride_on_the_links() -> None:
    q = np.stack([A, B, A + 0.7])
    centres = SPHERES.centres(q)
    draw = np.random.default_rng(0)
    for k in range(3):
        capsules = arm_capsules(ARM, jnp.asarray(q[k]))
        u = draw.uniform(size=(200, 1))
        for a, b, r in zip(*map(np.asarray, (capsules.a, capsules.b, capsules.radius)), strict=True):
            way = draw.normal(size=(200, 3))
            surface = a + u * (b - a) + r * way / np.linalg.norm(way, axis=1, keepdims=True)
            depth = np.linalg.norm(surface[:, None] - centres[k], axis=2) - SPHERES.radii
            assert depth.min(1).max() < 1e-9
        assert np.allclose(SPHERES.tool(q)[k], np.asarray(tool_frame(ARM, jnp.asarray(q[k]))[1]))
    own = np.asarray(points_on_links(ARM.chain, jnp.asarray(A), (5,), np.zeros((1, 3))))
    assert np.linalg.norm(own - SPHERES.tool(A[None])) == pytest.approx(TOOL[0], abs=1e-6)


def test_distance_grid_is_near_the_exact_distance_to_the_voxels() -> None:
    scene = octree_of(POST)
    grid = DistanceGrid(scene.occupied, scene.first, scene.edge)
    middles = (np.argwhere(scene.occupied) + scene.first + 0.5) * scene.edge
    x = np.random.default_rng(1).uniform((-0.9, -0.9, 0.05), (0.9, 0.9, 1.1), (500, 3))
    to_box = np.linalg.norm(np.maximum(np.abs(x[:, None] - middles) - scene.edge / 2, 0), axis=2).min(1)
    error = grid.distances(x) - to_box
    assert error.max() < 0.25 * scene.edge  # hardly ever farther than the box itself
    assert error[to_box > 0.05].min() > -0.5 * scene.edge  # the ball about a voxel is larger than it
    assert DistanceGrid(scene.occupied & False, scene.first, scene.edge).distances(x).min() == FAR


def test_links_that_touch_and_the_table_are_refused() -> None:
    folded = A.copy()
    folded[2] = 2.9
    low = A.copy()
    low[1] = -0.5
    q = np.stack([A, folded, low])
    assert SPHERES.at_ease(q, SPHERES.centres(q)).tolist() == [True, False, False]
    beyond = A.copy()
    beyond[2] = 3.3
    assert not SPHERES.at_ease(beyond[None], SPHERES.centres(beyond[None]))[0]


def test_a_post_in_the_way_is_refused_and_an_empty_cell_is_not() -> None:
    with_post, empty = (CollisionScene(SPHERES, octree_of(points)) for points in (POST, PANEL))  # type: ignore[arg-type]
    assert empty.motion_free(A, B, 0.05, 0.05)
    assert with_post.free(np.stack([A, B]), 0.05).all()
    assert not with_post.motion_free(A, B, 0.05, 0.05)


def test_octree_knows_a_wall_and_forgets_it_when_it_is_seen_through() -> None:
    pytest.importorskip("pyoctomap")
    octree = Octree(SETTINGS)
    octree.insert(image(1.4))  # a wall at y = 0.4
    first = octree.middles()
    assert len(first) > 100 and np.abs(first[:, 1] - 0.4).max() <= 0.05
    for k in range(8):
        octree.insert(image(3.0, t=k / 15))
    assert len(octree.middles()) == 0
    known = []
    for _ in range(3):
        octree.insert(image(1.4))
        known.append(len(octree.middles()))
    # from free as far as clamping lets it, log-odds -1.99, three hits of 0.85 make occupied
    assert known[:2] == [0, 0] and known[2] > 100
    octree.insert(image(0.0))  # no measurement says nothing
    assert len(octree.middles()) == known[2]
    for k in range(9):
        octree.insert(image(3.0, t=k / 15))
    assert len(octree.middles()) == 0  # however often it was hit, 3.48 less nine misses of 0.41


def test_rays_to_the_robot_carve_before_it_and_mark_nothing() -> None:
    pytest.importorskip("pyoctomap")
    octree = Octree(SETTINGS)
    octree.insert(image(1.4))
    for k in range(8):
        octree.insert(image(0.0, robot=1.8, t=k / 15))
    assert len(octree.middles()) == 0
    for _ in range(3):
        octree.insert(image(1.4))
    known = len(octree.middles())
    octree.insert(image(0.0, robot=1.2))
    assert len(octree.middles()) == known > 100  # what lies behind the robot stays


def test_planner_goes_round_a_post_and_says_where_there_is_no_way() -> None:
    pytest.importorskip("ompl")
    scene = CollisionScene(SPHERES, octree_of(POST))  # type: ignore[arg-type]
    found = plan(SETTINGS, scene, A, B, np.stack([A, B]), seed=3)
    assert found.path is not None and not found.direct and found.checks <= 1.3 * SETTINGS.most_checks
    assert np.allclose(found.path[[0, -1]], [A, B])
    for a, b in zip(found.path, found.path[1:], strict=False):
        assert scene.motion_free(a, b, SETTINGS.plan_gap - 0.01, 0.01)  # finer than the planner's steps
    again = plan(SETTINGS, scene, A, B, np.stack([A, B]), seed=3)
    assert again.path is not None and np.array_equal(found.path, again.path)
    at_goal = CollisionScene(SPHERES, octree_of(SPHERES.tool(B[None])))  # type: ignore[arg-type]
    assert plan(SETTINGS, at_goal, A, B, np.stack([A, B]), seed=3).path is None


def test_start_in_the_padding_is_left() -> None:
    tool = SPHERES.tool(A[None])[0]
    near = octree_of(tool[None] + np.array([[0.0, 0.15, 0.05]]))
    scene = CollisionScene(SPHERES, near)  # type: ignore[arg-type]
    now = scene.clearance(SPHERES.centres(A[None]))[0]
    settings = replace(SETTINGS, plan_gap=float(now) + 0.01)
    first = freed_start(settings, scene, A, 0)
    assert first is not None and scene.free(first[None], settings.plan_gap)[0]
    assert np.array_equal(freed_start(replace(SETTINGS, plan_gap=float(now) - 0.01), scene, A, 0), A)  # type: ignore[arg-type]


@pytest.mark.parametrize("jerk_time", [0.0, 0.1])
def test_limits_hold_on_a_path_with_corners(jerk_time: float) -> None:
    pytest.importorskip("toppra")
    settings = replace(SETTINGS, jerk_time=jerk_time, acceleration_scale=0.3, tool_speed=0.5)
    corner = (A + B) / 2 + np.array([0.0, -0.4, 0.3, 0.0, 0.2, 0.0])
    motion = timed(settings, SPHERES, rounded(np.stack([A, corner, B]), settings.blend))
    assert motion is not None
    t = np.linspace(0, motion.duration, 4000)
    q, qd, qdd = motion.at(t)
    assert np.allclose(q[0], A) and np.allclose(q[-1], B, atol=1e-6)
    assert np.abs(qd[[0, -1]]).max() < 1e-9
    slack = 1.02 if jerk_time == 0 else 1.1
    assert (np.abs(qd) <= slack * ARM.qd_max).all()
    assert (np.abs(qdd) <= slack * 0.3 * ARM.qdd_max).all()
    speed = np.linalg.norm(np.diff(SPHERES.tool(q), axis=0), axis=1) / np.diff(t)
    assert speed.max() <= 1.03 * 0.5 and speed.max() > 0.45
    numeric = np.gradient(q, t, axis=0)
    assert np.abs(numeric - qd)[5:-5].max() < 0.02
    if jerk_time:
        assert np.abs(np.gradient(motion.sdd, 0.001)).max() <= 2.2 * np.abs(motion.sdd).max() / jerk_time


def test_rounding_stays_straight_and_near_the_corner() -> None:
    assert np.allclose(np.cross((rounded(np.stack([A[:3], B[:3]]), 0.2)(np.linspace(0, 1, 9)) - A[:3]), B[:3] - A[:3]), 0, atol=1e-9)  # fmt: skip
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    curve = rounded(corner, 0.2)
    x = curve(np.linspace(0, curve.t[-1], 500))
    off = np.minimum(np.abs(x[:, 1]), np.abs(x[:, 0] - 1)).max()
    assert 0 < off < 0.1


def test_a_stop_keeps_the_limits_and_ends() -> None:
    limits, rate, v, place = np.full(2, 3.0), 1.0, [], 0.0
    for _ in range(500):
        qd, qdd = np.array([1.0 + 0.2 * np.sin(place), 0.5]), np.array([0.2 * np.cos(place), 0.0])
        a = brake(qd, qdd, rate, limits, 0.01)
        assert (np.abs(qdd * rate**2 + qd * a) <= 3.0 + 1e-9).all()
        rate = max(rate + a * 0.01, 0.0)
        place += rate * 0.01
        v.append(rate)
    assert v[-1] == 0 and v[20] > 0 and v[60] == 0  # 1.2 rad/s at 3 rad/s^2 take 0.4 s
    assert brake(np.zeros(2), np.zeros(2), 0.5, limits, 0.01) == -50


def test_a_motion_out_of_the_padding_may_leave_but_not_approach() -> None:
    out, nearer, back, along = np.array([[0.01, 0.02, 0.3, 0.4], [0.02, 0.02 - 2 * EASE, 0.3, 0.4], [0.01, 0.3, 0.02, 0.3],
                                         [0.02, 0.021, 0.022, 0.02]])  # fmt: skip
    assert blocked_at(np.array([0.2, 0.1, 0.01, 0.3]), 0.03) == 2
    assert blocked_at(out, 0.03) == 0 and blocked_at(out, 0.03, leaves=True) is None
    assert blocked_at(nearer, 0.03, leaves=True) == 0
    assert blocked_at(back, 0.03, leaves=True) == 2
    assert blocked_at(along, 0.03, leaves=True) == 0  # it does not get out
    assert blocked_at(np.array([0.2, 0.1]), 0.03) is None


def test_somebody_who_comes_near_a_motion_that_ends_stops_it() -> None:
    """All that remains is too near at once, and none of it nearer than where the arm is."""
    pytest.importorskip("pyoctomap")
    pytest.importorskip("ompl")
    pytest.importorskip("toppra")
    baseline = Baseline(ARM, np.stack([A, B]), SETTINGS, 0.008)
    ticks = 0
    while not any(event.what == "start" for event in baseline.events) or ticks < 250:
        q = baseline.step(0.008 * ticks, []).q
        ticks += 1
    gap = baseline.settings.watch_gap
    outwards = SPHERES.tool(q[None]) * [1.0, 1.0, 0.0] / np.linalg.norm(SPHERES.tool(q[None])[0, :2])
    for away in np.arange(0.1, 0.3, 0.005):  # a voxel so near before the tool that it is just in the padding
        voxel = octree_of(SPHERES.tool(q[None]) + away * outwards)
        voxel.insert = lambda frame: None
        baseline.octree = baseline.scene.octree = voxel  # type: ignore[assignment]
        baseline.see([image(0.0)])
        if baseline.known_distance(q[None])[0] > 0.3 * gap:
            break
    assert baseline.known_distance(q[None])[0] < gap
    for k in range(40):
        baseline.step(0.008 * (ticks + k), [image(0.0)])
    names = [event.what for event in baseline.events]
    assert names.index("stop") < names.index("stopped") and "arrived" not in names[: names.index("stopped")]


def driven(baseline: Baseline, frames: dict[int, Frame], ticks: int) -> np.ndarray:
    """Joints commanded; images arrive at some ticks."""
    given = ([frames[k]] if k in frames else [] for k in range(ticks))
    return np.array([baseline.step(0.008 * k, some).q for k, some in enumerate(given)])


def test_monitor_stops_before_a_wall_that_appears_and_goes_on_when_it_has_gone() -> None:
    pytest.importorskip("pyoctomap")
    pytest.importorskip("ompl")
    pytest.importorskip("toppra")
    baseline = Baseline(ARM, np.stack([A, B]), SETTINGS, 0.008)
    # a wall across the way at x = -0.3, seen from the side
    aside = Eye(np.array([1.6, 0.3, 0.5]), EYE.rays[:, [1, 0, 2]] * np.array([-1.0, 1.0, 1.0]))
    wall, gone = (Frame(0.0, aside, np.full(len(EYE.rays), z), np.full(len(EYE.rays), np.inf)) for z in (1.9, 3.5))
    frames = {0: gone, 60: wall, 61: wall, 62: wall} | {300 + k: gone for k in range(12)}
    q = driven(baseline, frames, 800)
    names = [event.what for event in baseline.events]
    assert names.index("stop") < names.index("stopped") < names.index("failed") < names.index("arrived")
    stopped = next(event for event in baseline.events if event.what == "stopped")
    assert 60 * 0.008 <= stopped.t < 1.2
    standing = q[round(stopped.t / 0.008) + 1 : 300]
    assert np.abs(np.diff(standing, axis=0)).max() == 0
    capsules = arm_capsules(ARM, jnp.asarray(standing[0]))
    nearest = np.min(
        np.minimum(np.asarray(capsules.a)[1:, 0], np.asarray(capsules.b)[1:, 0]) - np.asarray(capsules.radius)[1:]
    )
    assert nearest > -0.3  # short of the wall
    step = np.diff(q, axis=0) / 0.008
    assert (np.abs(step) <= 1.02 * ARM.qd_max).all()
    assert (np.abs(np.diff(step, axis=0)) / 0.008 <= 1.1 * ARM.qdd_max).all()  # in the stop too


def test_two_hits_make_a_voxel_occupied_and_five_misses_free() -> None:
    pytest.importorskip("pyoctomap")
    octree = Octree(BaselineSettings(resolution=0.05))
    counts = []
    for depth in (*[3.0] * 5, *[1.4] * 6, *[3.0] * 5):
        octree.insert(image(depth))
        counts.append(len(octree.middles()))
    assert counts[:6] == [0] * 6 and counts[6] > 100 and counts[14] > 100 and counts[15] == 0
