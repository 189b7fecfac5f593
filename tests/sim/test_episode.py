import dataclasses
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from straight import straight_route

from hrcjax.hand import CLOSED, OPEN, CommandParams, initial_commands, update_commands
from hrcjax.numerics import unrolled_options
from hrcjax.reference.truth import obstacle_distances, person_distance
from hrcjax.safety import COMMANDED, OLD_DATA, STOP, describe
from hrcjax.sense import HEALTH_REASONS
from hrcjax.sim import episode, fit_fields, outcome
from hrcjax.sim.episode import follow, pack_cameras
from hrcjax.sim.tick import STOP_COMMANDED

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def program(cell):
    def run(params, world):
        ran = episode(params, cell, world, fit_fields(params.field, world.frames))
        return ran, outcome(params, cell, world, ran)

    return jax.jit(run, compiler_options=unrolled_options())


@pytest.fixture(scope="module")
def seen(program, float_params, world):
    return program(float_params, world)


def test_everything_is_finite_and_the_arm_moves_towards_the_goal(seen, world):
    run, kept = seen
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves((run.record, kept)))
    ends = np.linalg.norm(np.asarray(run.record.tool)[[0, -1]] - np.asarray(world.scene.goal), axis=1)
    assert ends[1] < ends[0]
    np.testing.assert_allclose(run.record.tool[0], world.scene.start, atol=2e-3)


def test_joint_limits_hold(seen, cell):
    record = seen[0].record
    assert np.all(np.abs(record.qd) <= cell.arm.qd_max + 1e-4)
    assert np.all(np.abs(record.qdd) <= cell.arm.qdd_max + 1e-3)
    assert np.all(np.abs(record.tau) <= cell.arm.tau_max + 1e-3)


def test_the_servo_does_what_was_commanded(seen, cell):
    record = seen[0].record
    asked = np.asarray(record.qd[:-1] + cell.dt * record.qdd[:-1])
    np.testing.assert_allclose(record.qd[1:], asked, atol=2e-3)


def test_old_data_stops_the_arm(program, float_params, world):
    frames = dataclasses.replace(world.frames, valid=world.frames.stamp < 0.02)
    run, _ = program(float_params, eqx.tree_at(lambda w: w.frames, world, frames))
    reasons = np.asarray(run.record.reasons)
    assert reasons[5] & OLD_DATA == 0
    assert np.all(reasons[-20:] & OLD_DATA)
    assert np.abs(run.record.qd[-1]).max() < 0.01, "the arm must stand still when nothing is known of the person"


def test_no_data_at_all_means_the_arm_never_moves(program, float_params, world):
    frames = dataclasses.replace(world.frames, valid=jnp.zeros_like(world.frames.valid))
    run, _ = program(float_params, eqx.tree_at(lambda w: w.frames, world, frames))
    assert np.abs(run.record.qd).max() < 1e-3


def test_a_command_that_is_not_finite_is_named_and_the_arm_holds(program, float_params, world):
    broken = eqx.tree_at(lambda p: p.policy.target.kp, float_params, jnp.asarray(jnp.nan, jnp.float32))
    run, _ = program(broken, world)
    assert np.all(np.asarray(run.record.status) & 1)
    assert np.isfinite(run.record.q).all()
    assert np.abs(run.record.qd).max() < 1e-3


def test_bits_of_the_cameras():
    """Camera k in the k-th byte; a fourth has no place."""
    packed = pack_cameras(jnp.asarray([[3, 64, 0, 5], [0, 0, 2, 0]], jnp.int32))
    np.testing.assert_array_equal(packed, [3 + 64 * 256, 2 * 65536])
    np.testing.assert_array_equal(pack_cameras(jnp.asarray([[7]], jnp.int32)), [7])
    assert max(HEALTH_REASONS) < 256


def test_the_record_names_what_the_cameras_suffer(program, float_params, world, seen):
    """From when the image is due; it needs not be the one that is used."""
    frames = world.frames
    later = jnp.arange(frames.stamp.shape[0]) >= 12
    ill = eqx.tree_at(
        lambda f: (f.reasons, f.valid),
        frames,
        (frames.reasons.at[:, 1].set(jnp.where(later, 64, 0)), frames.valid & (~later | (frames.camera == 0))),
    )
    run, _ = program(float_params, eqx.tree_at(lambda w: w.frames, world, ill))
    due = np.arange(60) * 0.008 - 0.05 >= float(frames.stamp[12])
    np.testing.assert_array_equal(run.record.cameras, np.where(due, 64 << 8, 0))
    assert not np.any(seen[0].record.cameras) and 5 < due.sum() < 55


def test_contacts_of_the_moving_and_of_the_standing_arm(seen, cell, world, float_params):
    """The record turned so that the arm stands, or moves, within the person all the time."""
    run, _ = seen
    there = eqx.tree_at(lambda w: w.person.radius, world, jnp.full_like(world.person.radius, 5.0))

    @jax.jit
    def measure(run, world):
        kept = outcome(float_params, cell, world, run)
        return kept.hit, kept.run_into

    standing, moving = (eqx.tree_at(lambda r: r.record.qd, run, jnp.full_like(run.record.qd, v)) for v in (0.0, 0.2))
    assert [bool(one) for one in measure(moving, there)] == [True, False]
    assert [bool(one) for one in measure(standing, there)] == [False, True]
    assert not any(measure(moving, world))


def test_least_distances_are_those_of_all_ticks(seen, cell, world):
    """Against the geometry in plain NumPy at every tick."""
    run, kept = seen
    q = np.asarray(run.record.q, float)
    assert not kept.metrics.success, "so that all ticks count"
    apart = person_distance(cell.arm, world.person, q, cell.times).min()
    np.testing.assert_allclose(kept.metrics.separation, apart, atol=3e-5)
    np.testing.assert_allclose(kept.metrics.clearance, obstacle_distances(cell.arm, world.scene, q).min(), atol=3e-5)


RATE = 30.0
CLOSES, OPENS = -0.4, 0.3
"""From when on a hand is closed, and when it opens [s]."""


def stops(times):
    """Whether a command stops the arm at each tick: by the newest frame of a stream, which begins stopped and before the episode."""
    frames = np.arange(CLOSES, times[-1] + 1 / RATE, 1 / RATE)
    shown = np.where(frames < OPENS, CLOSED, OPEN)
    probability = np.full((len(frames), 1, 4), 0.01, np.float32)
    probability[np.arange(len(frames)), 0, shown] = 0.97

    def frame(state, now):
        state, _ = update_commands(CommandParams(), state, now, jnp.asarray([True]), jnp.float32(1 / RATE))
        return state, state.stopped

    begin = initial_commands(jnp.dtype("float32"), stopped=True)
    stands = np.asarray(jax.jit(lambda p: jax.lax.scan(frame, begin, p)[1])(jnp.asarray(probability)))
    return stands[np.searchsorted(frames, times + 1e-9, side="right") - 1]


def test_an_open_hand_stops_the_arm_and_a_closed_one_lets_it_go_on(float_params, world, cell):
    """Nobody is near, so that the command alone holds it; without commands nothing changes."""
    nobody = eqx.tree_at(
        lambda w: (w.frames.moving.mask, w.frames.beyond, w.frames.guarded),
        world,
        replace_fn=lambda a: jnp.full_like(a, 10.0) if a.dtype == jnp.float32 else jnp.zeros_like(a),
    )
    route, fields = straight_route(cell, nobody), jax.jit(fit_fields)(float_params.field, nobody.frames)

    @partial(jax.jit, compiler_options=unrolled_options())
    def run(stop):
        return follow(float_params, cell, route, nobody.frames, nobody.q_start, fields, stop)[1]

    stop, t = stops(cell.times), cell.times
    led, free, nothing = (run(of) for of in (jnp.asarray(stop), None, jnp.zeros(cell.ticks, bool)))
    go, again = np.flatnonzero(np.diff(stop)) + 1
    assert CLOSES + 0.5 <= t[go] <= CLOSES + 0.5 + 2 / RATE + cell.dt
    assert OPENS <= t[again] <= OPENS + 2 / RATE + cell.dt
    speed, off = (np.abs(np.asarray(one.qd)).max(axis=1) for one in (led, free))
    assert off[10:].min() > 0.05, "without the command it moves all the time"
    assert speed[:go].max() < 1e-3, "it stands until the go"
    assert speed[go + 10 : again].min() > 0.05, "and then goes on"
    assert speed[again + 10 :].max() < 1e-3, "until a hand opens"
    travelled = np.asarray(led.travelled)
    assert travelled[go - 1] < 1e-4 and travelled[-1] - travelled[again + 10] < 1e-4
    assert travelled[again] - travelled[go] > 1e-2
    np.testing.assert_array_equal(np.asarray(led.status) & STOP_COMMANDED > 0, stop)
    assert (np.asarray(led.zone)[stop] == STOP).all() and not (np.asarray(free.status) & STOP_COMMANDED).any()
    for one in (led, free, nothing):
        np.testing.assert_array_equal(np.asarray(one.reasons) != 0, np.asarray(one.zone) == STOP)
    np.testing.assert_array_equal(np.asarray(led.reasons) & COMMANDED > 0, stop)
    assert describe(int(led.reasons[-1])) == "stopped by command"
    np.testing.assert_allclose(nothing.q, free.q, atol=1e-4)
