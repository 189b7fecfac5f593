"""The comparison of planners of a point: scenes, check, law of time, measures, the folder of a run."""

import json
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
from scipy.interpolate import CubicSpline

from experiments.plan_benchmark.config import PlanBenchmarkConfig, parse
from experiments.plan_benchmark.page import page
from experiments.plan_benchmark.points import measures, sampling, timing
from experiments.plan_benchmark.points.cases import PLANNERS, measured
from experiments.plan_benchmark.points.curve import Curve, check, executed, resampled, without_repeats
from experiments.plan_benchmark.points.found import Found
from experiments.plan_benchmark.points.intervals import median, share
from experiments.plan_benchmark.points.scenes import (
    CLEARANCE,
    ENDS_APART,
    LOWER,
    UPPER,
    PointScene,
    draw_scene,
    feasible_scenes,
    way_exists,
)
from experiments.plan_benchmark.results import merged
from experiments.plan_benchmark.run import run
from hrcjax.lab.errors import UsageError
from hrcjax.world import obstacle_distances
from hrcjax.world.scene import BOX, SPHERE

START, GOAL = np.array([0.1, 0.3, 0.2]), np.array([0.7, 0.3, 0.2])


def scene(*solids, start=START, goal=GOAL):
    kind, center, size, yaw = (np.array(x) for x in zip(*solids, strict=True))
    return PointScene(start, goal, kind, center.astype(float), size.astype(float), yaw.astype(float), LOWER, UPPER)


def ball(x, y, z, radius):
    return (SPHERE, (x, y, z), (radius,) * 3, 0.0)


def test_obstacles_stand_on_the_line_and_apart_from_its_ends():
    kinds, counts = set(), set()
    for seed in range(40):
        one = draw_scene(seed)
        if one is None:
            continue
        line = one.start + np.linspace(0, 1, 400)[:, None] * (one.goal - one.start)
        assert (one.distances(line).min(axis=1) < 0.002).all()
        assert one.distances(np.stack([one.start, one.goal])).min() >= ENDS_APART
        kinds |= set(one.kind.tolist())
        counts.add(len(one.kind))
    assert kinds == {0, 1, 2} and counts == {1, 2, 3, 4, 5, 6}
    again = draw_scene(3)
    assert again is not None and np.array_equal(again.center, draw_scene(3).center)  # pyright: ignore[reportOptionalMemberAccess]


def test_library_and_sampling_planners_see_the_same_distances():
    """The library's scene, the plain floats of the validity function, and the check's NumPy."""
    rng = np.random.default_rng(0)
    for seed in range(6):
        one = draw_scene(seed)
        assert one is not None
        x = rng.uniform(LOWER, UPPER, (200, 3))
        mine = one.distances(x)
        given = one.for_library()
        library = np.asarray(jax.vmap(lambda p, s=given: obstacle_distances(s, p))(jnp.asarray(x[:8], jnp.float32)))
        outside = mine[:, :8] > 0
        np.testing.assert_allclose(library[:, : len(mine)].T[outside], mine[:, :8][outside], atol=2e-6)
        kept = sampling.keeps_clearance(one)
        clear = np.abs(mine.min(axis=0) - CLEARANCE) > 1e-9
        np.testing.assert_array_equal([kept(*p) for p in x[clear].tolist()], (mine.min(axis=0) >= CLEARANCE)[clear])


def test_a_way_exists_or_not():
    span = UPPER - LOWER
    middle = (LOWER + UPPER) / 2
    wall = (BOX, middle, (0.02, *(span[1:] / 2 + 0.1)), 0.0)
    assert not way_exists(scene(wall))
    low = (BOX, (middle[0], middle[1], 0.2), (0.02, span[1], 0.2), 0.0)  # 20 cm are left above it
    assert way_exists(scene(low))
    hole = CLEARANCE + 0.004  # half the width of a gap that the clearance allows, and the grid does not
    sides = [(BOX, (middle[0], 0.3 + s * (1 + hole), middle[2]), (0.02, 1.0, 0.5), 0.0) for s in (-1, 1)]
    assert not way_exists(scene(*sides))
    wide = [(BOX, (middle[0], 0.3 + s * (1.0 + 0.05), middle[2]), (0.02, 1.0, 0.5), 0.0) for s in (-1, 1)]
    assert way_exists(scene(*wide))


def test_length_and_bending_of_an_arc_and_of_corners():
    angle = np.linspace(0, np.pi, 200)
    arc = Curve(0.3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1))
    np.testing.assert_allclose(arc.length(), 0.3 * np.pi, rtol=1e-4)
    np.testing.assert_allclose(arc.bending_energy(), np.pi / 0.3, rtol=0.02)  # natural ends do not bend
    line = np.stack([START, (START + GOAL) / 2, GOAL])
    assert Curve(line).bending_energy() < 1e-12 and Curve(line, broken=True).bending_energy() == 0
    corner = Curve(np.stack([START, START + np.array([0.1, 0.1, 0]), GOAL]), broken=True)
    assert corner.bending_energy() == np.inf
    assert np.linalg.norm(np.diff(corner.sampled(), axis=0), axis=1).max() <= 0.001 + 1e-12


@pytest.mark.parametrize(("gap", "kept"), [(0.0291, False), (0.0296, True), (0.04, True)])
def test_check_of_clearance(gap, kept):
    found = check(scene(ball(0.4, 0.3 + 0.05 + gap, 0.2, 0.05)), Curve(np.stack([START, (START + GOAL) / 2, GOAL])))
    assert found.kept == kept
    np.testing.assert_allclose(found.clearance, gap, atol=1e-5)


def test_check_of_bounds_and_ends():
    far = scene(ball(0.4, 0.8, 0.5, 0.03))
    low = np.stack([START, [0.4, 0.3, 0.015], GOAL])
    assert not check(far, Curve(low, broken=True)).kept
    assert check(far, Curve(low + [0, 0, 0.01] * np.array([[0], [1], [0]]), broken=True)).kept
    assert not check(far, Curve(np.stack([START, GOAL - [0.01, 0, 0]]), broken=True)).kept


def test_the_smoothest_curve_that_is_accepted_is_executed():
    """A corner round a ball: coarse splines cut into the clearance, a finer one does not; without the ball the coarsest is taken."""
    corner = np.stack([START, [0.36, 0.42, 0.2], GOAL])
    to_start, to_goal = (x - corner[1] for x in (START, GOAL))
    inward = to_start / np.linalg.norm(to_start) + to_goal / np.linalg.norm(to_goal)
    inward /= np.linalg.norm(inward)
    half = np.arccos(inward @ to_goal / np.linalg.norm(to_goal))
    round_ball = scene(ball(*(corner[1] + inward * (0.01 + CLEARANCE) / np.sin(half)), 0.01))
    free, _ = executed(scene(ball(0.4, 0.8, 0.5, 0.03)), corner)
    tight, verdict = executed(round_ball, corner)
    assert verdict.kept and not free.broken and not tight.broken
    assert len(tight.points) > len(free.points) and tight.bending_energy() > 1.5 * free.bending_energy()
    assert not check(round_ball, free).kept
    blocked, verdict = executed(scene(ball(0.4, 0.3, 0.2, 0.05)), np.stack([START, GOAL]))
    assert not verdict.kept and blocked.broken


def test_points_without_repeats_and_at_equal_distances():
    line = without_repeats(np.stack([START, START, GOAL, GOAL]))
    np.testing.assert_array_equal(line, [START, GOAL])
    assert len(without_repeats(np.stack([START, START]))) == 2
    even = resampled(np.stack([START, GOAL]), 0.1)
    np.testing.assert_allclose(np.diff(even[:, 0]), 0.1)
    np.testing.assert_array_equal(even[[0, -1]], [START, GOAL])


def test_time_of_a_straight_line_in_closed_form():
    pytest.importorskip("toppra")
    for goal in (GOAL, START + np.array([0.3, 0.3, 0.1])):
        along = goal - START
        long = np.linalg.norm(along)
        steep = np.abs(along / long).max()
        v, a, j = (x / steep for x in (timing.SPEED, timing.ACCELERATION, timing.JERK))
        found = timing.times(Curve(np.stack([START, (START + goal) / 2, goal])))
        np.testing.assert_allclose(found.optimal, long / v + v / a, rtol=0.01)
        assert found.smooth >= long / v + v / a + a / j - 0.02
    along_x = timing.times(Curve(np.stack([START, (START + GOAL) / 2, GOAL])))
    v, a, j = timing.SPEED, timing.ACCELERATION, timing.JERK
    np.testing.assert_allclose(along_x.smooth, 0.6 / v + v / a + a / j, rtol=0.03)
    halves = timing.times(Curve(np.stack([START, (START + GOAL) / 2, GOAL]), broken=True))
    np.testing.assert_allclose(halves.optimal, 2 * (0.3 / v + v / a), rtol=0.01)


def test_jerk_binds_in_a_tight_helix():
    """20 turns of 1 cm: along them at v the jerk is v^3 / R^2 on each axis, so that v is at most its cube root."""
    angle = np.linspace(0, 40 * np.pi, 2001)
    turns = Curve(np.stack([0.01 * np.cos(angle), 0.01 * np.sin(angle), 0.0002 * angle], axis=1))
    slowest = turns.length() / np.cbrt(timing.JERK * 0.01**2)
    assert slowest < timing.times(turns).smooth < 1.1 * slowest  # ramps, and natural ends


def test_derivatives_by_length_of_a_helix():
    """Closed form, at another speed of the parameter."""
    R, c = 0.2, 0.05
    t = np.linspace(0, 3, 400)
    u = t + 0.1 * np.sin(t)  # the angle at parameter t
    helix = CubicSpline(t, np.stack([R * np.cos(u), R * np.sin(u), c * u], axis=1), bc_type="natural")
    at = np.linspace(0.5, 2.5, 30)
    w, k = at + 0.1 * np.sin(at), np.hypot(R, c)
    first, second, third = timing.by_length(helix, at)
    np.testing.assert_allclose(first, np.stack([-R * np.sin(w), R * np.cos(w), c + 0 * w], axis=1) / k, atol=1e-5)
    np.testing.assert_allclose(second, np.stack([-R * np.cos(w), -R * np.sin(w), 0 * w], axis=1) / k**2, atol=2e-3)
    np.testing.assert_allclose(third, np.stack([R * np.sin(w), -R * np.cos(w), 0 * w], axis=1) / k**3, atol=0.5)


def test_intervals_against_scipy():
    kept = np.arange(40) < 37
    wilson = scipy.stats.binomtest(37, 40).proportion_ci(method="wilson")
    np.testing.assert_allclose(share(kept)[:3], (0.925, wilson.low, wilson.high), rtol=1e-6)
    x = np.random.default_rng(1).lognormal(size=60)
    theirs = scipy.stats.bootstrap(
        (x,), np.median, method="percentile", rng=np.random.default_rng(2)
    ).confidence_interval
    mine = median(x)
    assert mine.value == np.median(x)
    np.testing.assert_allclose(mine[1:3], theirs, rtol=0.1)
    assert median(np.array([1.0, 2, np.inf])).value == 2 and median(np.array([1.0, np.inf, np.inf])).value == np.inf
    assert np.isnan(median(np.zeros(0)).value) and np.isnan(share(np.zeros(0)).value)


def case(length, bending=1.0, success=True, time=1.0):
    of = dict(success=success, claimed=success, kept=success, broken=False, compile=np.nan, length=length, bending=bending,
              clearance=0.03, optimal=time, smooth=time, seconds=0.1)  # fmt: skip
    return {name: np.asarray(value) for name, value in of.items()}


def test_rows_on_cases_made_by_hand():
    cases = {
        "multi_start": [case(1.0), case(1.02), case(1.0), case(1.0, success=False)],
        "rrt_star": [case(1.0, 3.0), case(1.0, 3.0), case(2.0, 1.5), case(1.0, 3.0)],
        "bfmt_star": [case(1.1, 0.1), case(1.1, 9.0), case(1.0, success=False), case(1.0, success=False)],
    }
    rows = {name: entry["value"] for name, entry in measures.point_rows(cases, {"no way": 3}).items()}
    assert rows["point_success_multi_start"] == 0.75 and rows["point_rejected_no_way"] == 3
    assert rows["point_best_length_share_multi_start"] == 0.5  # the second is 2 % longer, the last failed
    assert (
        rows["point_best_bending_share_multi_start"] == 0.5
    )  # of the third the only baseline bends less than twice as much
    assert rows["point_best_share_multi_start"] == 0.25
    assert rows["point_ratio_length_rrt_star"] == 1.0 and rows["point_ratio_bending_rrt_star"] == pytest.approx(1 / 3)
    assert rows["point_ratio_length_bfmt_star"] == pytest.approx((1 / 1.1 + 1.02 / 1.1) / 2)
    text = page({**measures.point_rows(cases, {"no way": 3}), "point_budget": {"value": 1.0, "unit": "s"}})
    assert "3 (no way)" in text and "| rrt_star | 1 [" in text and "(missed)" in text


def test_the_strict_share_takes_the_straightest_of_the_short_baselines():
    cases = {
        "multi_start": [case(1.0, 1.0)] * 5,
        "rrt_star": [case(1.0, 9.0)] * 5,  # the tautest
        "bfmt_star": [
            case(1.005, 1.5),  # hardly longer, and bends less than twice as much
            case(1.02, 1.5),  # too long to count
            case(1.005, 2.0),  # just twice
            case(1.005, 1.5, success=False),
            case(1.01, np.nan),  # of unknown bending: nothing can be said for the planner
        ],
    }
    rows = {name: entry["value"] for name, entry in measures.point_rows(cases, {}).items()}
    assert rows["point_best_share_multi_start"] == 1.0
    assert rows["point_best_share_strict_multi_start"] == pytest.approx(3 / 5)
    unseen = {name: entry["value"] for name, entry in measures.unseen_rows(cases).items()}
    assert unseen["point_unseen_scenes"] == 5 and unseen["point_unseen_success_multi_start"] == 1
    assert unseen["point_unseen_share_strict_multi_start"] == rows["point_best_share_strict_multi_start"]
    assert not any(name.endswith("rrt_star") for name in unseen)


def test_page_tells_what_the_bars_do_not():
    cases = {"multi_start": [case(1.0, 1.0)] * 4, "rrt_star": [case(1.0, 9.0)] * 4, "bfmt_star": [case(1.0, 1.5)] * 4}
    paper = {"length_touching": 72.9, "bending_touching": 0.001, "distance_touching": -0.022, "length_clear_3cm": 73.8,
             "bending_clear_3cm": 0.013, "distance_clear_3cm": 2.99}  # fmt: skip
    rows = measures.point_rows(cases, {}) | measures.unseen_rows(cases)
    rows |= {f"point_paper_{name}": {"value": value, "unit": "cm"} for name, value in paper.items()}
    on = {"cpu": "some processor", "cores": 2, "commit": "0123456789abcdef+changes", "ompl": "2.0"}
    text = page(rows, (), {"point": on})
    assert "some processor, 2 cores" in text and "commit 0123456789ab with changes" in text and "ompl 2.0" in text
    assert "JAX may use all cores" in text and "median clearance of `multi_start` 30.0 mm" in text
    assert "in 1 [0.51, 1] of the scenes, by the strict comparison in 0 [" in text
    assert "0.22 mm into the column" in text and "which meets the same bars" in text
    assert "Not measured here; `python -m experiments.plan_benchmark --space arm" in text
    longer = rows | {"point_paper_length_clear_3cm": {"value": 75.0, "unit": "cm"}}
    assert "which meets the same bars" not in page(longer)
    assert "not recorded" in page(longer) and "Planners of a point were" not in page(longer)
    alone = page({"success": {"value": 1.0, "unit": "1"}})
    assert "planners of a point were not measured" in alone and "Not measured here" not in alone


def test_a_claim_that_the_check_refutes_is_no_success():
    line = np.stack([START, GOAL])
    blocked, free = scene(ball(0.4, 0.3, 0.2, 0.05)), scene(ball(0.4, 0.8, 0.5, 0.03))
    assert not measured(blocked, Found(line, True, 0.1))["success"]
    assert measured(free, Found(line, True, 0.1))["success"]
    assert not measured(free, Found(line, False, 0.1))["success"]


@pytest.mark.parametrize("name", list(sampling.SAMPLING))
def test_sampling_planners_keep_clearance_and_time(name):
    pytest.importorskip("ompl")
    one = scene(ball(0.4, 0.31, 0.2, 0.06))
    found = sampling.sampling_planner(name, 0.3)(one)
    assert found.claimed and found.seconds < 0.6
    curve, verdict = executed(one, found.points)
    assert verdict.kept and 0.6 < curve.length() < 0.75


def small(folder: Path, **changes) -> PlanBenchmarkConfig:
    base = PlanBenchmarkConfig(
        space="point", scenes=2, unseen=0, lagrange=0, planners=("gradient_descent",), out=folder, figures=False
    )
    return replace(base, **changes)


def test_a_run_is_stored_resumed_and_keeps_the_rows_of_the_arm(tmp_path, capsys, monkeypatch):
    out = tmp_path / "rows.json"
    out.write_text(
        json.dumps({"plan_benchmark": {"success": {"value": 1, "unit": "1"}, "point_old": {"value": 1}}, "other": {}})
    )
    assert run(small(tmp_path / "run", json=out, page=tmp_path / "page.md")) == 0
    found = json.loads(out.read_text())
    rows = found["plan_benchmark"]
    assert "other" in found and "success" in rows and "point_old" not in rows
    assert rows["point_scenes"]["value"] == 2 and 0 <= rows["point_success_gradient_descent"]["value"] <= 1
    assert rows["point_paper_length_touching"]["value"] < 74
    assert set(found["about"]) == {"plan_benchmark_point"} and found["about"]["plan_benchmark_point"]["commit"]
    text = (tmp_path / "page.md").read_text()
    assert "## Planners of a point" in text and "## The planner of the whole arm" in text
    assert "gradient_descent" in capsys.readouterr().out
    monkeypatch.setattr("experiments.plan_benchmark.points.cases.Bench.case", lambda *_: pytest.fail("measured again"))
    monkeypatch.setattr("experiments.plan_benchmark.points.run.paper_rows", lambda: pytest.fail("measured again"))
    monkeypatch.setattr("experiments.plan_benchmark.run.about", lambda: pytest.fail("asked again"))
    assert run(small(tmp_path / "run", figures=True)) == 0
    assert (tmp_path / "run" / "figures" / "paths.png").stat().st_size > 20000


def test_rows_of_both_spaces_are_merged():
    old = {"point_a": {"value": 1}, "b": {"value": 2}}
    assert set(merged(old, {"point_c": {}}, "point")) == {"b", "point_c"}
    assert set(merged(old, {"d": {}}, "arm")) == {"point_a", "d"}
    assert set(merged(old, {"d": {}}, "both")) == {"d"}


def test_without_ompl_its_planners_are_left_out(tmp_path, capsys, monkeypatch):
    from experiments.plan_benchmark.points.run import chosen

    monkeypatch.setattr(sampling, "base", None)
    monkeypatch.setattr(timing, "toppra", None)
    assert set(chosen(())) == set(PLANNERS) - set(sampling.SAMPLING)
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2 and "rrt_star, informed_rrt_star, bfmt_star are left out" in said[0] and "toppra" in said[1]
    with pytest.raises(UsageError, match="need ompl"):
        chosen(("rrt_star",))
    assert np.isnan(timing.optimal_time(Curve(np.stack([START, (START + GOAL) / 2, GOAL])).spline()))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"planners": ("rrt",)}, "--planners rrt: accepted are gradient_descent"),
        ({"planners": ("iapf", "iapf")}, "each once"),
        ({"scenes": 0}, "--scenes 0"),
        ({"budget": 0.0}, "--budget 0"),
        ({"json": Path("nowhere/x.json")}, "no folder nowhere"),
    ],
)
def test_mistakes_are_told(tmp_path, change, message):
    with pytest.raises(UsageError, match=message):
        run(small(tmp_path / "run", **change))


@pytest.mark.parametrize(
    ("option", "content", "message"),
    [
        ("json", None, "is a folder; give a file"),
        ("page", None, "is a folder; give a file"),
        ("json", "{", "not valid JSON"),
        ("json", "[1]", "no benchmark sections"),
        ("json", '{"plan_benchmark": [1]}', "are not sections"),
        ("json", '{"plan_benchmark": {"success": 1}}', "row success has no value"),
        ("json", '{"about": 3}', "are not sections"),
    ],
)
@pytest.mark.parametrize("space", ["point", "arm", "both"])
def test_files_are_refused_before_anything_is_measured(tmp_path, monkeypatch, option, content, message, space):
    monkeypatch.setattr("experiments.plan_benchmark.run.measured", lambda *_: pytest.fail("measured"))
    file = tmp_path / "file"
    if content is None:
        file.mkdir()
    else:
        file.write_text(content)
    with pytest.raises(UsageError, match=message) as told:
        run(small(tmp_path / "run", space=space, problems=tmp_path / "none", **{option: file}))
    assert "\n" not in str(told.value) and not (tmp_path / "run").exists()


def test_rows_that_make_no_page_and_one_file_for_both_are_refused(tmp_path):
    file = tmp_path / "rows.json"
    file.write_text(
        json.dumps({"plan_benchmark": {"point_scenes": {"value": 3}, "point_success_iapf": {"value": 1.0}}})
    )
    with pytest.raises(UsageError, match="make no page"):
        run(small(tmp_path / "run", space="arm", json=file, page=tmp_path / "page.md"))
    with pytest.raises(UsageError, match="give two files"):
        run(small(tmp_path / "run", json=file, page=file))
    assert not (tmp_path / "run").exists()


def test_scenes_of_other_seeds(tmp_path, monkeypatch):
    """Those that are among the first ones do not count twice."""
    monkeypatch.setattr("experiments.plan_benchmark.points.run.UNSEEN", 1)
    seen = []

    def made(_, name, one):
        seen.append(name)
        return case(1.0) | {"curve": np.stack([one.start, one.goal])}

    monkeypatch.setattr("experiments.plan_benchmark.points.cases.Bench.case", made)
    monkeypatch.setattr(
        "experiments.plan_benchmark.points.run.paper_rows", lambda: {"point_paper": {"value": 1, "unit": ""}}
    )
    out = tmp_path / "rows.json"
    asked = small(tmp_path / "run", planners=("iapf", "iapf_optimised", "multi_start"), unseen=3, json=out)
    assert run(asked) == 0
    rows = json.loads(out.read_text())["plan_benchmark"]
    assert rows["point_scenes"]["value"] == rows["point_unseen_scenes"]["value"] == 2
    assert len(seen) == 10 and seen.count("iapf_optimised") == 2  # it is in no share
    assert rows["point_unseen_share_multi_start"]["scenes"] == 2


def test_options():
    assert parse([]).scenes == 200 and parse([]).space == "both"
    quick = parse(["--quick", "--space", "point"])
    assert quick.scenes == 10 and quick.space == "point" and quick.count == 50
    with pytest.raises(UsageError, match="no config"):
        parse(["--config", "none"])


def test_feasible_scenes_are_counted_with_what_was_rejected(monkeypatch):
    monkeypatch.setattr("experiments.plan_benchmark.points.scenes.way_exists", lambda one: len(one.kind) != 4)
    found, rejected = feasible_scenes(8)
    assert len(found) == 8 and all(len(one.kind) != 4 for one in found.values())
    assert rejected["no way that keeps the clearance"] + rejected["no place for an obstacle"] == max(found) + 1 - 8
