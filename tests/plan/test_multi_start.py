"""Many starts: never worse than one, whatever the order; ways that one start misses are found."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from plan_scenes import GOAL, START, scene

from hrcjax.plan import (
    PlanParams,
    PlanSizes,
    best_path,
    optimise_best,
    plan,
    plan_multi_start,
    plan_with_slack,
    straightest_path,
)
from hrcjax.plan.path_result import PathResult
from hrcjax.plan.point_guesses import BOWS, detour_guesses, detours, sides

SIZES = PlanSizes(steps=150, waypoints=20, iterations=8)
COUNT = 12
LOWER, UPPER = np.array([-0.05, 0.1, 0.02]), np.array([0.85, 0.85, 0.6])


def params(zeta=2.0, omega2=0.01, dtype=jnp.float64):
    default = jax.tree.map(lambda x: jnp.asarray(x, dtype), PlanParams())
    where = lambda p: (p.potential.zeta, p.path.omega2)  # noqa: E731
    return eqx.tree_at(where, default, (jnp.asarray(zeta, dtype), jnp.asarray(omega2, dtype)))


def among(centers, dtype=jnp.float64):
    return scene("columns", dtype, centers=centers)


def both(p, centers):
    s = among(centers, p.path.omega1.dtype)
    low, high = (jnp.asarray(x, s.start.dtype) for x in (LOWER, UPPER))
    one = plan(p, s.start, s.goal, s.distances, s.radius, low, high, SIZES)
    return one, plan_multi_start(p, s.start, s.goal, s.distances, s.radius, low, high, SIZES, COUNT)


solve = jax.jit(both)


def cost(p, path):
    return float(p.path.omega1 * path.length + p.path.omega2 * path.bending_energy)


def drawn(seed):
    """Columns on the straight line."""
    rng = np.random.default_rng(seed)
    at = START + rng.uniform(0.2, 0.8, (4, 1)) * (GOAL - START) + rng.uniform(-0.04, 0.04, (4, 3))
    return np.column_stack([at[:, :2], rng.uniform(0.15, 0.5, 4)])


def test_never_worse_than_a_single_start():
    better = 0
    for seed in range(25):
        p = params(zeta=1.5 + seed % 3)
        one, many = solve(p, drawn(seed))
        if bool(one.clear & one.inside):
            assert bool(many.clear & many.inside)
            assert cost(p, many) <= cost(p, one) + 1e-12
        elif not bool(many.clear & many.inside):
            assert float(many.violation) <= float(one.violation) + 1e-12 or not bool(one.inside)
        better += cost(p, many) < cost(p, one) - 1e-4 or (bool(many.clear) and not bool(one.clear))
    assert better >= 3, "else the law says nothing"


def test_a_blocked_straight_line_is_solved():
    """A column whose axis meets the middle of the line: the descent stands before it, by symmetry."""
    middle = (START + GOAL) / 2
    _, many = solve(params(), np.concatenate([[[*middle[:2], 0.5]], np.full((3, 3), 9.0)]))
    assert int(many.status) & 6 == 6
    gap = np.linalg.norm(np.asarray(many.waypoints)[:, :2] - middle[:2], axis=1) - 0.03
    assert gap.min() >= 0.03 - 1e-3 and np.isfinite(many.waypoints).all()


SOME = among(drawn(3))
GUESSES = detour_guesses(SOME.start, SOME.goal, jnp.asarray(LOWER), jnp.asarray(UPPER), jnp.asarray(detours(4)), 16)


@jax.jit
@jax.vmap
def path_and_slope(zeta, guesses):
    """The best path among columns, and its derivatives by zeta."""

    def best(zeta):
        s, asked = SOME, eqx.tree_at(lambda p: p.potential.zeta, params(), zeta)
        found = optimise_best(asked, guesses, s.distances, s.radius, jnp.asarray(LOWER), jnp.asarray(UPPER), 14)
        return found.waypoints, found.length

    return jax.jvp(best, (zeta,), (jnp.ones_like(zeta),))


def test_order_of_the_guesses_does_not_count():
    orders = jnp.stack([GUESSES, GUESSES[::-1], GUESSES[jnp.asarray([2, 0, 3, 1])]])
    (paths, lengths), _ = jax.tree.map(np.asarray, path_and_slope(jnp.asarray([2.0, 2.0, 2.0]), orders))
    np.testing.assert_allclose(paths[1:], paths[[0, 0]], atol=1e-9)
    np.testing.assert_allclose(lengths[1:], lengths[[0, 0]], rtol=1e-12)


def test_derivative_by_zeta_is_that_of_differences():
    h = 1e-5
    (_, length), (_, slope) = path_and_slope(jnp.asarray([2 - h, 2, 2 + h]), jnp.stack([GUESSES] * 3))
    np.testing.assert_allclose(slope[1], (length[2] - length[0]) / (2 * h), rtol=1e-3)
    assert abs(float(slope[1])) > 1e-3


def results(length, bend=(0.0, 0.0, 0.0), violation=(0.0, 0.0, 0.0), inside=(True, True, True)):
    def one(length, bend, violation, inside):
        clear = violation <= 5e-4
        return PathResult(jnp.zeros((4, 3)), length, bend, violation, violation, clear, clear, inside)

    return jax.vmap(one)(*(jnp.asarray(x, jnp.float64) for x in (length, bend, violation)), jnp.asarray(inside))


@pytest.mark.parametrize(
    ("paths", "best"),
    [
        (results([3.0, 2.0, 2.0]), 1),  # the first of equals
        (results([1.0, 2.0, 3.0], violation=[0.1, 0, 0]), 1),  # what is kept comes first
        (results([2.0, 1.0, 3.0], bend=[0.0, 200.0, 0.0]), 0),  # weighed with the bending
        (results([1.0, 2.0, 3.0], violation=[0.3, 0.2, 0.4]), 1),  # none kept: least violation
        (results([1.0, 2.0, 3.0], violation=[0.3, 0.2, 0.4], inside=[True, False, True]), 0),
        (results([np.nan, 2.0, 1.5], violation=[0, 0, 0]), 2),
        (results([np.nan, 2.0, 1.5], violation=[0, 0.3, 0.2]), 2),
        (results([1.0, 2.0, 3.0], inside=[False, True, True]), 1),
    ],
)
def test_which_is_best(paths, best):
    assert int(best_path(params().path, paths)) == best


@pytest.mark.parametrize(
    ("paths", "best"),
    [
        (results([1.0, 1.009, 1.02], bend=[3.0, 2.0, 1.0]), 1),  # the last is too long
        (results([1.02, 1.009, 1.0], bend=[1.0, 2.0, 2.0]), 1),  # the first of equals
        (results([0.9, 1.0, 1.005], bend=[0.1, 2.0, 1.0], violation=[0.1, 0, 0]), 2),  # no measure of length
        (results([1.0, 1.0, 1.0], bend=[1.0, 2.0, 3.0], violation=[0.3, 0.2, 0.4]), 1),
        (results([np.nan, 1.0, 1.0], bend=[0.0, 2.0, 1.0]), 2),
    ],
)
def test_which_is_straightest(paths, best):
    assert int(straightest_path(paths, 0.01)) == best


@pytest.mark.parametrize("field", ["length", "bending_energy", "violation"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_path_with_a_number_that_is_not_finite_is_never_taken(field, value):
    """The first, said to be kept, would be shortest and straightest; without it the last is the best by both rules."""
    paths = results([1.0, 2.0, 2.005], bend=[0.0, 2.0, 1.0])
    first = getattr(paths, field).at[0].set(value)
    broken = eqx.tree_at(lambda p: getattr(p, field), paths, first)
    assert int(straightest_path(broken, 0.01)) == 2
    assert int(best_path(params().path, broken)) == 2
    missed = eqx.tree_at(lambda p: p.clear, broken, jnp.zeros(3, bool))
    violated = eqx.tree_at(lambda p: p.violation, missed, missed.violation.at[1:].set([0.2, 0.1]))
    assert int(straightest_path(violated, 0.01)) == int(best_path(params().path, violated)) == 2


def test_slack_is_spent_on_less_bending():
    s, p = among(drawn(3)), params()
    low, high = jnp.asarray(LOWER), jnp.asarray(UPPER)

    def planned(slack):
        return plan_with_slack(p, s.start, s.goal, s.distances, s.radius, low, high, SIZES, slack, 4)

    found = jax.jit(jax.vmap(planned))(jnp.asarray([0.0, 0.01, 0.05]))
    assert (np.asarray(found.status) & 6 == 6).all()
    length, bend = np.asarray(found.length), np.asarray(found.bending_energy)
    assert bend[1] < bend[0] and bend[2] <= bend[1] and (np.diff(length) >= 0).all()
    assert (length <= length[0] * (1 + np.array([0.0, 0.01, 0.05])) + 1e-12).all()


@pytest.mark.parametrize("goal", [GOAL, *(START + np.array(x) for x in ([0, 0, 0.5], [0.3, 0, 0], [-0.2, -0.2, -0.2]))])
def test_guesses_start_and_end_and_keep_the_bounds(goal, dtype):
    start, end = jnp.asarray(START, dtype), jnp.asarray(goal, dtype)
    low, high = jnp.asarray(np.minimum(LOWER, goal), dtype), jnp.asarray(np.maximum(UPPER, goal), dtype)
    table = detours(15)
    assert table.shape == (15, 2, 2) and not table[0].any()
    frame = jax.jit(sides)(start, end)
    np.testing.assert_allclose(frame @ frame.T, np.eye(2), atol=1e-6)
    np.testing.assert_allclose(frame @ (end - start), 0, atol=1e-6)
    guess = jax.jit(detour_guesses, static_argnums=5)
    found = guess(start, end, low, high, jnp.asarray(table, dtype), 31)
    assert found.dtype == dtype and np.isfinite(found).all()
    np.testing.assert_allclose(found[:, 0], np.tile(START, (15, 1)), atol=1e-6)
    np.testing.assert_allclose(found[:, -1], np.tile(goal, (15, 1)), atol=1e-6)
    assert (np.asarray(found) >= np.asarray(low) - 1e-6).all() and (np.asarray(found) <= np.asarray(high) + 1e-6).all()
    far = jnp.full(3, 9, dtype)
    free = guess(start, end, -far, far, jnp.asarray(table, dtype), 31)
    high_of = np.linalg.norm(np.asarray(free)[1 : 1 + BOWS, 15] - (START + goal) / 2, axis=1)
    np.testing.assert_allclose(high_of, 0.3 * np.linalg.norm(goal - START), rtol=1e-3)


def test_too_few_guesses_are_refused():
    s = among(drawn(0))
    with pytest.raises(ValueError, match="accepted are 3 or more"):
        plan_multi_start(params(), s.start, s.goal, s.distances, s.radius, s.lower, s.upper, SIZES, 2)
