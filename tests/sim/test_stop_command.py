"""A command by hand in the loop: an open hand stops the arm, a closed one lets it go on; without commands nothing changes."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from coarse_sensing import coarse_world
from straight import straight_route

from hrcjax.hand import CLOSED, OPEN, CommandParams, initial_commands, update_commands
from hrcjax.numerics import unrolled_options
from hrcjax.safety import STOP
from hrcjax.sim import fit_fields
from hrcjax.sim.episode import follow
from hrcjax.sim.tick import STOP_COMMANDED
from hrcjax.world import motion_named, scene_named

RATE, TICKS = 30.0, 250
OPENED, CLOSES = 0.4, 0.8
"""When a hand opens, and when it closes instead [s]."""


def stops(times: np.ndarray) -> np.ndarray:
    """Whether a command stops the arm at each tick: by the newest frame of a stream."""
    frames = np.arange(0, times[-1] + 1 / RATE, 1 / RATE)
    probability = np.full((len(frames), 1, 4), 0.01, np.float32)
    shown = np.where(frames < OPENED, 3, np.where(frames < CLOSES, OPEN, CLOSED))
    probability[np.arange(len(frames)), 0, shown] = 0.97
    update = jax.jit(update_commands)
    state, stands = initial_commands(jnp.dtype("float32")), []
    for one in probability:
        state, _ = update(CommandParams(), state, jnp.asarray(one), jnp.asarray([True]), jnp.float32(1 / RATE))
        stands.append(bool(state.stopped))
    return np.asarray(stands)[np.minimum((times * RATE).astype(int), len(frames) - 1)]


@pytest.fixture(scope="module")
def alone(cell):
    """A cell with nobody in it."""
    longer = replace(cell, ticks=TICKS)
    scene = scene_named("robotica", 0)
    person = jax.jit(lambda: motion_named("nobody", scene, 0, 3.0, 30.0))()
    return longer, coarse_world(longer, scene, person)


@pytest.mark.slow
def test_an_open_hand_stops_the_arm_and_a_closed_one_resumes(alone, float_params) -> None:
    cell, world = alone
    route = straight_route(cell, world)
    fields = jax.jit(fit_fields)(float_params.field, world.frames)

    def run(stop):
        return follow(float_params, cell, route, world.frames, world.q_start, fields, stop)[1]

    compiled = jax.jit(run, compiler_options=unrolled_options())
    free = compiled(None)
    stop = stops(cell.times)
    led = compiled(jnp.asarray(stop))
    speed, off = (np.abs(np.asarray(one.qd)).max(axis=1) for one in (led, free))
    begin, end = np.flatnonzero(stop)[[0, -1]]
    t = cell.times
    assert OPENED <= t[begin] <= OPENED + 2 / RATE + cell.dt
    assert CLOSES + 0.5 <= t[end + 1] <= CLOSES + 0.5 + 2 / RATE
    np.testing.assert_array_equal(led.q[: begin + 1], free.q[: begin + 1])
    assert off[begin : end + 1].min() > 0.05, "without the command it moves all the time"
    assert speed[begin + 40 : end + 1].max() < 1e-3, "it stands until the go"
    assert speed[end + 40 :].max() > 0.05, "and then goes on"
    assert float(led.travelled[end]) - float(led.travelled[begin + 40]) < 1e-4
    told = np.asarray(led.status) & STOP_COMMANDED > 0
    np.testing.assert_array_equal(told, stop)
    assert (np.asarray(led.zone)[stop] == STOP).all() and not (np.asarray(free.status) & STOP_COMMANDED).any()
    nothing = compiled(jnp.zeros(TICKS, bool))
    np.testing.assert_allclose(nothing.q, free.q, atol=1e-4)
