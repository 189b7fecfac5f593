"""One tick: what the arm does when it must hold, and when what it measures is not a number."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from straight import straight_route

from hrcjax.numerics import unrolled_options
from hrcjax.plan import PathParams
from hrcjax.robot import control_points
from hrcjax.safety import SsmParams, stopping_distance
from hrcjax.sim import Fields, Params, fit_fields
from hrcjax.sim.tick import (
    NOT_FINITE_COMMAND,
    NOT_FINITE_READING,
    Sensed,
    full_brake,
    initial_state,
    joint_limits,
    tick,
)


@pytest.fixture(scope="module")
def program(cell, world):
    params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), Params(plan=PathParams()))
    frames = world.frames
    route = straight_route(cell, world)
    fields = jax.jit(fit_fields)(params.field, frames)
    newest = Fields(fields.static, jax.tree.map(lambda a: a[0], fields.moving))

    def run(state, age, aside=0.03):
        asked = eqx.tree_at(lambda p: p.safety.zone.aside, params, jnp.asarray(aside, jnp.float32))
        sensed = Sensed(newest, age, jnp.asarray(True), jnp.asarray(False), jnp.asarray(0))
        return tick(asked, cell, route, sensed, state)

    return jax.jit(run, compiler_options=unrolled_options())


@pytest.mark.slow
@pytest.mark.parametrize("joint", [0, 4])
@pytest.mark.parametrize("part", ["q", "qd"])
def test_measured_nan_is_named_and_reaches_no_command(program, cell, world, part, joint) -> None:
    state = initial_state(cell, world.q_start)
    state = eqx.tree_at(lambda s: s.arm.qd, state, jnp.full(6, 0.3, jnp.float32))
    state = eqx.tree_at(lambda s: getattr(s.arm, part), state, getattr(state.arm, part).at[joint].set(jnp.nan))
    _, record = program(state, jnp.asarray(0.05, jnp.float32))
    assert int(record.status) & NOT_FINITE_COMMAND
    assert np.isfinite(record.qdd).all() and np.isfinite(record.tau).all()
    others = np.arange(6) != joint if part == "qd" else np.full(6, True)
    assert np.all(np.asarray(record.qdd)[others] < -5.0), "joints whose speed is known brake"


@pytest.mark.slow
def test_old_data_brake_at_the_joints_full_rate(program, world, cell) -> None:
    state = eqx.tree_at(lambda s: s.arm.qd, initial_state(cell, world.q_start), jnp.full(6, 0.5, jnp.float32))
    _, record = program(state, jnp.asarray(0.3, jnp.float32))
    np.testing.assert_allclose(record.qdd, -15.0, rtol=1e-4)


@pytest.mark.slow
def test_a_bound_of_directions_that_is_no_number_is_named(program, world, cell) -> None:
    """Unchecked it would count as a direction known exactly."""
    state, old = initial_state(cell, world.q_start), jnp.asarray(0.3, jnp.float32)
    assert not int(program(state, old)[1].status) & NOT_FINITE_READING
    assert int(program(state, old, jnp.nan)[1].status) & NOT_FINITE_READING


def test_way_of_a_held_arm_is_within_what_separation_counts_on(cell) -> None:
    """From 1 m/s of its fastest point, in any posture and direction: not more than S_s of ISO/TS 15066 and one tick."""
    limits = joint_limits(cell, jnp.dtype("float64"))
    brake = jax.jit(lambda qd: full_brake(qd, limits, cell.dt))
    points = jax.jit(lambda q: control_points(cell.arm, q))
    speeds = jax.jit(
        lambda q, qd: jnp.linalg.norm(jax.jvp(lambda q: control_points(cell.arm, q), (q,), (qd,))[1], axis=1)
    )
    random, allowed = np.random.default_rng(0), float(stopping_distance(SsmParams(), 1.0))
    for _ in range(20):
        q = random.uniform(-np.pi, np.pi, 6)
        qd = random.normal(size=6)
        qd /= np.asarray(speeds(q, qd)).max()
        qd *= min(1.0, np.pi / np.abs(qd).max())
        before, way = np.asarray(points(q)), 0.0
        for _ in range(60):
            qdd = np.asarray(brake(jnp.asarray(qd)))
            q, qd = q + qd * cell.dt + qdd * cell.dt**2 / 2, qd + qdd * cell.dt
            now = np.asarray(points(q))
            way, before = way + np.linalg.norm(now - before, axis=1), now
        assert np.abs(qd).max() < 1e-9
        assert np.max(way) < allowed + 1.0 * cell.dt
