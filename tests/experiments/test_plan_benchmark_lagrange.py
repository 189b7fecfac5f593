"""The augmented Lagrangian: minima known in closed form, another solver as a witness, and rows where a planner is made worse."""

import json
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize

from experiments.plan_benchmark.config import PlanBenchmarkConfig, parse
from experiments.plan_benchmark.page import page
from experiments.plan_benchmark.points import optimum
from experiments.plan_benchmark.points.lagrange import Problem, minimum
from experiments.plan_benchmark.points.optimum import REQUIRED, checked, compared, hard_scenes, path_problem, starts
from experiments.plan_benchmark.points.optimum_rows import optimum_rows
from experiments.plan_benchmark.points.scenes import LOWER, UPPER, PointScene
from experiments.plan_benchmark.run import run
from hrcjax.world.scene import COLUMN, SPHERE

START, GOAL = np.array([0.1, 0.4, 0.2]), np.array([0.7, 0.4, 0.2])


def among_balls(*balls, start=START, goal=GOAL):
    """Balls (x, y, z, radius)."""
    of = np.array(balls, float)
    return PointScene(
        start,
        goal,
        np.full(len(of), SPHERE),
        of[:, :3],
        np.repeat(of[:, 3:], 3, axis=1),
        np.zeros(len(of)),
        LOWER,
        UPPER,
    )


def quadratic(target, stiff, constraints, slopes):
    """|x - target|^2 weighed by `stiff`, and linear or other constraints with their slopes."""

    def augmented(x, multipliers, penalty):
        missed = np.maximum(multipliers / penalty - constraints(x), 0)
        away = x - target
        return away @ (stiff * away) / 2 + penalty / 2 * missed @ missed, stiff * away - penalty * missed @ slopes(x)

    return Problem(augmented, constraints, np.diag(1 / np.sqrt(stiff)))


@pytest.mark.parametrize("stiff", [1.0, 100.0])
def test_the_nearest_point_of_a_convex_set(stiff):
    """Of a half-space, of a corner, of a point that is inside; in closed form."""
    rows, limit = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([2.0, 1.0])
    for target, nearest in (([0, 0, 3], [1, 1, 3]), ([0, 2, 0], [0, 2, 1]), ([0, 1, -1], [0.5, 1.5, 1]), ([3, 3, 3], [3, 3, 3])):  # fmt: skip
        problem = quadratic(np.array(target, float), np.full(3, stiff), lambda x: rows @ x - limit, lambda _: rows)
        found = minimum(problem, np.array([5.0, -4.0, 9.0]))
        np.testing.assert_allclose(found.x, nearest, atol=2e-6)
        assert found.residual <= 1e-6


def test_the_nearest_point_outside_a_ball_by_the_side_of_the_start():
    """Not convex: the far side is a stationary point alone, and the residual tells when rounds do not suffice."""
    target = np.array([0.3, 0.0])
    problem = quadratic(target, np.ones(2), lambda x: np.array([x @ x - 1]), lambda x: 2 * x[None])
    np.testing.assert_allclose(minimum(problem, np.array([0.5, 2.0])).x, [1, 0], atol=1e-6)
    assert minimum(problem, np.array([0.5, 2.0]), penalty=0.01, rounds=1).residual > 0.1


def inner(scene, count):
    return np.linspace(scene.start, scene.goal, count)[1:-1].ravel()


def solved(scene, required, count, start=None):
    given = scene.for_library(0.03, jnp.float64)
    problem = path_problem(given, required, count, float(np.linalg.norm(scene.goal - scene.start)))
    found = minimum(problem, inner(scene, count) if start is None else start)
    cost = problem.augmented(found.x, np.zeros_like(problem.constraints(found.x)), 1e-12)[0]
    return found, cost


def test_a_path_held_up_by_a_ball_is_a_beam_under_tension():
    """The ball lifts the middle by h; a beam of stiffness 2 omega2 with tension omega1 and free ends, by its small deflections."""
    high, span, tension, stiff = 0.01, 0.6, 1.0, 0.02
    found, cost = solved(among_balls((0.4, 0.4, 0.2 - 0.03 + high, 0.03)), 0.0, 48)
    wave = np.sqrt(tension / stiff)
    push = 2 * tension * high / (span / 2 - np.tanh(wave * span / 2) / wave)
    np.testing.assert_allclose(cost - span, push * high / 2, rtol=5e-3)
    x, y, z = found.x.reshape(-1, 3).T
    along = np.minimum(x - 0.1, 0.7 - x)
    shape = push / (2 * tension) * (along - np.sinh(wave * along) / (wave * np.cosh(wave * span / 2)))
    np.testing.assert_allclose(z - 0.2, shape, atol=0.01 * high)
    np.testing.assert_allclose(y, 0.4, atol=1e-5)
    free, cost = solved(among_balls((0.4, 0.8, 0.5, 0.03)), 0.0, 48)
    np.testing.assert_allclose([cost, free.residual], [span, 0], atol=1e-9)


def test_another_solver_finds_the_same_minimum():
    """SLSQP with its own differences, cost and constraints in NumPy."""
    scene, count = among_balls((0.3, 0.42, 0.18, 0.03), (0.5, 0.37, 0.2, 0.04)), 14

    def whole(x):
        return np.vstack([scene.start, x.reshape(-1, 3), scene.goal])

    def cost(x):
        steps = np.diff(whole(x), axis=0)
        length = np.sqrt(len(steps) * np.sum(steps**2))
        return length + 0.01 * len(steps) ** 3 * np.sum(np.diff(steps, axis=0) ** 2) / length**3

    def spare(x):
        w = whole(x)
        return 10 * (scene.distances(np.vstack([w[1:-1], (w[1:] + w[:-1]) / 2])).ravel() - 0.05)

    found, mine = solved(scene, 0.05, count)
    theirs = minimize(cost, found.x + 0.01 * np.sin(np.arange(len(found.x))), method="SLSQP", options={"maxiter": 200, "ftol": 1e-10},
                      constraints={"type": "ineq", "fun": spare})  # fmt: skip
    assert theirs.success and spare(found.x).min() > -2e-5
    np.testing.assert_allclose(mine, theirs.fun, rtol=2e-5)
    np.testing.assert_allclose(mine, cost(found.x), rtol=1e-9)
    np.testing.assert_allclose(found.x, theirs.x, atol=2e-3)


ASIDE = PointScene(
    START,
    GOAL,
    np.array([COLUMN]),
    np.array([[0.4, 0.41, 0.3]]),
    np.array([[0.03, 0.03, 0.3]]),
    np.zeros(1),
    LOWER,
    UPPER,
)
"""A column up to the upper bound, nearer to one side."""


def given(*waypoints, claimed=True):
    return lambda _: dict[str, Any](zip(optimum.COMPARED, [(w, claimed) for w in waypoints], strict=True))


def test_rows_tell_what_is_worse_and_why():
    """A path on the dear side, a wave on the cheap one, one that cuts in, and one that is not claimed."""
    with jax.enable_x64(True):
        near, far = (
            optimum._minimum(ASIDE, ASIDE.for_library(0.03, jnp.float64), guess, REQUIRED, optimum.STIFF)[0]
            for guess in (bow(-0.13), bow(0.13))
        )
    below = checked(ASIDE, near).cost
    assert checked(ASIDE, far).cost > 1.03 * below, "else the sides say nothing"
    wave = near + 0.004 * np.sin(np.linspace(0, 4 * np.pi, 48))[:, None] * [0, 0, 1] - 0.001 * bump()
    rows = values(compared(ASIDE, given(far, wave), 1))
    assert rows["cost_max_multi_start"] > 0.03 and rows["within_multi_start"] == 0
    assert (
        abs(rows["own_cost_max_multi_start"]) < 1e-3 and rows["own_within_multi_start"] == 1
    )  # on its side it is the best
    assert rows["own_cost_max_iapf_optimised"] > 0.005  # not converged
    np.testing.assert_allclose(rows["own_cost_max_iapf_optimised"], rows["equal_cost_max_iapf_optimised"], atol=1e-4)
    assert abs(rows["violation_best"]) < 0.011 and rows["residual"] < 0.01 and rows["unsolved"] == 0

    cut = near + 0.0004 * bump()
    deep = near + 0.004 * bump()
    rows = values(compared(ASIDE, given(cut, deep), 1))
    assert (
        rows["cost_max_multi_start"] < -1e-5 < rows["equal_cost_max_multi_start"]
    )  # cutting in gains nothing at equal distance
    assert (
        rows["failed_iapf_optimised"] == 1
        and rows["within_iapf_optimised"] == 0
        and rows["violation_iapf_optimised"] > 3
    )
    silent = values(compared(ASIDE, given(near, near, claimed=False), 1))
    assert silent["within_multi_start"] == 0 and np.isnan(silent["cost_max_multi_start"])


def bow(high):
    return np.linspace(START, GOAL, 48) + high * np.sin(np.linspace(0, np.pi, 48))[:, None] * [0, 1, 0]


def bump():
    """Towards the ball, along the whole path."""
    return np.sin(np.linspace(0, np.pi, 48))[:, None] * [0, 1, 0]


def values(case):
    rows = optimum_rows([{key: np.asarray(value) for key, value in case.items()}])
    assert set(name.split("_lagrange_")[0] for name in rows) == {"point"}
    return {name.removeprefix("point_lagrange_"): entry["value"] for name, entry in rows.items()}


def test_scenes_and_starts():
    scenes = hard_scenes(3)
    for scene in scenes.values():
        assert scene.distances(np.stack([scene.start, scene.goal])).min() >= REQUIRED
    scene = next(iter(scenes.values()))
    guesses = starts(scene, 9)
    assert guesses.shape == (9, 48, 3) and np.abs(guesses[:, 0] - scene.start).max() < 1e-6
    assert len({tuple(np.round(g[20], 6)) for g in guesses}) == 9


def test_a_run_stores_its_scenes_and_shows_them(tmp_path, monkeypatch):
    made = compared(ASIDE, given(bow(-0.13), bow(-0.13)), 1)
    monkeypatch.setattr("experiments.plan_benchmark.points.run.paper_rows", lambda: {"point_paper": {"value": 1, "unit": ""}})  # fmt: skip
    monkeypatch.setattr("experiments.plan_benchmark.points.run.compared", lambda _: made)
    asked = PlanBenchmarkConfig(space="point", scenes=1, unseen=0, lagrange=2, planners=("iapf",), out=tmp_path / "run", figures=False,
                                json=tmp_path / "rows.json", page=tmp_path / "page.md")  # fmt: skip
    assert run(asked) == 0
    rows = json.loads((tmp_path / "rows.json").read_text())["plan_benchmark"]
    assert rows["point_lagrange_scenes"]["value"] == 2 and rows["point_lagrange_cost_max_multi_start"]["value"] > 0.01
    text = (tmp_path / "page.md").read_text()
    assert "### The optimum where constraints bind hard" in text and "| point_lagrange_within_multi_start | 0 [" in text
    monkeypatch.setattr("experiments.plan_benchmark.points.run.compared", lambda _: pytest.fail("measured again"))
    assert run(asked) == 0
    assert "### The optimum" not in page({"point_scenes": {"value": 1.0, "unit": "scenes"}})
    assert parse(["--quick"]).lagrange == 2
