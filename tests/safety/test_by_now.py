"""Limits towards surfaces that may be the nearest by now."""

import jax
import jax.numpy as jnp
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hrcjax.cells import make_cell
from hrcjax.safety import MISSING_DATA, SafetyParams, initial_zone, monitor, nearest_by_now
from hrcjax.sim import Separation, separation_monitor
from hrcjax.sim.govern import Rows

PARAMS = SafetyParams()
NEAR, FAST = 0.6, PARAMS.ssm.v_h_near
look = jax.jit(lambda d, nearest, age: nearest_by_now(PARAMS, d, nearest, age, 0.008))


@given(st.floats(0.0, 1.0), st.floats(0.0, 0.1))
def test_an_arm_that_comes_past_the_trunk_had_its_limit_before(gap, age) -> None:
    """At `v_h_near` it is where the limit counts it, or the trunk is nearer still."""
    d = jnp.asarray([NEAR, NEAR + gap])
    counted = np.asarray(look(d, jnp.full(2, NEAR), age))
    there = NEAR + gap - FAST * (age + 0.008)
    assert counted[0] == NEAR
    np.testing.assert_allclose(counted[1], max(there, NEAR), rtol=1e-12)


def test_alone_a_surface_counts_as_it_is_and_missing_data_stay_missing() -> None:
    d = jnp.asarray([0.3, 1.5])
    np.testing.assert_array_equal(look(d, d, 0.05), d)
    assert np.isnan(look(jnp.asarray([0.5, jnp.nan]), jnp.asarray([jnp.nan, jnp.nan]), 0.05)).all()
    np.testing.assert_allclose(
        look(jnp.asarray([0.9]), jnp.asarray([0.5]), jnp.inf), 0.9 - FAST * (PARAMS.max_age + 0.008)
    )


def test_the_monitor_limits_by_it_and_its_zone_by_the_distance() -> None:
    d = jnp.asarray([0.6, 0.7])
    tick = jax.jit(lambda by_now: monitor(PARAMS, initial_zone(jnp.float64), d, 0 * d, 0.05, 0.008, by_now=by_now)[1])
    alone, both = tick(d), tick(jnp.asarray([0.6, 0.6]))
    assert alone.point_limit[1] > alone.point_limit[0]
    assert both.point_limit[1] == both.point_limit[0] == alone.point_limit[0]
    assert both.zone == alone.zone


def test_by_now_never_raises_a_limit_and_missing_numbers_hold() -> None:
    d = jnp.asarray([0.6, 0.7])
    tick = jax.jit(lambda by_now: monitor(PARAMS, initial_zone(jnp.float64), d, 0 * d, 0.05, 0.008, by_now=by_now)[1])
    np.testing.assert_array_equal(tick(d + 8.0).point_limit, tick(d).point_limit)
    for missing in (jnp.nan, jnp.inf):
        held = tick(jnp.asarray([0.6, missing]))
        assert held.hold and int(held.reasons) & MISSING_DATA and not held.point_limit.any()


def test_the_nearest_of_every_points_surfaces() -> None:
    """Two control points of the arm, three surfaces each."""
    arm = make_cell().arm
    points = len(arm.control_radii)
    distance = jnp.full((points, 3), 2.0).at[0].set(jnp.asarray([0.5, 0.3, 0.9])).at[1, 2].set(0.1)
    found = Rows.towards(arm, distance, jnp.zeros((points, 3, 3)), jnp.zeros((points, 3, 6))).nearest()
    np.testing.assert_array_equal(found[:9], [0.3] * 3 + [0.1] * 3 + [2.0] * 3)


def test_the_cells_monitor_limits_the_farther_surface_too() -> None:
    d, nearest = jnp.asarray([0.6, 0.7, 1.9]), jnp.full(3, 0.6)
    yes, dt = jnp.asarray(True), jnp.asarray(0.008)
    decide = jax.jit(
        lambda nearest: (
            separation_monitor(
                PARAMS, initial_zone(jnp.float64), Separation(d, 0 * d, jnp.asarray(0.05), yes, ~yes, dt, None, nearest)
            )[1].point_limit
        )
    )
    alone, both = decide(d), decide(nearest)
    assert alone[0] < alone[1] < alone[2]
    assert both[1] == both[0] == alone[0] and both[0] < both[2] <= alone[2]
