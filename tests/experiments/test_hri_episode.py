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
