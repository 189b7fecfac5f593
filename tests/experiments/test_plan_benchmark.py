"""The program that measures the arm's planner: its exact check, its rows, a run on problems made by hand."""

import json
import multiprocessing
from functools import cache

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from experiments.plan_benchmark import arm, side_by_side
from experiments.plan_benchmark.checker import STEP, Checker, dense
from experiments.plan_benchmark.config import PlanBenchmarkConfig, parse
from experiments.plan_benchmark.families import family
from experiments.plan_benchmark.page import page
from experiments.plan_benchmark.peers import Validity
from experiments.plan_benchmark.problems import TIGHT, Problems, joined, joint_length, read_problems, thin_arm
from experiments.plan_benchmark.rows import holds, problem_rows
from experiments.plan_benchmark.run import run
from experiments.plan_benchmark.solve import Solved
from hrcjax.lab.errors import UsageError
from hrcjax.robot import arm_capsules

HOME = np.array([0.0, -1.6, 1.6, -1.6, -1.6, 0.0])
ARM = thin_arm()


def problems(*boxes, turn=0.8):
    center, half = (np.array(x, float) for x in zip(*boxes, strict=True))
    goal = HOME + np.array([turn, 0, 0, 0, 0, 0])
    return Problems(HOME[None], goal[None], center[None], half[None], np.array([len(boxes)]), (np.stack([HOME, goal]),))


def test_steps_are_two_degrees_at_most_and_keep_the_waypoints():
    path = np.array([[0.0, 0], [0.5, 0.1], [0.5, 0.1], [-0.2, 0.3]])
    fine = dense(path)
    assert np.abs(np.diff(fine, axis=0)).max() <= STEP + 1e-12
    for waypoint in path:
        assert (np.abs(fine - waypoint).max(axis=1) < 1e-12).any()
    np.testing.assert_allclose(joint_length(fine), joint_length(path))


def test_check_agrees_with_mujoco():
    """C MuJoCo's distance of the same capsules and boxes, floor and self-collision apart, at random postures; with boxes about
    the arm, and with one next to the first joint's axis."""
    rng = np.random.default_rng(0)
    center, half = rng.uniform([-0.6, -0.6, 0.2], [0.6, 0.6, 0.9], (4, 3)), rng.uniform(0.03, 0.2, (4, 3))
    _agrees_with_mujoco(center, half, rng.uniform(-2, 2, (60, 6)))
    beside = ARM.capsule_radii[1] + 0.04
    for gap in (-0.01, 0.01):  # behind the shoulder, whose capsule begins on the axis and leads to the other side
        center[0], half[0], center[1:] = [0, beside + gap, 0.05], 0.04, 5.0
        free = _agrees_with_mujoco(center, half, HOME + rng.uniform(-0.3, 0.3, (20, 6)))
        assert free.any() == (gap > 0)


@cache
def _checker():
    return Checker(ARM)


def _agrees_with_mujoco(center, half, q):
    count = len(q)
    spec = mujoco.MjSpec()
    for c, h in zip(center, half, strict=True):
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=c, size=h)
    moving = [k for k, link in enumerate(ARM.capsule_links) if link >= 0]
    for k in moving:
        body = spec.worldbody.add_body(mocap=True)
        long = np.linalg.norm(ARM.capsule_b[k] - ARM.capsule_a[k]) / 2
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[ARM.capsule_radii[k], long, 0])
    model = spec.compile()
    data = mujoco.MjData(model)
    checker = _checker()
    one = Problems(q[:1], q[:1], center[None], half[None], np.array([len(center)]), (q[:1],))
    capsules = jax.jit(jax.vmap(lambda q: arm_capsules(ARM, q)))(jnp.asarray(q))
    floor_and_self = checker.free(
        Problems(q[:1], q[:1], center[None], half[None], np.array([0]), (q[:1],)), [0] * count, [x[None] for x in q]
    )
    mine = checker.free(one, [0] * count, [x[None] for x in q])
    truth = []
    for row in range(len(q)):
        for place, k in enumerate(moving):
            a, b = np.asarray(capsules.a[row, k]), np.asarray(capsules.b[row, k])
            data.mocap_pos[place] = (a + b) / 2
            mujoco.mju_quatZ2Vec(data.mocap_quat[place], (b - a) / np.linalg.norm(b - a))
        mujoco.mj_kinematics(model, data)
        truth.append(
            min(
                mujoco.mj_geomDistance(model, data, g, len(center) + p, 1.0, None)
                for g in range(len(center))
                for p in range(len(moving))
            )
        )
    truth = np.array(truth)
    clear = np.abs(truth) > 1e-4
    np.testing.assert_array_equal(mine[clear], (floor_and_self & (truth > 0))[clear])
    assert floor_and_self.mean() > 0.05
    return mine


def test_problems_of_other_families_and_mujocos_collisions():
    """Ends are free by C MuJoCo's collisions too, which agree with the exact check among turned beams, balls and capsules."""
    made = joined([family(name, 1, 0, ARM, _checker()) for name in ("cage", "table")])
    q = np.random.default_rng(1).uniform(-2, 2, (150, 6))
    for k in range(2):
        valid = Validity(ARM, TIGHT, made, k)
        assert valid(made.start[k]) and valid(made.goal[k])
        mine = _checker().configurations_free(made, np.full(len(q), k), q)
        np.testing.assert_array_equal(mine, [valid(x) for x in q])
        assert 0.1 < mine.mean() < 0.9


def test_rows_on_results_made_by_hand():
    far = ((5.0, 5, 5), (0.1, 0.1, 0.1))
    one = problems(far)
    both = Problems(
        *(np.repeat(x, 3, 0) for x in (one.start, one.goal, one.center, one.half, one.boxes)), one.reference * 3
    )
    long = np.stack([HOME, HOME + 0.4, one.goal[0]])
    solved = Solved([one.reference[0], long, None], np.array([0, 2, -1]), seconds=0.6)
    rows = {name: entry["value"] for name, entry in problem_rows(both, np.array([True, True, True]), solved).items()}
    assert rows["success"] == pytest.approx(2 / 3) and rows["straight_share"] == pytest.approx(1 / 3)
    assert rows["ms_amortised"] == pytest.approx(200)
    assert rows["length_hard"] == pytest.approx(joint_length(long) / 0.8)
    assert holds("success", 0.99) is False and holds("success", 0.995) and holds("problems", 1) is None
    assert "(missed)" in page(problem_rows(both, np.array([True] * 3), solved))


def test_results_of_processes_are_put_where_their_problems_are():
    parts = side_by_side.parts_of(5, 2)
    found = [Solved([np.full((2, 6), k) for k in part], part.copy(), seconds=1.0 + n, cpu_seconds=1.0, guided_seconds=2.0 + n, compile_seconds=9.0 + n, log=["round"])
             for n, part in enumerate(parts)]  # fmt: skip
    whole = side_by_side.together(5, parts, found)
    np.testing.assert_array_equal(whole.stage, np.arange(5))
    assert [path[0, 0] for path in whole.paths] == list(range(5))
    assert (whole.seconds, whole.cpu_seconds, whole.guided_seconds, whole.compile_seconds) == (2.0, 2.0, 3.0, 9.0)
    assert whole.log == ["process 1: round", "process 2: round"]
    assert side_by_side.process_count(7, 100) == 3 and side_by_side.process_count(2, 10) == 1


def test_a_process_that_ends_without_a_result_is_told_in_a_line() -> None:
    ours, theirs = multiprocessing.Pipe()
    theirs.close()
    for ask in (side_by_side._answer, side_by_side._begin):
        with pytest.raises(UsageError, match="--processes 1"):
            ask(ours)


@pytest.mark.slow
def test_run_solves_a_blocked_problem_and_writes_rows(tmp_path, monkeypatch):
    """Twice the same problem, by two processes, and a free one."""
    middle = jax.jit(lambda q: arm_capsules(ARM, q))(jnp.asarray(HOME + np.array([0.8, 0, 0, 0, 0, 0])))
    x, y, z = np.asarray(middle.b[-1], float)
    made = problems(((x, y, z / 2), (0.04, 0.04, z / 2)), ((5.0, 5, 5), (0.1, 0.1, 0.1)), turn=1.6)
    over = [HOME + np.array([turn, -0.7, 0, 0, 0, 0]) for turn in (0.0, 1.6)]
    path = np.stack([HOME, *over, made.goal[0]])
    file = tmp_path / "problems.npz"
    away = made.center + np.array([5.0, 5, 5])
    arrays = {
        "start": made.start,
        "goal": made.goal,
        "box_center": made.center,
        "box_half_extents": made.half,
        "n_boxes": made.boxes,
    }
    thrice = {name: np.concatenate([x] * 3) for name, x in arrays.items()} | {
        "box_center": np.concatenate([made.center, away, made.center])
    }
    np.savez(file, **thrice, path=np.tile(path, (3, 1)), path_offset=len(path) * np.arange(4))
    monkeypatch.setattr(side_by_side, "FEWEST", 1)
    out = tmp_path / "rows.json"
    config = PlanBenchmarkConfig(
        space="arm",
        problems=file,
        settings=0,
        families=0,
        json=out,
        page=tmp_path / "page.md",
        out=tmp_path / "run",
        peers=0,
        processes=2,
    )
    assert run(config) == 0
    rows = json.loads(out.read_text())["plan_benchmark"]
    assert rows["problems"]["value"] == 3 and rows["success"]["value"] == 1 and rows["processes"]["value"] == 2
    assert rows["straight_share"]["value"] == pytest.approx(1 / 3) and 0.3 < rows["length_hard"]["value"] < 1
    assert (tmp_path / "page.md").read_text().startswith("# The planners")


def test_rows_of_the_arm_are_kept_in_the_folder(tmp_path, monkeypatch, capsys):
    """A failure after the problems, or at the end, loses none of them; other problems are measured anew."""
    file, out = tmp_path / "problems.npz", tmp_path / "rows.json"
    made = problems(((5.0, 5, 5), (0.1, 0.1, 0.1)))

    def written(goal):
        np.savez(file, start=made.start, goal=goal, box_center=made.center, box_half_extents=made.half, n_boxes=made.boxes,
                 path=made.reference[0], path_offset=np.array([0, 2]))  # fmt: skip

    written(made.goal)
    config = PlanBenchmarkConfig(space="arm", problems=file, settings=3, families=0, json=out, out=tmp_path / "run")
    found = {"problems": {"value": 4.0, "unit": "1"}, "success": {"value": 0.97, "unit": "1"}}
    calls = []
    monkeypatch.setattr(arm, "_problems", lambda *_: calls.append("problems") or found)

    def failing(_):
        raise OSError("no space left")

    monkeypatch.setattr(arm, "_speed", failing)
    with pytest.raises(OSError, match="no space"):
        run(config)
    monkeypatch.setattr(arm, "_speed", lambda n: {"settings_per_s": {"value": float(n), "unit": "1/s"}})
    assert run(config) == 0 and calls == ["problems"]
    assert "taken from" in capsys.readouterr().err
    sections = json.loads(out.read_text())
    rows = sections["plan_benchmark"]
    assert rows == {**found, "settings_per_s": {"value": 3.0, "unit": "1/s"}}
    assert set(sections["about"]) == {"plan_benchmark_arm"} and sections["about"]["plan_benchmark_arm"]["cores"] > 0
    written(made.goal + 0.1)
    assert run(config) == 0 and calls == ["problems"] * 2


def test_wrong_problems_are_refused_before_points_are_measured(tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.plan_benchmark.run.measured", lambda *_: pytest.fail("measured"))
    np.savez(tmp_path / "wrong.npz", a=np.zeros(2))
    with pytest.raises(UsageError, match="no planning problems"):
        run(PlanBenchmarkConfig(problems=tmp_path / "wrong.npz", out=tmp_path / "run"))


def test_missing_and_wrong_problems_are_told(tmp_path, capsys):
    config = PlanBenchmarkConfig(
        space="arm", problems=tmp_path / "none.npz", settings=0, families=0, out=tmp_path / "run"
    )
    assert run(config) == 0
    assert "left out" in capsys.readouterr().err
    np.savez(tmp_path / "wrong.npz", a=np.zeros(2))
    with pytest.raises(UsageError, match="no planning problems"):
        read_problems(tmp_path / "wrong.npz", 0)
    assert parse(["--count", "7"]).count == 7
