"""The optimiser of shortest paths: a box in the way, its step against the readable optimiser, and the straight line where it is free."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.plan.joint_spline import control_places
from hrcjax.plan.link_model import link_model
from hrcjax.plan.rounded_boxes import RoundedBoxes
from hrcjax.plan.shortest import ShortestParams, guess_cost, problem, quality, shortened
from hrcjax.robot import arm_capsules, load_arm

ARM = load_arm("ur5")
MODEL = link_model(ARM, 0.01, floor=0.0)
HOME = np.array([0.0, -1.6, 1.6, -1.6, -1.6, 0.0])
PARAMS = jax.tree.map(jnp.float32, ShortestParams())


def box_in_the_way():
    middle = np.asarray(arm_capsules(ARM, jnp.asarray(HOME + np.array([0.8, 0, 0, 0, 0, 0]), jnp.float32)).b[-1], float)
    x, y, z = middle
    arrays = np.array([[x, y, z / 2]]), np.array([[0.04, 0.04, z / 2]]), np.zeros(1)
    return RoundedBoxes(*(jnp.asarray(a, jnp.float32) for a in arrays))


@jax.jit
def solve(start, goal, inner, solids):
    at = problem(MODEL, start, goal, solids)
    found = shortened(MODEL, PARAMS, at, inner, 64, 16, 0.03)
    costs = [guess_cost(MODEL, PARAMS, at, x, 32, jnp.float32(1.0)) for x in (inner, found)]
    return found, quality(MODEL, PARAMS, at, inner, 129), quality(MODEL, PARAMS, at, found, 129), jnp.stack(costs)


def solved(solids):
    goal = HOME + np.array([1.6, 0, 0, 0, 0, 0])
    straight = HOME + control_places(12)[1:-1, None] * (goal - HOME)
    start, goal, inner = (jnp.asarray(x, jnp.float32) for x in (HOME, goal, straight))
    return inner, *solve(start, goal, inner, solids)


def test_the_path_goes_round_a_box():
    _, _, before, after, costs = solved(box_in_the_way())
    assert before.gap < 0 and after.gap > PARAMS.self_gap - 0.001 and after.missed < 0.003
    assert 1.6 < after.length < 3.2
    assert costs[1] < costs[0]


def test_the_straight_line_stays_where_it_is_free():
    far = RoundedBoxes(
        jnp.full((1, 3), 5.0, jnp.float32), jnp.full((1, 3), 0.1, jnp.float32), jnp.zeros(1, jnp.float32)
    )
    guess, found, before, after, _ = solved(far)
    np.testing.assert_allclose(found, guess, atol=2e-3)
    np.testing.assert_allclose(after.length, 1.6, rtol=1e-4)
    assert before.missed < 1e-3
