"""Always a way to stop: from random states the arm comes to rest before the separation is less than the intrusion distance."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.safety.always_stop import DT, KEPT, StopState, approach, margins, random_state
from hrcjax.safety import SafetyParams, SsmParams, allowed_speed, separation_distance
from hrcjax.sim.params import sensed_safety

STATES = 200


def numbers(params: SafetyParams) -> SafetyParams:
    return jax.tree.map(lambda leaf: jnp.asarray(float(leaf)), params)


@partial(jax.jit, static_argnums=(3, 4))
def played(params: SafetyParams, true: SsmParams, seed: jax.Array, harsh: bool = False, encoders: bool = True):
    return margins(params, true, jax.random.split(jax.random.key(seed), STATES), harsh, encoders)


def least(params: SafetyParams, true: SsmParams, seed: int, **how: bool) -> float:
    found, _ = played(params, true, jnp.asarray(seed), how.get("harsh", False), how.get("encoders", True))
    return float(np.min(found.moving_least))


@pytest.mark.parametrize("defaults", [SafetyParams, sensed_safety])
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31 - 1))
def test_the_arm_rests_before_the_intrusion_distance(defaults, seed: int) -> None:
    params = numbers(defaults())
    assert least(params, params.ssm, seed) >= 0


@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 2**31 - 1),
    brake=st.floats(0.5, 8.0),
    reaction=st.floats(0.03, 0.11),
    intrusion=st.floats(0.0, 0.3),
    person=st.floats(0.3, 2.0),
)
def test_with_any_numbers_that_both_agree_on(
    seed: int, brake: float, reaction: float, intrusion: float, person: float
) -> None:
    ssm = SsmParams(
        v_h=person, v_h_near=1.25 * person, reaction_time=reaction, brake=brake, intrusion=intrusion, Z_d=0.0, Z_r=0.0
    )
    params = numbers(SafetyParams(ssm=ssm))
    assert least(params, params.ssm, seed) >= 0


@pytest.mark.parametrize(
    ("term", "value"), [("reaction_time", 0.0), ("brake", 6.0), ("v_h", 0.8), ("v_h_near", 1.0), ("intrusion", 0.05)]
)
def test_a_law_without_a_term_fails(term: str, value: float) -> None:
    """So that the property can fail: what the monitor believes is too good for what holds."""
    params = numbers(sensed_safety())
    wrong = eqx.tree_at(lambda p: getattr(p.ssm, term), params, jnp.asarray(value))
    assert least(wrong, params.ssm, 0) < -1e-3


def test_a_person_who_speeds_up_within_half_a_metre_is_not_counted_on() -> None:
    """ISO 13855 assumes 2 m/s under 0.5 m and 1.6 m/s beyond. Who comes from beyond and speeds up gets under C, not to contact."""
    params = numbers(sensed_safety())
    harsh = min(least(params, params.ssm, seed, harsh=True) for seed in range(5))
    assert -0.05 < harsh < 0 and params.ssm.intrusion + params.ssm.Z_r + harsh > 0


def test_old_distances_are_not_enough() -> None:
    """Why the distance is read from where the arm is now: S_p counts the arm's present speed over the reaction time, not the
    greater one that it had when the image was taken."""
    params = numbers(sensed_safety())
    assert min(least(params, params.ssm, seed, encoders=False) for seed in range(5)) < 0


def test_the_closest_is_that_of_the_formula() -> None:
    """A person at the full speed, an image as old as the reaction time, a point at the allowed speed that brakes once: C to the tick."""
    params = numbers(SafetyParams(ssm=SsmParams(reaction_time=11 * DT, Z_d=0.0, Z_r=0.0)))
    ssm = params.ssm
    d = jnp.asarray(0.45)
    v = allowed_speed(ssm, d, ssm.v_h_near)
    np.testing.assert_allclose(separation_distance(ssm, v, ssm.v_h_near), d, rtol=1e-12)
    start = StopState(
        d, jnp.asarray(1.0), jnp.asarray(1.0), jnp.asarray(0.0), jnp.asarray(9, jnp.int32), jnp.asarray(1, jnp.int32)
    )
    found = jax.jit(approach)(params, ssm, start, jax.random.key(0))
    gap = float(found.moving_least - ssm.intrusion)
    # what is left: the arm's way since the image, which the encoders know, and the ticks in which the limit falls already
    assert found.rest and 0 <= gap <= float(v) * 11 * DT + 2 * DT * float(ssm.v_h_near)


def test_states_are_covered_by_the_reaction_time() -> None:
    ssm = numbers(SafetyParams()).ssm
    states = jax.vmap(lambda key: random_state(ssm, key))(jax.random.split(jax.random.key(1), 500))
    oldest = np.asarray(states.latency + states.period) * DT
    assert np.all(oldest + DT <= ssm.reaction_time + 1e-9) and np.max(oldest) > ssm.reaction_time - 2 * DT
    assert np.max(states.latency + states.period) < KEPT and np.min(states.latency) >= 0 and np.min(states.period) >= 1
    assert np.unique(states.person).size > 100 and np.mean(states.person == 1) > 0.3
