"""The baseline's episode: images on time, commands followed, the truth beside what the octree knows."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.hri.baseline.cameras import Cameras
from experiments.hri.baseline.episode import baseline_episode
from experiments.hri.baseline.frame import eye_of
from experiments.hri.baseline.settings import BaselineSettings
from experiments.hri.trace import PROBES
from hrcjax.cells.ur5 import make_cell
from hrcjax.robot import arm_capsules
from hrcjax.sense.rig import cell_rig
from hrcjax.world import scene_named
from hrcjax.world.person import Person

A = np.array([-1.778224, -1.4850419, 1.6393753, -1.7251298, -1.5707964, 0.01309992])
B = np.array([-0.26363474, -1.4830216, 1.637163, -1.7249378, -1.5707964, 0.01343654])
SCENE = scene_named("hri")


def still(x: float) -> Person:
    """A ball of a person that stays at a place."""
    at = jnp.broadcast_to(jnp.asarray([[[x, 0.6, 0.5]]], SCENE.start.dtype), (2, 1, 3))
    radius = jnp.full((1,), 0.1, SCENE.start.dtype)
    return Person(at, at, radius, jnp.asarray(1.0, SCENE.start.dtype), jnp.ones((2,), bool), ("head",))


def near_ball(place: np.ndarray) -> Person:
    """A ball of a person at a place."""
    at = jnp.broadcast_to(jnp.asarray(place, SCENE.start.dtype), (2, 1, 3))
    radius = jnp.full((1,), 0.12, SCENE.start.dtype)
    return Person(at, at, radius, jnp.asarray(1.0, SCENE.start.dtype), jnp.ones((2,), bool), ("hand",))


def test_planning_takes_the_stated_time() -> None:
    settings = BaselineSettings(overhead=0.05, check_time=1e-5, time_limit=0.5)
    assert settings.planning_time(0) == 0.05
    assert settings.planning_time(10_000) == pytest.approx(0.15)
    assert settings.planning_time(settings.most_checks + 10**6) == 0.5


@pytest.mark.slow
def test_images_arrive_after_the_latency_and_do_not_show_the_robot() -> None:
    cell = replace(make_cell(), ticks=40)
    rig = cell_rig(SCENE, decimation=16)
    cameras = Cameras(cell, SCENE, rig, still(-0.5), jax.random.key(0))
    arrived = []
    for tick, t in enumerate(cell.times):
        cameras.expose(tick, A)
        arrived += [(t, frame) for frame in cameras.arrived(float(t))]
    assert len(arrived) >= 7  # two cameras of 15 Hz in 0.32 s, less the latency
    for t, frame in arrived:
        assert cell.latency - 1e-9 <= t - frame.stamp < cell.latency + 2 * cell.dt
    frame = arrived[-1][1]
    points = frame.eye.position + frame.depth[:, None] * frame.eye.rays
    seen = points[(frame.depth > 0) & (points[:, 2] > 0.2) & (points[:, 2] < 0.8) & (points[:, 1] > -0.3)]
    ball = np.abs(np.linalg.norm(seen - [-0.5, 0.6, 0.5], axis=1) - 0.1)
    assert len(seen) > 3 and np.median(ball) < 0.03  # what is left above the table is the ball
    assert np.isfinite(frame.robot).sum() > 20
    camera = jax.tree.map(lambda a: a[0], rig.cameras)
    middle = eye_of(camera).rays.reshape(camera.height, camera.width, 3)[int(camera.cy), int(camera.cx)]
    assert middle @ np.asarray(camera.rotation)[:, 2] == pytest.approx(1.0, abs=0.02)


@pytest.mark.slow
def test_episode_follows_its_commands_and_knows_somebody_who_is_there() -> None:
    pytest.importorskip("pyoctomap")
    pytest.importorskip("ompl")
    pytest.importorskip("toppra")
    cell = replace(make_cell(), ticks=60)
    settings = BaselineSettings(resolution=0.05)
    trace = baseline_episode(
        cell, SCENE, still(-0.5), settings, 0, cell_rig(SCENE, decimation=8), waypoints=np.stack([A, B])
    )
    assert [event.what for event in trace.events][:2] == ["planned", "start"]
    assert np.linalg.norm(trace.tool[-1] - trace.tool[0]) > 0.02  # it moves
    assert trace.lag.max() < 2e-3
    assert np.abs(np.diff(trace.q, axis=0) / cell.dt - trace.qd[:-1]).max() < 0.02
    for tick in (0, 30, 59):
        capsules = arm_capsules(cell.arm, jnp.asarray(trace.q[tick]))
        u = np.linspace(0, 1, 500)[:, None, None]
        axis = (1 - u) * np.asarray(capsules.a) + u * np.asarray(capsules.b)
        away = np.linalg.norm(axis - [-0.5, 0.6, 0.5], axis=2) - np.asarray(capsules.radius) - 0.1
        assert trace.separation[tick] == pytest.approx(away.min(), abs=1e-3)
    near = trace.known[30:] - trace.separation[30:]
    assert np.abs(near).max() < 0.08  # half a voxel's diagonal, spheres, noise
    assert trace.probe_true.shape == trace.probe_known.shape == (len(trace.probe_t), PROBES)


def test_a_guard_slows_the_baseline_on_its_own_path() -> None:
    """Half the pace: the same places in twice the time; none: it stands, and goes on from there."""
    pytest.importorskip("pyoctomap")
    pytest.importorskip("ompl")
    pytest.importorskip("toppra")
    from experiments.hri.baseline.baseline import Baseline

    def ways(paces: list[float], ticks: int) -> tuple[np.ndarray, np.ndarray]:
        one = Baseline(make_cell().arm, np.stack([A, B]), BaselineSettings(), 0.008)
        found = []
        for tick in range(ticks):
            one.most = paces[min(tick, len(paces) - 1)]
            found.append(one.step(tick * 0.008))
        return np.array([c.q for c in found]), np.array([c.qd for c in found])

    whole, speed = ways([1.0], 200)
    begin = int(np.argmax(np.abs(speed).max(1) > 0))
    half, half_speed = ways([0.5], 2 * 200)
    start = int(np.argmax(np.abs(half_speed).max(1) > 0))
    apart = half[start : start + 2 * 120 : 2][:100] - whole[begin : begin + 120][:100]
    assert np.abs(apart).max() < 0.02  # places of one path, half a tick apart at most
    assert half_speed[start : start + 300].max() < 0.55 * speed.max()
    stopped, _ = ways([1.0] * 100 + [0.0] * 50 + [1.0], 260)
    assert np.ptp(stopped[102:148], axis=0).max() < 1e-9
    assert np.abs(stopped[155:250] - whole[105:200]).max() < 0.02


@pytest.mark.slow
def test_the_guard_stops_beside_somebody_and_lets_go_where_nobody_is() -> None:
    """The pace is 0 where the motion leads to a person within S_p(0), and grows where nobody is."""
    from experiments.hri.baseline.guard import Guard
    from experiments.hri.numbers import our_params
    from experiments.hri.systems import Bench

    bench = Bench(0.4, our_params(0.51), BaselineSettings(), BaselineSettings(), decimation=8)
    single = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), bench.params)
    paces = {}
    for name, person in (
        ("nobody", near_ball(np.array([-3.0, 0.6, 0.5]))),
        ("near", near_ball(np.array([-0.3, 0.53, 0.35]))),
    ):
        known = bench.set_up(person, 0)
        guard = Guard(replace(bench.cell, motion="path"), single, known, jax.random.key(0), 0.5)
        along = (B - A) / 2.5  # the tool goes to negative x
        for tick in range(40):
            pace = guard.most(tick, A, np.zeros(6), along, 1.0)
        paces[name] = pace, guard.zone
    assert paces["nobody"][0] > 0.05 and paces["nobody"][1] == 0
    assert paces["near"] == (0.0, 3)


@pytest.mark.slow
def test_ours_plan_the_straight_line() -> None:
    from experiments.hri.numbers import our_params
    from experiments.hri.systems import Bench, cell_of
    from hrcjax.sim.parts import Task

    params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), our_params(0.51))
    bench = Bench(0.4, our_params(0.51), BaselineSettings(), BaselineSettings(), decimation=8)
    q, cell = jnp.asarray(bench.waypoints[0], jnp.float32), cell_of("ours_free", bench.cell)
    path = jax.jit(lambda p, task: cell.plan(p.plan, task))(params, Task(bench.scene, q, params.potential, cell.arm))
    a, b = (np.asarray(end, float) for end in (bench.scene.start, bench.scene.goal))
    x, u = np.asarray(path.waypoints, float) - a, (b - a) / np.linalg.norm(b - a)
    along = x @ u
    assert np.abs(x - along[:, None] * u).max() < 1e-3
    assert along[0] == pytest.approx(0, abs=1e-3) and along[-1] == pytest.approx(np.linalg.norm(b - a), abs=2e-3)
