"""The program that measures the avoidance: scenes, exact measures, retreats, the rows on cases made by hand, the folder of a run."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.avoidance import gradients, rows
from experiments.avoidance.bench import Played, on_host, single, without_leaves, without_stop
from experiments.avoidance.config import AvoidanceConfig, parse
from experiments.avoidance.hands import closed
from experiments.avoidance.page import command, page
from experiments.avoidance.retreat import best_retreat, control_points, from_person, from_solids
from experiments.avoidance.unknown import ARM_APART, BESIDE, ENDS_APART, near_ticks, unknown_scene
from hrcjax.cells import make_cell
from hrcjax.lab.errors import UsageError
from hrcjax.reference.truth import obstacle_distances, solid_distance
from hrcjax.sim import Cell, Params
from hrcjax.tune.tuned import write_tuned
from hrcjax.world import Person
from hrcjax.world.scene import COLUMN
from hrcjax.world.scenes import Obstacle, make_scene

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def cell() -> Cell:
    return make_cell()


def solids(scene) -> list[tuple]:
    return [
        (int(scene.kind[k]), np.asarray(scene.center[k], float), np.asarray(scene.size[k], float), float(scene.yaw[k]))
        for k in np.flatnonzero(np.asarray(scene.mask))
    ]


def test_unknown_obstacles_stand_on_the_way_and_off_its_ends(cell: Cell) -> None:
    counts, kinds = set(), set()
    for seed in range(12):
        scene, known = unknown_scene(cell, seed)
        start, goal = np.asarray(scene.start, float), np.asarray(scene.goal, float)
        assert not np.asarray(known.mask).any() and np.array_equal(known.start, scene.start)
        assert (start[0] > 0) == (seed % 2 == 0) or abs(start[0]) < 0.07  # robotica and hri in turn
        for solid in solids(scene):
            assert min(solid_distance(*solid, start), solid_distance(*solid, goal)) >= ENDS_APART - 1e-6
            way = start + np.linspace(0, 1, 200)[:, None] * (goal - start)
            assert np.linalg.norm((way - solid[1])[:, :2], axis=1).min() < BESIDE + 0.01
            kinds.add(solid[0])
        counts.add(len(solids(scene)))
    assert counts == {1, 2} and kinds == {0, 1, 2}
    again = unknown_scene(cell, 3)[0]
    assert eqx.tree_equal(again, unknown_scene(cell, 3)[0])
    assert ARM_APART > rows.ENOUGH, "so that the start itself keeps the clearance that counts"


def test_least_clearance_of_all_ticks(cell: Cell) -> None:
    """Coarse and then fine, against every tick."""
    u = np.linspace(0, 1, 301)[:, None]
    q = cell.arm.home + np.array([1.2, 0.5, -0.4, 0, 0, 0]) * u + 0.1 * np.sin(40 * u)
    scene = make_scene([Obstacle(COLUMN, (0.35, 0.25, 0.2), (0.04, 0.04, 0.2), 0.0, 0.04)], *[(0.0, 0.0, 0.5)] * 4)
    found, every = near_ticks(cell, scene, q), obstacle_distances(cell.arm, scene, q).min(axis=1)
    assert np.nanmin(found) == every.min() and every.argmin() % 5, "between two of the coarse ticks"
    assert np.isfinite(found).sum() < 150
    np.testing.assert_array_equal(found[np.isfinite(found)], every[np.isfinite(found)])


def test_arrival_and_end_of_an_episode() -> None:
    t = 0.01 * np.arange(400)
    tool = np.stack([np.minimum(t, 1.0), 0 * t, 0 * t], axis=1)
    zero = np.zeros(400, int)
    one = Played(t, tool, tool, tool, zero, zero, zero, 7, tool)
    goal = np.array([1.0, 0, 0])
    assert one.arrived(goal) and one.time(goal) == pytest.approx(1.01) and one.end(goal) == 201
    assert not one.arrived(np.array([0.5, 0, 0])), "passed, not at rest"
    assert one.time(np.array([0.5, 0, 0])) == pytest.approx(3.99) and one.end(np.array([0.5, 0, 0])) == 399


def test_parts_are_switched_off() -> None:
    params = single(Params())
    off, free = without_leaves(params), without_stop(params)
    assert float(off.policy.collision.weight) == 0 < float(params.policy.collision.weight)
    assert float(free.policy.collision.weight) == 0
    back = eqx.tree_at(lambda p: p.policy.collision.weight, off, params.policy.collision.weight)
    if hasattr(params.policy, "repulsion"):
        assert float(off.policy.repulsion.weight) == 0
        back = eqx.tree_at(lambda p: p.policy.repulsion.weight, back, params.policy.repulsion.weight)
    assert eqx.tree_equal(back, params), "and nothing else"


# retreats


def ball(*places: np.ndarray) -> Person:
    """Balls of 5 cm that stand still."""
    at = jnp.asarray(np.stack([np.asarray(places, float)] * 2))
    radius = jnp.full(len(places), 0.05, at.dtype)
    return on_host(Person(at, at, radius, jnp.asarray(1.0, at.dtype), jnp.ones(2, bool), ("hand",) * len(places)))


NOTHING = make_scene([], *[(0.0, 0.0, 0.5)] * 4)


def test_a_row_is_the_derivative_of_the_nearest_distance(cell: Cell) -> None:
    draw = np.random.default_rng(0)
    for _ in range(5):
        q, qd = cell.arm.home + draw.normal(size=6) * 0.3, draw.normal(size=6)
        tip = control_points(cell.arm, q)[0][-1]
        person = ball(tip + 0.25 * draw.normal(size=3) / np.sqrt(3))

        def nearest(q, person=person):
            x, _ = control_points(cell.arm, q)
            return (from_person(x, person.a[0], person.b[0], person.radius)[0] - cell.arm.control_radii).min()

        _, row = best_retreat(cell.arm, NOTHING, person, q, 0.5)
        slope = (nearest(q + 1e-6 * qd) - nearest(q - 1e-6 * qd)) / 2e-6
        assert row @ qd == pytest.approx(slope, rel=1e-4, abs=1e-6)


def test_retreats_that_exist_and_that_do_not(cell: Cell) -> None:
    q = np.asarray(cell.arm.home, float)
    x, _ = control_points(cell.arm, q)
    tip, radius = x[-1], cell.arm.control_radii[-1]
    above = ball(tip + np.array([0, 0.02, 0.12]))
    assert best_retreat(cell.arm, NOTHING, above, q, 0.5)[0] > 0.1
    absent = eqx.tree_at(lambda p: p.present, above, np.zeros(2, bool))
    assert best_retreat(cell.arm, NOTHING, absent, q, 0.5)[0] == 0
    # a wall of boxes below, beside and behind: the nearest point can go nowhere but towards the person
    gap = radius + 0.005
    walls = [
        Obstacle(2, tuple(tip - side * (gap + 0.1)), (0.1, 0.1, 0.1), 0.0, 0.1)
        for side in (np.array([0, 0, 1.0]), np.array([1.0, 0, 0]), np.array([-1.0, 0, 0]), np.array([0, 1.0, 0]), np.array([0, -1.0, 0]))
    ]  # fmt: skip
    boxed = make_scene(walls, *[(0.0, 0.0, 0.5)] * 4)
    assert best_retreat(cell.arm, boxed, ball(tip + (radius + 0.06) * np.eye(3)[2]), q, 0.5)[0] == pytest.approx(
        0, abs=1e-6
    )


def test_normals_of_solids() -> None:
    scene = make_scene([Obstacle(2, (0.0, 0.0, 0.5), (0.1, 0.2, 0.3), 0.0, 0.1)], *[(0.0, 0.0, 0.5)] * 4)
    distance, normal = from_solids(scene, np.array([[0.3, 0.0, 0.5], [0.0, -0.5, 0.5]]))
    np.testing.assert_allclose(distance, [[0.5, 0.5], [0.2, 0.3]], atol=1e-6)
    np.testing.assert_allclose(normal[1], [[1, 0, 0], [0, -1, 0]], atol=1e-6)


# rows on cases made by hand


def value(found: dict, name: str) -> float:
    return found[name]["value"]


def obstacle(on: float, off: float, arrived: bool = True) -> dict:
    case = {f"clearance_{name}": np.asarray(gap) for name, gap in (("on", on), ("leaf_off", 0.01), ("off", off))}
    return case | {f"arrived_{name}": np.asarray(arrived or name == "off") for name in rows.VARIANTS}


def test_rows_of_obstacles() -> None:
    found = rows.obstacle_rows([obstacle(0.05, -0.02), obstacle(0.02, 0.04, False), obstacle(-0.001, -0.01)])
    assert value(found, "contact_share") == pytest.approx(1 / 3) and value(found, "contact_share_off") == pytest.approx(
        2 / 3
    )
    assert value(found, "clearance_3cm_share") == pytest.approx(1 / 3) and value(
        found, "arrived_share"
    ) == pytest.approx(2 / 3)
    assert not rows.holds("unknown_obstacle", "contact_share", 1 / 3) and rows.holds(
        "unknown_obstacle", "contact_share", 0.0
    )


def hand(both: float, path: float, stopped: tuple[float, float], away: list[float], **given: object) -> dict:
    case: dict = {
        "able": np.full(len(away), 0.2),
        "away": np.asarray(away),
        "close": np.ones(len(away), bool),
        "closed": False,
    }
    for mode, time, stop in (("both", both, stopped[0]), ("path", path, stopped[1])):
        case |= {
            f"time_{mode}": time, f"stopped_{mode}": stop, f"arrived_{mode}": time < 10, f"separation_min_{mode}": 0.05,
            f"moving_contact_{mode}": False, f"standing_contact_{mode}": False,
        }  # fmt: skip
    return {name: np.asarray(v) for name, v in {**case, **given}.items()}


def test_rows_of_hands() -> None:
    """Three are hindered: one goes round, one draws back, one does nothing; the fourth is free."""
    cases = [
        hand(3.0, 10.0, (0.0, 5.0), []),
        hand(10.0, 10.0, (6.0, 6.0), [0.2] * 10, closed=True),
        hand(8.0, 8.0, (3.0, 3.0), [0.0] * 10),
        hand(2.0, 2.0, (0.0, 0.0), [], moving_contact_both=True),
    ]
    found = rows.hand_rows(cases, 0.008)
    assert value(found, "hindered") == 3 and value(found, "time_ratio") == 1 and value(found, "time_ratio_all") == 1
    assert value(found, "closed") == 1 and value(found, "time_ratio_open") == pytest.approx(0.65)
    assert value(found, "retreat_or_round_share") == pytest.approx(2 / 3)
    assert value(found, "moving_contact_share_both") == 0.25 and value(found, "arrived_share_path") == 0.5
    alone = [{name: v for name, v in cases[0].items() if not name.endswith("path")}]
    assert "time_ratio" not in rows.hand_rows(alone, 0.008), "a cell that moves in one way only"


def test_a_goal_beside_which_somebody_stays_is_closed() -> None:
    """Somebody who leaves, who comes and stays, who moves away for less than 0.5 s at a time, and nobody."""
    near, far = np.full(200, 0.3), np.full(200, 0.5)
    assert not closed(np.concatenate([far, near, far]), 0.36, 0.008)
    assert closed(np.concatenate([far, near]), 0.36, 0.008) and closed(
        np.concatenate([far, near, far[:60], near]), 0.36, 0.008
    )
    assert not closed(far, 0.36, 0.008) and not closed(np.full(5, np.inf), 0.36, 0.008)


def test_rows_of_retreats() -> None:
    case = {
        "able": np.array([0.2, 0.2, 0.2, 0.01, 0.2]), "away": np.array([0.1, 0.0, -0.1, 0.0, 0.1]),
        "close": np.array([True, True, False, True, False]),
    }  # fmt: skip
    found = rows.retreat_rows([case])
    assert value(found, "ticks") == 4 and value(found, "retreat_share") == 0.5
    assert value(found, "still_share") == 0.25 and value(found, "approach_share") == 0.25
    assert value(found, "retreat_share_close") == 0.5 and value(found, "unable_share") == pytest.approx(0.2)
    nothing = {name: np.zeros(0) for name in case}
    assert value(rows.retreat_rows([nothing]), "ticks") == 0


def derivatives() -> dict:
    """Four settings: right; right by the narrow step alone; a jump; wrong."""
    true = np.array([[1.0, 2.0, 3.0]] * 4)
    wide, narrow, gradient = true.copy(), true.copy(), true.copy()
    wide[1, 0] = 5.0
    wide[2, 1], narrow[2, 1] = 20.0, 200.0
    gradient[3, 2] = 4.0
    gradient[3, 0] = narrow[3, 0] = wide[3, 0] = 0.0
    what = np.full((4, 3), "", dtype="U32")
    what[2, 1], what[3, 2] = "zone+stop", "unknown"
    return {
        "loss": np.ones(4), "gradient": gradient, "differences": np.stack([wide, narrow]), "what": what,
        "knobs": np.ones((4, 3)),
    }  # fmt: skip


def test_rows_of_derivatives() -> None:
    found = rows.gradient_rows([derivatives()])
    assert (
        value(found, "settings") == 4
        and value(found, "nonzero_share") == 0.75
        and value(found, "nonzero_K_att") == 0.75
    )
    assert value(found, "equal_share") == pytest.approx(10 / 12) and value(found, "equal_K_rep") == 0.75
    assert value(found, "jumps") == 2 and value(found, "wrong_without_jump") == 1
    assert value(found, "wrong_at_zone+stop") == 1 and value(found, "wrong_at_unknown") == 1


def test_what_tells_two_episodes_apart() -> None:
    same = (np.asarray(7), np.zeros((3, 3)), np.zeros(5, int), np.zeros(5, int), np.zeros(5, int))
    assert gradients.difference(same, same) == "unknown"
    zone = (*same[:2], np.array([0, 0, 1, 0, 0]), *same[3:])
    assert gradients.difference(same, zone) == "zone"
    plan = (same[0], same[1] + 0.01, zone[2], *same[3:])
    assert gradients.difference(same, plan) == "plan+zone"


def test_settings_are_log_uniform_and_nested() -> None:
    many, few = gradients.settings(400), gradients.settings(30)
    np.testing.assert_array_equal(many[:30], few)
    low, high = np.array(list(gradients.RANGES.values())).T
    assert ((many >= low) & (many <= high)).all()
    u = (np.log(many) - np.log(low)) / (np.log(high) - np.log(low))
    np.testing.assert_allclose(u.mean(axis=0), 0.5, atol=0.06)


def all_cases() -> dict[str, dict]:
    return {
        "obstacle/0": obstacle(0.05, -0.02),
        "hand/a-0-b": hand(3.0, 10.0, (0.0, 5.0), [0.1, 0.0]),
        "gradient/0-4": derivatives(),
    }


def test_every_row_is_explained_and_every_bar_has_a_row() -> None:
    sections = rows.all_rows(all_cases(), list(rows.BARS), 0.008)
    assert list(sections) == list(rows.BARS)
    for section, found in sections.items():
        assert all(rows.definition(section, name) for name in found)
        assert set(rows.BARS[section]) <= set(found)
        assert "NO" in rows.table(section, found) or section in ("unknown_obstacle", "hand_in_the_way")
    text = page(sections, AvoidanceConfig(), ("reach_in",), ["`paths.png`: ways"])
    assert all(f"| {name} |" in text for found in sections.values() for name in found) and "`paths.png`" in text
    assert json.loads(json.dumps(sections)) == sections


# folder and options


def test_a_killed_run_computes_the_rest_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from experiments.avoidance import run as program

    calls: list[int] = []

    def case(_bench: object, seed: int) -> dict:
        calls.append(seed)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return obstacle(0.05, -0.02)

    monkeypatch.setattr(program, "obstacle_case", case)
    words = ["--sections", "unknown_obstacle", "--obstacles", "3", "--no-figures"]
    config = replace(parse(words), out=tmp_path / "run", json=tmp_path / "rows.json", page=tmp_path / "page.md")
    with pytest.raises(KeyboardInterrupt):
        program.run(config)
    assert program.run(config) == 0 and calls == [0, 1, 1, 2]
    assert program.run(replace(config, obstacles=4)) == 0 and calls[4:] == [3], "more scenes go on from those"
    found = json.loads((tmp_path / "rows.json").read_text())["unknown_obstacle"]
    assert found["scenes"] == {"value": 4.0, "unit": "scenes"}
    assert (tmp_path / "page.md").read_text().startswith("# How the arm avoids")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--scenes", "moon"], "unknown scene 'moon'"),
        (["--people", "ghost"], "unknown person 'ghost'"),
        (["--sections", "all"], "accepted are unknown_obstacle"),
        (["--obstacles", "0"], "accepted is 1 or more"),
        (["--recordings", "nowhere"], "no such folder"),
        (["--json", "nowhere/rows.json"], "no folder nowhere"),
    ],
)
def test_wrong_options_get_one_line(words: list[str], message: str, tmp_path: Path) -> None:
    from experiments.avoidance.run import run

    with pytest.raises(UsageError, match=message):
        run(replace(parse(words), out=tmp_path / "run"))
    assert not (tmp_path / "run").exists()


def test_options() -> None:
    assert parse([]) == AvoidanceConfig() == parse(["--config", "standard"])
    quick = parse(["--quick"])
    assert quick.obstacles == 6 and quick.scenes == ("robotica",) and quick.gradients == 8
    assert parse(["--quick", "--obstacles", "2"]).obstacles == 2


@pytest.mark.slow
def test_help_from_a_shell() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "experiments.avoidance", "--help"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert "unknown_obstacle   an obstacle that the planner does not know" in done.stdout
    assert "--gradients" in done.stdout


def test_double_precision_of_a_world() -> None:
    import jax

    with jax.enable_x64(True):
        wide = gradients.as_double({"a": jnp.ones(2, jnp.float32), "b": jnp.arange(3), "c": 2.0, "d": np.array([True])})
    assert wide["a"].dtype == wide["c"].dtype == jnp.float64 and wide["b"].dtype.kind == "i" and wide["d"].dtype == bool


def test_the_page_names_the_command_that_made_it() -> None:
    config = AvoidanceConfig(scenes=("hri",), people=("reach_in",), recordings=Path("people"), seeds=1)
    words = command(config).split()
    assert parse(words[3 : words.index("--json")]) == config


def test_parameters_of_a_file_are_those_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from experiments.avoidance import run as program

    used: list[float] = []

    def case(bench: Any, _seed: int) -> dict:
        used.append(bench.params.potential.zeta)
        return obstacle(0.05, -0.02)

    monkeypatch.setattr(program, "obstacle_case", case)
    write_tuned(tmp_path / "tuned.toml", {"potential.zeta": 2.5}, "")
    config = replace(parse(["--sections", "unknown_obstacle", "--obstacles", "1", "--no-figures"]), out=tmp_path / "run")  # fmt: skip
    assert program.run(config) == 0
    with pytest.raises(UsageError, match="a run with other options"):
        program.run(replace(config, params=str(tmp_path)))
    capsys.readouterr()
    assert program.run(replace(config, params=str(tmp_path), overwrite=True)) == 0
    assert used[0] != used[1] == 2.5
    assert (
        f"parameters of {tmp_path}: 1 differs from its default: potential.zeta {used[0]:g} -> 2.5"
        in capsys.readouterr().err
    )
    about = json.loads((tmp_path / "run/run.json").read_text())
    assert about["params"]["potential.zeta"] == 2.5 and about["config"]["params"] == str(tmp_path)
    assert program.run(replace(config, params=str(tmp_path / "tuned.toml"))) == 0 and len(used) == 2, "the same values"
    write_tuned(tmp_path / "tuned.toml", {"potential.zet": 2.5}, "")
    with pytest.raises(UsageError, match=r"--params .*: the cell has no parameter 'potential.zet'"):
        program.run(replace(config, params=str(tmp_path)))
