"""Limits towards surfaces that may be the nearest by now."""

import jax
import jax.numpy as jnp
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hrcjax.safety import SafetyParams, initial_zone, monitor, nearest_by_now

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
