"""The closed loop in JAX against the serial one in NumPy, SciPy and C MuJoCo, in float64, tick by tick.

Both do the same sums in another order, so they agree to rounding, about 1e-14, which some 100 ticks of a stable loop do
not raise: 1e-9 is asked for (1e-8 for torques of tens of N m). Only the clock's Newton step has a derivative by finite
differences in the serial loop; it is right to some 1e-10.
"""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.field import FieldParams, fit, lower_bound, union_distance_and_gradient
from hrcjax.geom.cloud import Cloud
from hrcjax.plan import path_curve
from hrcjax.reference import fields as serial_fields
from hrcjax.reference.clock import Clock, advance
from hrcjax.reference.curve import Curve
from hrcjax.reference.episode import episode, see
from hrcjax.robot import load_arm, tool_frame, with_tool
from hrcjax.safety import INVALID_FRAME, OLD_DATA, TOO_CLOSE, WAITING, ClockParams, ClockState
from hrcjax.safety import advance as jax_advance
from hrcjax.sim import Cell, Frames, Params, Record, fit_fields, follow

FRAMES, PLACES = 30, 40
TORQUE_LIMITED = 2


@pytest.fixture(scope="module")
def cell():
    """A short episode of an arm with limits so tight that they are met."""
    arm = with_tool(load_arm("ur5"), 0.12, 0.03)
    q_max = arm.q_max.copy()
    q_max[3] = arm.home[3] + 0.015
    tight = dataclasses.replace(arm, tau_max=0.17 * arm.tau_max, q_max=q_max)
    return Cell(arm=tight, ticks=110, substeps=2)


@pytest.fixture(scope="module")
def at(cell):
    """Where the tool is at home [m]."""
    return np.asarray(tool_frame(cell.arm, jnp.asarray(cell.arm.home))[1])


def frames_of(at, gap, present=True):
    """A block behind the tool, and a person-like cylinder at a distance from the tool that changes [m]."""
    rng = np.random.default_rng(0)
    k = np.arange(PLACES)
    cylinder = np.column_stack([0.1 * np.cos(k), 0.1 * np.sin(k), np.linspace(-0.3, 0.4, PLACES)])
    points = at + cylinder + np.asarray(gap)[:, None, None] * np.array([0.5, 0.8, 0.1])
    block = at + np.array([0.0, -0.2, -0.05]) + rng.uniform(-0.08, 0.08, (30, 3))
    yes = jnp.ones(FRAMES, bool)
    return Frames(
        static=Cloud(jnp.asarray(block), jnp.asarray(np.arange(30) % 7 > 0)),
        moving=Cloud(jnp.asarray(points), jnp.full((FRAMES, PLACES), present)),
        stamp=jnp.asarray((np.arange(FRAMES) - 3) / 30),
        valid=yes,
        overflow=~yes,
        static_overflow=jnp.asarray(False),
    )


def bow(at, length):
    """Waypoints of a bent path from the tool [m]."""
    u = np.linspace(0, 1, 12)[:, None]
    return at + length * np.hstack([-0.2 * np.sin(np.pi * u), u, 0.2 * np.sin(2 * np.pi * u)])


def quick(speed):
    """Parameters with a clock so fast that much happens in a second, and so slow to brake that the governor must."""
    clock = ClockParams(acceleration=2.0, deceleration=1.5, jerk=60.0, brake=0.2)
    return eqx.tree_at(lambda p: (p.motion.clock, p.motion.speed), Params(), (clock, speed))


def visit(at):
    """The person comes to the tool and leaves; one frame is invalid, so that data age; another has lost points."""
    gap = np.interp(
        np.arange(FRAMES) / 30, [0.0, 0.25, 0.35, 0.45, 0.55, 0.6, 0.8], [1.5, 1.1, 0.75, 0.7, 0.0, 0.0, 1.9]
    )
    frames = frames_of(at, gap)
    valid, overflow = frames.valid.at[17].set(False), frames.overflow.at[26].set(True)
    return quick(0.6), eqx.tree_at(lambda f: (f.valid, f.overflow), frames, (valid, overflow)), bow(at, 0.3)


def alone(at):
    """Nobody, the first frames missing, and a short path that ends."""
    frames = frames_of(at, np.zeros(FRAMES), present=False)
    frames = eqx.tree_at(lambda f: f.valid, frames, frames.valid.at[:4].set(False))
    return quick(0.3), frames, bow(at, 0.035)


def broken(at):
    """A policy that is not a number."""
    params, frames, path = visit(at)
    return eqx.tree_at(lambda p: p.policy.target.kp, params, float("nan")), frames, path


@pytest.fixture(scope="module")
def program(cell):
    q = jnp.asarray(cell.arm.home)

    @jax.jit
    def run(params, frames, path):
        return follow(params, cell, path_curve(path), frames, q, fit_fields(params.field, frames))[1]

    return run


def both(program, cell, scenario):
    """The records of the JAX loop and of the serial one."""
    params, frames, path = scenario
    ours = program(jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), params), frames, jnp.asarray(path))
    theirs = episode(params, cell, Curve(path), see(params.field, frames), np.asarray(cell.arm.home))
    return ours, theirs


def assert_same(ours, theirs):
    for name in (f.name for f in dataclasses.fields(theirs)):
        atol = 1e-8 if name == "tau" else 1e-9
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=0, atol=atol, err_msg=name)


def test_a_person_comes_and_goes(program, cell, at):
    ours, theirs = both(program, cell, visit(at))
    assert_same(ours, theirs)
    reasons = np.bitwise_or.reduce(np.asarray(ours.reasons))
    assert reasons == OLD_DATA | INVALID_FRAME | TOO_CLOSE | WAITING, "the scenario must show all of them"
    assert set(theirs.zone) == {1, 2, 3} and np.diff(theirs.zone).min() < 0
    assert theirs.separation.min() < 0
    assert ((theirs.approach > theirs.speed_limit) & (theirs.speed_limit > 0)).any(), "the governor must have work"


def test_nobody_there_to_the_end_of_the_path(program, cell, at):
    ours, theirs = both(program, cell, alone(at))
    assert_same(ours, theirs)
    assert np.asarray(ours.reasons)[0] == OLD_DATA and theirs.zone[-1] == 0
    assert theirs.travelled[-1] == theirs.travelled[-2] > 0.035, "the clock must come to the end"
    assert (theirs.status == TORQUE_LIMITED).any()


def test_a_command_that_is_not_finite(program, cell, at):
    ours, theirs = both(program, cell, broken(at))
    assert_same(ours, theirs)
    assert np.all(theirs.status & 1)


def test_the_record_has_the_same_names(program, cell, at):
    _, theirs = both(program, cell, broken(at))
    assert {f.name for f in dataclasses.fields(theirs)} == {f.name for f in dataclasses.fields(Record)} - {"reasons"}


@pytest.mark.parametrize(("static", "moving"), [(30, 20), (0, 20), (30, 0), (0, 0)])
def test_fields_near_far_and_empty(static, moving):
    rng = np.random.default_rng(1)
    clouds = [rng.uniform(-0.3, 0.3, (30, 3)) for _ in range(2)]
    near = clouds[1][0] + np.outer([0.0, 1e-4, 0.003, 0.006, 0.008, 0.03], [0.6, 0.0, 0.8])
    x = np.concatenate([near, rng.uniform(-2, 2, (20, 3))])
    counts = np.array([static, moving])

    @jax.jit
    def read(clouds, masks, x):
        a, b = (fit(Cloud(cloud, mask), FieldParams()) for cloud, mask in zip(clouds, masks, strict=True))
        d_all, g_all, d, g = jax.vmap(lambda one: union_distance_and_gradient(a, b, one))(x)
        return d_all, g_all, d, g, jax.vmap(lambda one: lower_bound(one, 0.05, a.length_scale))(d)

    ours = read(jnp.asarray(clouds), jnp.asarray(np.arange(30) < counts[:, None]), jnp.asarray(x))
    length_scale, noise = FieldParams().length_scale, FieldParams().noise
    a, b = (serial_fields.fit(cloud[:count], length_scale, noise) for cloud, count in zip(clouds, counts, strict=True))
    theirs = serial_fields.union(a, b, x)
    for one, another in zip(ours, (*theirs, serial_fields.lower_bound(theirs[2], 0.05, length_scale)), strict=True):
        np.testing.assert_allclose(one, another, rtol=1e-9, atol=1e-11)


def test_clock_from_anywhere():
    """Braking, jerk, the end near and far, holds; 1e-7 for the derivative by differences."""
    rng = np.random.default_rng(2)
    params, dt, count = Params().motion.clock, 0.008, 400
    s, v, a = rng.uniform(0, 1, count), rng.uniform(0, 0.8, count), rng.uniform(-3, 1, count)
    limit, left = rng.uniform(-0.1, 1.0, count), rng.uniform(0, 1, count) ** 3
    hold, limit = rng.uniform(size=count) < 0.1, np.where(rng.uniform(size=count) < 0.1, np.nan, limit)

    def one(s, v, a, limit, left, hold):
        after = jax_advance(params, ClockState(s, v, a), limit, left, dt, hold)
        return after.s, after.v, after.a

    columns = (s, v, a, limit, left, hold)
    ours = np.stack(jax.jit(jax.vmap(one))(*map(jnp.asarray, columns)), axis=1)
    states = zip(*(column.tolist() for column in columns), strict=True)
    theirs = [advance(params, Clock(s, v, a), limit, left, dt, hold) for s, v, a, limit, left, hold in states]
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-7)
