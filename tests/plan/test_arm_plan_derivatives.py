"""Derivatives of the planned path by every knob and by the obstacles, against central differences in float64."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.numerics import safe_norm
from hrcjax.plan import ArmPathParams, ArmPlanSizes, PotentialParams, arm_body, plan_arm, point_body
from hrcjax.robot import load_arm

Q_START, Q_GOAL = [-1.868, -1.015, 1.268, -1.823, -1.571, 0.066], [-2.881, -0.807, 1.182, -1.946, -1.571, 0.077]
CASES = {
    "point": (point_body(), [0.1, 0.7, 0.15], [0.7, 0.3, 0.05], [[0.40, 0.52, 0.12], [0.55, 0.33, 0.05]]),
    "point, other side": (point_body(), [0.1, 0.7, 0.15], [0.7, 0.3, 0.05], [[0.40, 0.45, 0.02], [0.25, 0.65, 0.2]]),
    "arm": (arm_body(load_arm("ur5"), 0.03), Q_START, Q_GOAL, [[0.40, 0.52, 0.14], [0.35, 0.65, 0.1]]),
}
SIZES = ArmPlanSizes(control=8, samples=24, iterations=10, polish=50, guesses=1, waypoints=24, descent=2)
NAMES = ("k_att", "k_rep", "zeta", "omega1", "omega2", "omega3", "obstacle_x")


def outcome(case, values):
    """Length, bending energy, cost, a waypoint and the mean ratio."""
    body, start, goal, centers = CASES[case]
    start, goal, centers = (jnp.asarray(x, jnp.float64) for x in (start, goal, centers))
    centers = centers.at[0, 0].add(values[6])
    potential = jax.tree.map(jnp.float64, PotentialParams())
    potential = eqx.tree_at(lambda p: (p.k_att, p.k_rep, p.zeta), potential, tuple(values[:3]))
    path = jax.tree.map(jnp.float64, ArmPathParams())
    path = eqx.tree_at(lambda p: (p.omega1, p.omega2, p.omega3), path, tuple(values[3:6]))
    wide = jnp.full(3, jnp.inf)

    def balls(x):
        return safe_norm(x - centers) - 0.03

    found = plan_arm(path, potential, body, start, goal, balls, jnp.full(2, 0.03), -wide, wide, SIZES)
    middle = found.tool[SIZES.waypoints // 2]
    return jnp.concatenate([jnp.stack([found.length, found.bending_energy, found.cost, jnp.mean(found.ratio)]), middle])


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_derivatives_equal_finite_differences(case):
    """Within 1e-3, with 50 steps of polish and differences of 1e-4 of each knob."""
    at = jnp.asarray([0.03, 2e-5, 2.5, 1.0, 0.01, 1.0, 0.0])
    value = jax.jit(lambda v: outcome(case, v))
    reverse = np.asarray(jax.jit(jax.jacrev(lambda v: outcome(case, v)))(at))
    scale = np.abs(np.asarray(value(at)))
    for k, name in enumerate(NAMES):
        h = 1e-4 * float(at[k]) if k < 6 else 1e-5
        step = jnp.zeros(7).at[k].set(h)
        difference = (np.asarray(value(at + step)) - np.asarray(value(at - step))) / (2 * h)
        # of the derivative or, where that vanishes, of the value over the knob
        bound = 1e-3 * np.abs(difference) + 1e-5 * scale / (float(at[k]) if k < 6 else 1.0)
        assert (np.abs(reverse[:, k] - difference) < bound).all(), (name, reverse[:, k], difference)
    assert np.abs(reverse[0]).min() > 1e-6  # every knob moves the path
