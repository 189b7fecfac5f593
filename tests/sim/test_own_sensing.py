"""Sensing between control ticks: every image at its time, used after the latency, with the arm where it is."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from coarse_sensing import QUICK
from straight import straight_plan

from hrcjax.numerics import unrolled_options
from hrcjax.plan import PathParams
from hrcjax.safety import COMMANDED, STOP
from hrcjax.sense import one_fault
from hrcjax.sense.faults import DROPPED
from hrcjax.sense.rig import cell_rig
from hrcjax.sim.own_sensing import episode_own, tick_images
from hrcjax.sim.params import Params
from hrcjax.sim.prepare import survey_world
from hrcjax.sim.survey import SenseParams
from hrcjax.world import motion_named, scene_named

RATE = 15.0


@pytest.fixture(scope="module")
def scene():
    return scene_named("robotica", 0)


@pytest.fixture(scope="module")
def appears(scene):
    """Nobody until 0.2 s, then at once somebody at the table."""
    person = motion_named("stand_and_work", scene, 0, 2.0, 30.0)
    late = jnp.arange(person.a.shape[0]) < 6
    away = jnp.asarray([0.0, 50.0, 0.0], person.a.dtype)
    a, b = (jnp.where(late[:, None, None], ends + away, ends) for ends in (person.a, person.b))
    return eqx.tree_at(lambda p: (p.a, p.b), person, (a, b))


@pytest.fixture(scope="module")
def known(cell, scene, appears):
    return survey_world(cell, scene, appears, cell_rig(scene, decimation=8), jax.random.key(0), QUICK)


@pytest.fixture(scope="module")
def run(cell):
    straight = replace(cell, plan=straight_plan)

    def episode(known, stop=None):
        params = Params(plan=PathParams())
        return episode_own(params, straight, known, jax.random.key(1), SenseParams(), stop).record

    compiled = jax.jit(episode, compiler_options=unrolled_options())
    # one program for all tests: a command that never stops changes nothing
    return lambda known, stop=None: compiled(known, jnp.zeros(cell.ticks, bool) if stop is None else jnp.asarray(stop))


@pytest.fixture(scope="module")
def record(run, known):
    return run(known)


def test_every_image_has_its_tick(cell) -> None:
    early, cameras, times, which = tick_images(cell, (RATE, RATE))
    assert (early < 0).all() and len(early) == len(cameras) >= 2
    taken = np.flatnonzero(which >= 0)
    assert len(taken) == len(np.arange(0, cell.ticks * cell.dt - 1e-9, 0.5 / RATE))
    assert (np.abs(times[taken] - cell.times[taken] - cell.dt / 2) <= cell.dt / 2 + 1e-6).all()
    with pytest.raises(ValueError, match="two images in one tick"):
        tick_images(cell, (200.0, 200.0))


def test_a_person_is_known_one_latency_after_the_first_image(cell, record) -> None:
    nearer = np.asarray(record.separation) < 5.0
    assert nearer[-1] and not nearer[0]
    _, _, times, which = tick_images(cell, (RATE, RATE))
    # the pose of the person at 0.2 s is the first one in view; between two poses it is interpolated from far away
    first = times[(which >= 0) & (times >= 0.2 - 1e-6)][0]
    due = int(np.ceil((first + cell.latency) / cell.dt - 1e-6))
    assert abs(int(np.argmax(nearer)) - due) <= 1


def test_a_missing_camera_is_named_and_slows(cell, run, known, record) -> None:
    assert not np.asarray(record.cameras).any()
    dropped = one_fault(DROPPED, 1, 0.1, 9.0, 2)
    faulty = run(eqx.tree_at(lambda k: k.stage.faults, known, dropped))
    cameras, zone = np.asarray(faulty.cameras), np.asarray(faulty.zone)
    assert set(cameras.tolist()) == {0, 64 << 8}  # no image, of the second camera
    named = int(np.argmax(cameras > 0)) * cell.dt
    assert 0.1 + cell.latency <= named <= 0.1 + 1 / RATE + cell.latency + cell.dt + 1e-6
    assert (zone[-5:] >= 1).all()


def test_the_arm_in_the_images_is_this_one(cell, known, run) -> None:
    """An arm that stands in the cameras' expectation but moves in truth would be a stranger: it is not."""
    alone = eqx.tree_at(lambda k: k.stage.person.a, known, known.stage.person.a + 50.0)
    alone = eqx.tree_at(lambda k: k.stage.person.b, alone, alone.stage.person.b + 50.0)
    record = run(alone)
    assert np.abs(np.asarray(record.qd)).max() > 0.05
    assert np.asarray(record.separation).min() > 5.0


def test_a_command_stops_the_arm(cell, known, run) -> None:
    """Nobody is near: the arm moves, stands while the command says so, and goes on."""
    alone = eqx.tree_at(lambda k: (k.stage.person.a, k.stage.person.b), known, replace_fn=lambda a: a + 50.0)
    ticks = np.arange(cell.ticks)
    stop = (ticks >= 20) & (ticks < 40)
    record = run(alone, stop)
    speed = np.abs(np.asarray(record.qd)).max(axis=1)
    assert speed[15:20].min() > 0.05 and speed[30:40].max() < 1e-3 and speed[-1] > 0.02
    zone, reasons = np.asarray(record.zone), np.asarray(record.reasons)
    np.testing.assert_array_equal(reasons & COMMANDED > 0, stop)
    np.testing.assert_array_equal(reasons != 0, zone == STOP)
