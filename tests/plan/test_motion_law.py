"""The law of motion: the times of the Robotica paper's table V, also by the clock of a path, and what repulsion does to it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads
from plan_scenes import GOAL, START

from hrcjax.plan import PotentialParams, law_speed
from hrcjax.safety import ClockParams, advance, initial_clock

WAY = float(np.linalg.norm(GOAL - START))
TABLE_V = [(0.03, 4.70), (0.04, 3.51), (0.05, 2.79)]
UNBOUNDED = ClockParams(acceleration=100.0, deceleration=100.0, brake=100.0, jerk=1e5)
"""A clock that follows its speed limit within a tick or two."""


def attraction(k_att):
    return eqx.tree_at(lambda p: p.k_att, PotentialParams(), k_att)


@jax.jit
def remaining_by_step(k_att):
    """The way that remains after every step of 1/30 s [m]."""

    def step(r, _):
        r = r - law_speed(attraction(k_att), r, 0.0) / 30
        return r, r

    return jax.lax.scan(step, jnp.asarray(WAY), None, length=200)[1]


@jax.jit
def remaining_by_clock(k_att, ratio):
    """The way that remains at every tick of 8 ms [m]."""

    def tick(clock, _):
        r = WAY - clock.s
        clock = advance(UNBOUNDED, clock, law_speed(attraction(k_att), r, ratio), r, 0.008, False)
        return clock, WAY - clock.s

    return jax.lax.scan(tick, initial_clock(jnp.float64), None, length=1500)[1]


def time_within_a_centimetre(remaining, dt):
    """Between ticks by the logarithm of the distance [s]."""
    r = np.append(WAY, remaining)
    k = int(np.argmax(r < 0.01))
    return (k - 1 + np.log(r[k - 1] / 0.01) / np.log(r[k - 1] / r[k])) * dt


@pytest.mark.parametrize(("k_att", "printed"), TABLE_V)
def test_steps_of_the_paper_arrive_at_its_times(k_att, printed):
    """Within 0.4 %: rounding, and the bend round the obstacles of the table, which is none here."""
    np.testing.assert_allclose(time_within_a_centimetre(remaining_by_step(k_att), 1 / 30), printed, rtol=0.004)


@pytest.mark.parametrize(("k_att", "printed"), TABLE_V)
def test_the_clock_of_a_path_arrives_at_the_times_of_the_law(k_att, printed):
    """ln(way / 1 cm) / (30 K_att), which the paper's 30 steps a second approximate: they are faster by K_att / 2, 1.5 to 2.5 %."""
    took = time_within_a_centimetre(remaining_by_clock(k_att, 0.0), 0.008)
    np.testing.assert_allclose(took, np.log(WAY / 0.01) / (30 * k_att), rtol=0.01)
    np.testing.assert_allclose(took, printed, rtol=0.015)
    assert took > printed


def test_repulsion_slows_by_its_share():
    """Twice the time where repulsion equals attraction: an element of the path then weighs twice in the path's cost too."""
    once, twice = (time_within_a_centimetre(remaining_by_clock(0.05, ratio), 0.008) for ratio in (0.0, 1.0))
    np.testing.assert_allclose(twice, 2 * once, rtol=0.01)
    assert law_speed(PotentialParams(), 0.5, 3.0) == law_speed(PotentialParams(), 0.5, 0.0) / 4


def test_far_from_the_goal_the_speed_is_constant():
    """The attraction is K_att d* from d* on: 0.9 m/s at K_att = 0.03."""
    params = PotentialParams()
    np.testing.assert_allclose([law_speed(params, r, 0.0) for r in (1.0, 1.5, 4.0)], 0.9, rtol=1e-12)
    np.testing.assert_allclose(law_speed(params, 0.5, 0.0), 0.45, rtol=1e-12)
    assert law_speed(params, 0.0, 0.0) == 0.0


def test_derivatives_and_precision(dtype):
    k, r, ratio = (jnp.asarray(value, dtype) for value in (0.03, 0.4, 0.7))
    assert law_speed(attraction(k), r, ratio).dtype == dtype
    slopes = jax.grad(lambda k, r, ratio: law_speed(attraction(k), r, ratio), argnums=(0, 1, 2))(k, 0 * r, 0 * ratio)
    np.testing.assert_allclose(slopes, (0.0, 0.9, 0.0), rtol=1e-6)  # at the goal
    if dtype == jnp.float64:
        check_grads(lambda k, r, ratio: law_speed(attraction(k), r, ratio), (k, r, ratio), order=2)
