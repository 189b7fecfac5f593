import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plan_scenes import GOAL, PRINTED, START, scene
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

from hrcjax.numerics import safe_norm
from hrcjax.plan import PlanParams, optimise_path
from hrcjax.plan.point_guesses import detour_guesses, detours

COUNT = 40
WIDE = jnp.full(3, 10.0)


def params(zeta=4.0, omega1=1.0, omega2=0.01, dtype=jnp.float64):
    default = jax.tree.map(lambda x: jnp.asarray(x, dtype), PlanParams())
    where = lambda p: (p.potential.zeta, p.path.omega1, p.path.omega2)  # noqa: E731
    return eqx.tree_at(where, default, tuple(jnp.asarray(x, dtype) for x in (zeta, omega1, omega2)))


@jax.jit
def solve(params, start, goal, centers, radius, lower, upper):
    """From a straight guess, among two or more balls."""
    dtype = start.dtype
    guess = start + jnp.linspace(0, 1, COUNT, dtype=dtype)[:, None] * (goal - start)
    return optimise_path(params, guess, lambda x: safe_norm(x - centers) - radius, radius, lower, upper, 14)


def balls(params, centers, radius=0.03, start=START, goal=GOAL, lower=-WIDE, upper=WIDE):
    """`solve` with four balls, the missing ones far away."""
    dtype = params.path.omega1.dtype
    centers = np.concatenate([np.atleast_2d(centers), np.full((4, 3), 50.0)])[:4]
    return solve(params, *(jnp.asarray(x, dtype) for x in (start, goal, centers, np.full(4, radius), lower, upper)))


def round_a_ball(start, goal, centre, radius):
    """Length of the shortest path round one ball: tangent, arc, tangent."""
    a, b = np.linalg.norm(start - centre), np.linalg.norm(goal - centre)
    angle = np.arccos(np.dot(start - centre, goal - centre) / (a * b)) - np.arccos(radius / a) - np.arccos(radius / b)
    return np.sqrt(a**2 - radius**2) + np.sqrt(b**2 - radius**2) + radius * angle


CENTRE = (START + GOAL) / 2 + np.array([0.01, 0.02, -0.01])


@pytest.mark.parametrize("zeta", [1.0, 2.0, 4.0])
def test_shortest_path_round_a_ball(zeta):
    result = balls(params(zeta, omega2=1e-6), CENTRE)
    np.testing.assert_allclose(result.length, round_a_ball(START, GOAL, CENTRE, zeta * 0.03), rtol=4e-4)
    np.testing.assert_allclose(result.clearance, (zeta - 1) * 0.03, atol=4e-4)
    assert int(result.status) == 15


def test_robotica_optimum_with_clearance():
    """Centre distance 12 cm: 73.20 cm."""
    result = balls(params(4.0, omega2=1e-6), PRINTED)
    np.testing.assert_allclose(result.length, 0.7320, atol=2e-4)
    np.testing.assert_allclose(balls(params(1.0), PRINTED).length, np.linalg.norm(START - GOAL), rtol=1e-6)


def test_the_optimum_of_an_independent_solver():
    """A natural spline through nine knots, length and bending energy by quadrature, constraints at 81 points, SLSQP."""
    omega2, need, fine = 0.01, 0.12, np.linspace(0, 8, 161)

    def curve(x):
        return CubicSpline(np.arange(9), np.vstack([START, x.reshape(7, 3), GOAL]), bc_type="natural")

    def cost(x):
        c = curve(x)
        d, dd = c(fine, 1), c(fine, 2)
        speed = np.linalg.norm(d, axis=1)
        bend = np.sum(np.cross(d, dd) ** 2, axis=1) / speed**6
        return np.trapezoid((1 + omega2 * bend) * speed, fine)

    def spare(x):
        return (np.linalg.norm(curve(x)(fine[::2])[:, None] - PRINTED[None], axis=2) - need).ravel()

    guess = (START + np.linspace(0, 1, 9)[1:-1, None] * (GOAL - START)).ravel()
    best = minimize(cost, guess, constraints={"type": "ineq", "fun": spare}, options={"maxiter": 60, "ftol": 1e-9})
    result = balls(params(4.0, omega2=omega2), PRINTED)
    value = float(result.length + omega2 * result.bending_energy)
    np.testing.assert_allclose(value, best.fun, rtol=3e-4)
    np.testing.assert_allclose(result.length, cost_length(curve(best.x), fine), rtol=5e-4)


def cost_length(curve, fine):
    return np.trapezoid(np.linalg.norm(curve(fine, 1), axis=1), fine)


def test_waypoints_are_equally_spaced_and_ends_stay():
    result = balls(params(4.0, omega2=1e-3), CENTRE)
    steps = np.linalg.norm(np.diff(result.waypoints, axis=0), axis=1)
    assert steps.std() / steps.mean() < 2e-3
    np.testing.assert_array_equal(result.waypoints[0], START)
    np.testing.assert_array_equal(result.waypoints[-1], GOAL)


def test_constraints_hold_between_waypoints():
    """A ball smaller than the spacing, on the line between two waypoints."""
    result = balls(params(2.0, omega2=1e-4), START + (GOAL - START) * 19.5 / 39 + 1e-4, radius=0.006)
    assert bool(result.clear) and float(result.violation) <= 5e-4


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 1000))
def test_moving_the_scene_moves_the_path(seed):
    draw = np.random.default_rng(seed)
    turn, shift = np.linalg.qr(draw.normal(size=(3, 3)))[0], draw.normal(size=3)
    base = balls(params(4.0), PRINTED)
    moved = balls(params(4.0), PRINTED @ turn.T + shift, start=turn @ START + shift, goal=turn @ GOAL + shift)
    np.testing.assert_allclose(moved.waypoints, base.waypoints @ turn.T + shift, atol=2e-6)
    np.testing.assert_allclose(moved.bending_energy, base.bending_energy, rtol=1e-4)


@settings(max_examples=10, deadline=None)
@given(st.floats(-4, 4))
def test_only_the_ratio_of_the_weights_counts(power):
    base, scaled = balls(params(4.0), CENTRE), balls(params(4.0, 10**power, 0.01 * 10**power), CENTRE)
    np.testing.assert_allclose(scaled.waypoints, base.waypoints, atol=1e-8)


def test_more_weight_on_bending_bends_less_and_is_longer():
    results = [balls(params(3.0, omega2=w), CENTRE) for w in (1e-4, 1e-3, 1e-2, 1e-1)]
    energy, lengths = [float(r.bending_energy) for r in results], [float(r.length) for r in results]
    assert all(b < a for a, b in itertools.pairwise(energy))
    assert all(b > a for a, b in itertools.pairwise(lengths))


@settings(max_examples=10, deadline=None)
@given(st.floats(1, 5), st.floats(0, 1))
def test_more_clearance_is_kept_when_asked_for(zeta, more):
    near, far = balls(params(zeta), CENTRE), balls(params(zeta + more), CENTRE)
    assert float(far.clearance) >= float(near.clearance) - 1e-5
    assert float(far.length) >= float(near.length) - 1e-6
    assert bool(near.clear) and bool(far.clear)


def test_bounds_turn_the_path_aside():
    centre = (START + GOAL) / 2 - np.array([0, 0, 0.02])
    free = balls(params(3.0), centre)
    assert float(free.waypoints[:, 2].max()) > 0.155
    low = balls(params(3.0), centre, upper=np.array([10, 10, 0.155]))
    assert float(low.waypoints[:, 2].max()) < 0.1555 and int(low.status) == 15
    assert float(low.length) > float(free.length)
    lower = balls(params(3.0), centre + np.array([0, 0, 0.04]), lower=np.array([-10, -10, 0.049]))
    assert float(lower.waypoints[:, 2].min()) > 0.0485 and int(lower.status) == 15


def test_gap_too_narrow_is_the_least_violation_and_says_so():
    """Two balls 16 cm apart of which each wants 10 cm; the others keep the path between them."""
    across = np.cross(GOAL - START, [0, 0, 1])
    across /= np.linalg.norm(across)
    middle = (START + GOAL) / 2
    up = np.cross(across, GOAL - START)
    up /= np.linalg.norm(up)
    walls = [middle + 0.08 * across, middle - 0.08 * across, middle + 0.08 * up, middle - 0.08 * up]
    result = balls(params(5.0, omega2=0.01), np.array(walls), radius=0.02)
    assert np.isfinite(result.waypoints).all()
    assert not bool(result.clear) and int(result.status) == 13
    np.testing.assert_allclose(result.violation, 0.02, atol=0.002)


def test_start_inside_the_required_distance():
    centre = START + np.array([0.0, 0.08, 0.0])
    result = balls(params(4.0), centre)
    np.testing.assert_allclose(result.violation, 0.04, atol=1e-6)  # at the start itself, 8 of 12 cm
    assert not bool(result.clear)
    assert float(result.length) < 0.76  # it leaves gently


def test_start_outside_the_bounds_is_reported():
    result = balls(params(4.0), CENTRE, upper=np.array([10, 10, 0.14]))
    assert int(result.status) == 11
    assert np.isfinite(result.waypoints).all()


def test_guess_through_the_centre_of_a_ball_is_finite():
    result = balls(params(2.0), (START + GOAL) / 2)
    assert np.isfinite(result.waypoints).all()


def test_single_precision_agrees():
    exact, single = balls(params(4.0), PRINTED), balls(params(4.0, dtype=jnp.float32), PRINTED)
    assert single.length.dtype == jnp.float32 and single.waypoints.dtype == jnp.float32
    np.testing.assert_allclose(single.waypoints, exact.waypoints, atol=2e-5)
    np.testing.assert_allclose(single.bending_energy, exact.bending_energy, rtol=5e-3)


def test_length_grows_with_zeta_as_the_closed_form():
    def total(zeta):  # no bounds at all
        return balls(params(zeta, omega2=1e-6), CENTRE, lower=np.full(3, -np.inf), upper=np.full(3, np.inf)).length

    slope = jax.jvp(total, (jnp.asarray(3.0),), (jnp.asarray(1.0),))[1]
    h = 1e-4
    ends = [round_a_ball(START, GOAL, CENTRE, z * 0.03) for z in (3 - h, 3 + h)]
    np.testing.assert_allclose(slope, (ends[1] - ends[0]) / (2 * h), rtol=0.02)


def test_sizes_are_checked():
    s = scene()
    for count, iterations in ((3, 5), (8, -1)):
        with pytest.raises(ValueError, match="accepted are at least"):
            optimise_path(params(), jnp.zeros((count, 3)), s.distances, s.radius, s.lower, s.upper, iterations)


def test_guesses_through_obstacles_come_to_rest():
    """Of bows and the straight line among columns, those that can be kept at all are kept after the usual 10 iterations.

    Without the limit of a step 17 % of them still run to and fro through the columns.
    """
    low, high = jnp.asarray([-0.05, 0.1, 0.02]), jnp.asarray([0.85, 0.85, 0.6])
    aside = jnp.asarray(detours(7))

    def optimised(iterations):
        def kept(centers):
            s = scene("columns", centers=centers)
            guesses = detour_guesses(s.start, s.goal, low, high, aside, COUNT)

            def one(guess):
                found = optimise_path(params(3.0), guess, s.distances, s.radius, low, high, iterations)
                return found.clear & found.inside

            return jax.lax.map(one, guesses)

        return jax.jit(lambda centers: jax.lax.map(kept, centers))

    def drawn(seed):
        draw = np.random.default_rng(seed)
        at = START + draw.uniform(0.2, 0.8, (4, 1)) * (GOAL - START) + draw.uniform(-0.04, 0.04, (4, 3))
        return np.column_stack([at[:, :2], draw.uniform(0.15, 0.5, 4)])

    centers = jnp.asarray([drawn(seed) for seed in range(12)])
    soon, at_last = (np.asarray(optimised(iterations)(centers)) for iterations in (10, 40))
    assert at_last.sum() > 50 and soon[at_last].mean() > 0.9
