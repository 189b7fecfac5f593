"""The program that measures the sensing: its own exact geometry, the rows on records made by hand, the folder of a run."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.sensing.appear import brake_tick
from experiments.sensing.config import SensingConfig, parse
from experiments.sensing.excess import approach, excess_speed, within_last
from experiments.sensing.fault_cases import Window, green_ticks, named_after, near_times, schedule_of, windows_of
from experiments.sensing.page import page
from experiments.sensing.rows import (
    BARS,
    all_rows,
    brake_rows,
    definition,
    fault_rows,
    ghost_rows,
    hand_rows,
    holds,
    separation_rows,
    speed_rows,
    static_rows,
)
from experiments.sensing.static import View, seen_by, surface_points
from experiments.sensing.truth import (
    arm_obstacles,
    arm_person,
    axis_points,
    segments_apart,
    solid_distance,
    solids,
    watched,
)
from experiments.sensing.worlds import image_in_use
from hrcjax.cells import make_cell
from hrcjax.lab.case_store import RunStore
from hrcjax.lab.errors import UsageError
from hrcjax.robot import arm_capsules
from hrcjax.sense.faults import BLOCKED
from hrcjax.sim import Cell, Params
from hrcjax.sim.exact import person_distances
from hrcjax.tune.tuned import write_tuned
from hrcjax.world import capsules_obstacle_distances, motion_named, scene_named
from hrcjax.world.person import person_at

ROOT = Path(__file__).parents[2]
DT = 0.008


@pytest.fixture(scope="module")
def cell() -> Cell:
    return make_cell()


# exact geometry


@pytest.mark.parametrize("name", ["robotica", "robotica-spheres", "clutter", "hri"])
def test_the_own_geometry_agrees_with_that_of_the_outcome(name: str, cell: Cell) -> None:
    draw = np.random.default_rng(3)
    scene = scene_named(name, 1)
    person = jax.jit(lambda: motion_named("reach_in", scene, 1, 8.0, 30.0))()
    q, t = draw.uniform(-3, 3, (12, 6)), draw.uniform(-1, 9, 12)

    def distances(q: jax.Array, t: jax.Array) -> tuple[jax.Array, jax.Array]:
        arm = arm_capsules(cell.arm, q)
        links = jax.tree.map(lambda a: a[1:], arm)  # without the base
        return person_distances(arm, person_at(person, t)), capsules_obstacle_distances(scene, links)

    found = jax.jit(jax.vmap(distances))(jnp.asarray(q, jnp.float32), jnp.asarray(t, jnp.float32))
    people, obstacles = (np.asarray(each).min(axis=(1, 2)) for each in found)
    np.testing.assert_allclose(arm_person(cell.arm, person, q, t, whole=True), people, atol=1e-5)
    np.testing.assert_allclose(arm_obstacles(cell.arm, scene, q), obstacles, atol=1e-5)
    part = arm_person(cell.arm, person, q, t)
    assert (part >= people - 1e-5).all()  # without the base never nearer


def test_segments_against_dense_sampling() -> None:
    draw = np.random.default_rng(0)
    a, b, c, d = draw.normal(size=(4, 40, 3))
    d[:5] = c[:5] + (b - a)[:5]  # parallel
    b[5] = a[5]  # a point
    c[6], d[6] = a[6] + 0.3 * (b[6] - a[6]) + 1e-9, d[6]  # touching
    s = np.linspace(0, 1, 161)
    one, other = a[:, None] + s[:, None] * (b - a)[:, None], c[:, None] + s[:, None] * (d - c)[:, None]
    dense = np.linalg.norm(one[:, :, None] - other[:, None], axis=-1).min(axis=(1, 2))
    exact = segments_apart(a, b, c, d)
    assert (exact <= dense + 1e-9).all() and (dense - exact < 0.02).all()


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_surface_points_lie_on_the_surface_and_are_nearest(kind: int) -> None:
    draw = np.random.default_rng(kind)
    size = np.array([0.1, 0.1, 0.2]) if kind < 2 else np.array([0.1, 0.06, 0.2])
    solid = (kind, np.array([0.3, -0.2, 0.4]), size, 0.5 if kind == 2 else 0.0)
    surface = surface_points(solid, 400, draw)
    assert len(surface) == 400
    np.testing.assert_allclose(solid_distance(*solid, surface)[0], 0, atol=1e-9)
    x = solid[1] + draw.uniform(-0.6, 0.6, (200, 3))
    distance, near = solid_distance(*solid, x)
    out = distance > 0
    np.testing.assert_allclose(np.linalg.norm(x - near, axis=1)[out], distance[out], atol=1e-12)
    gap = np.linalg.norm(x[:, None] - surface, axis=-1).min(axis=1)
    assert (gap[out] >= distance[out] - 1e-9).all() and (gap[out] < distance[out] + 0.06).all()


def test_a_camera_sees_the_near_side_and_nothing_behind_another_solid() -> None:
    scene = scene_named("robotica-spheres", 0)
    first = solids(scene)[0]
    side = np.array([1.0, 0.0, 0.0])
    eye = first[1] + 1.5 * side
    R = np.stack([np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -1.0]), -side], axis=1)
    view = View(R, eye, 100.0, 100.0, 80.0, 60.0, 160, 120)
    x = first[1] + first[2][0] * np.stack([side, -side])
    alone = np.asarray(scene.mask) & (np.arange(len(scene.mask)) == np.flatnonzero(np.asarray(scene.mask))[0])
    only = replace_mask(scene, alone)
    assert seen_by(only, view, x, 0.28, 6.0).tolist() == [True, False]
    assert seen_by(only, view, x, 1.6, 6.0).tolist() == [False, False]  # too near
    blocked = scene.center.at[1].set(jnp.asarray(first[1] + 0.7 * side, scene.center.dtype))
    hidden = replace_mask(scene, alone | (np.arange(len(alone)) == 1), center=blocked)
    assert not seen_by(hidden, view, x, 0.28, 6.0).any()


def replace_mask(scene, mask, center=None):
    import equinox as eqx

    changed = eqx.tree_at(lambda s: s.mask, scene, jnp.asarray(mask))
    return changed if center is None else eqx.tree_at(lambda s: s.center, changed, center)


def test_speed_towards_a_person_is_the_change_of_the_distance(cell: Cell) -> None:
    """The nearest sphere's speed equals the slope of the distance to a person who stands still; away is negative."""
    scene = scene_named("robotica", 0)
    person = jax.jit(lambda: motion_named("stand_and_work", scene, 0, 8.0, 30.0))()
    still = replace_person(person)
    draw = np.random.default_rng(1)
    q, qd = cell.arm.home + draw.normal(0, 0.3, (8, 6)), draw.normal(0, 0.5, (8, 6))
    t, h = np.zeros(8), 1e-4
    distance, speed = approach(cell.arm, still, q, qd, t)
    nearest = distance.argmin(axis=1)
    ahead = approach(cell.arm, still, q + h * qd, qd, t)[0]
    behind = approach(cell.arm, still, q - h * qd, qd, t)[0]
    rows = np.arange(8)
    slope = (ahead - behind)[rows, nearest] / (2 * h)
    np.testing.assert_allclose(speed[rows, nearest], -slope, atol=1e-6)
    links, offsets, radii = axis_points(cell.arm)
    assert len(links) == len(offsets) == len(radii) and watched(cell.arm).sum() == 7


def replace_person(person):
    import equinox as eqx

    hold = [jnp.broadcast_to(part[:1], part.shape) for part in (person.a, person.b)]
    return eqx.tree_at(lambda p: (p.a, p.b), person, hold)


# rows on records made by hand


def record(ticks: int = 100, **given: object) -> dict[str, np.ndarray]:
    base = {
        "t": DT * np.arange(ticks),
        "zone": np.zeros(ticks, int),
        "speed_limit": np.ones(ticks),
        "separation": np.full(ticks, 0.9),
        "true_exposed": np.full(ticks, 1.0),
        "true_now": np.full(ticks, 1.0),
        "age": np.full(ticks, 0.06),
        "guarded": np.zeros(ticks, bool),
        "cameras": np.zeros(ticks, int),
        "excess": np.full(ticks, -0.1),
        "plan_status": np.asarray(15),
        "goal_distance": np.linspace(1, 0, ticks),
        "clearance": np.full(20, 0.05),
        "static_error": np.zeros(0),
        "clean": np.asarray(True),
    }
    return base | {name: np.asarray(value) for name, value in given.items()}


def value(rows: dict, name: str) -> float:
    return rows[name]["value"]


def test_false_stops() -> None:
    slow = record()
    slow["zone"][3], slow["speed_limit"][4] = 1, 0.9
    rows = ghost_rows([record(), slow], 1.0)
    assert value(rows, "ghost_stop_share") == pytest.approx(2 / 200) and value(rows, "ghost_arrivals") == 1
    stuck, unclear = record(goal_distance=np.full(100, 0.5)), record(goal_distance=np.ones(100), plan_status=1)
    assert value(ghost_rows([record(), stuck, unclear], 1.0), "ghost_arrivals") == 0.5  # of those with a clear plan


def test_a_sensed_distance_that_is_too_far_is_positive() -> None:
    good = separation_rows([record()], 1.07)
    assert value(good, "separation_over_p999") == pytest.approx(-100)
    assert value(good, "pessimism_mean") == pytest.approx(100) and value(good, "separation_over_share") == 0
    assert holds("separation_over_p999", value(good, "separation_over_p999"))
    far = record(separation=np.full(100, 9.0))
    bad = separation_rows([far], 1.07)
    assert value(bad, "separation_over_p999") == pytest.approx(8000) and not holds("separation_over_p999", 8000)
    assert value(bad, "separation_over_near_max") == pytest.approx(70)  # cut where full speed begins
    assert "separation_over_p999" not in separation_rows([record(true_exposed=np.full(100, 3.0))], 1.07)
    assert "separation_over_p999" not in separation_rows([record(age=np.full(100, np.inf))], 1.07)


def test_static_errors_and_missed_obstacles() -> None:
    set_up = {
        "error": np.asarray([-0.004, 0.008]),
        "share_seen": np.asarray([0.5, 0.5, 0.01, 0.5]),
        "in_map": np.asarray([True, False, False, False]),
        "radius": np.asarray([0.06, 0.06, 0.06, 0.02]),
        "unseen_share": np.asarray(0.1),
        "unseen_free_share": np.asarray(0.05),
        "rounds": np.asarray(17),
        "settled": np.asarray(True),
        "seconds": np.asarray(2.0),
    }
    rows = static_rows([set_up], [np.asarray([0.02])])
    assert value(rows, "static_error_p50") == pytest.approx(8)
    assert value(rows, "static_over_p95") == pytest.approx(np.percentile([-4, 8, 20], 95))
    assert value(rows, "obstacles_missed") == 1  # the third is out of view, the fourth is thin


def test_excess_speed_counts_motion_towards_the_person_alone() -> None:
    ssm = Params().safety.ssm
    near, far = np.full((40, 1), 0.2), np.full((40, 1), 5.0)
    speed = np.full((40, 1), 0.3)
    assert excess_speed(near, speed, ssm, DT).max() == pytest.approx(0.3)  # nearer than S_p(0): nothing is allowed
    assert excess_speed(near, -speed, ssm, DT).max() == pytest.approx(-0.3)
    assert excess_speed(far, speed, ssm, DT).max() < 0
    came = np.where(np.arange(40)[:, None] < 20, far, near)  # at once at tick 20: known after the reaction time
    over = excess_speed(came, speed, ssm, DT)
    assert over[20 + 12] < 0 < over[20 + 14]
    np.testing.assert_allclose(within_last(np.arange(5.0)[::-1, None], 2)[:, 0], [4, 4, 4, 3, 2])
    rows = speed_rows([record(), record(excess=np.full(100, 0.2), clean=False)])
    assert value(rows, "excess_speed_max") == pytest.approx(-0.1)
    assert value(rows, "excess_speed_max_jumps") == pytest.approx(0.2)


def test_braking_is_counted_from_the_tick_that_may_know() -> None:
    t = DT * np.arange(100)
    zone, speed = np.zeros(100, int), np.ones(100)
    zone[50:] = 3
    speed[51:] = np.linspace(0.9, 0, 49)  # the command of tick 50 slows it
    qd = speed[:, None] * np.ones(6)
    assert brake_tick(zone, qd, 30) == 50
    case = {"t": t, "zone": zone, "qd": qd, "begin": np.asarray(t[40]), "first": np.asarray(t[43])}
    rows = brake_rows([case], latency=7 * DT)  # due at tick 50
    assert value(rows, "brake_delay_ticks") == 0 and value(rows, "brake_delay_ms") == pytest.approx(80)
    late = brake_rows([case | {"first": np.asarray(t[40])}], latency=7 * DT)
    assert value(late, "brake_delay_ticks") == 3 and not holds("brake_delay_ticks", 3)
    assert brake_tick(np.zeros(100, int), qd, 30) == 100  # never in red: never


def faulty(**given: object) -> dict[str, np.ndarray]:
    stamps = np.arange(24) / 30
    base = record(
        stamp=stamps,
        camera=np.arange(24) % 2,
        begin=[0.2],
        end=[0.5],
        faulty=[[True, False]],
        true_now=np.full(100, 0.2),
    )
    return base | {name: np.asarray(value) for name, value in given.items()}


def test_a_fault_must_be_named_on_its_own_camera() -> None:
    t = DT * np.arange(100)
    first = 6 / 30  # of camera 0 at or after 0.2 s
    named = np.where((t >= first + 0.05) & (t < 0.6), 4, 0)
    assert named_after(faulty(cameras=named), 0, False) == pytest.approx(0.05, abs=DT)
    assert named_after(faulty(cameras=named << 8), 0, False) == pytest.approx(0.3)  # the other one: never, its length
    both = faulty(cameras=named, faulty=[[True, True]])
    assert named_after(both, 0, False) == pytest.approx(0.3)  # camera 1 is never named
    assert np.isnan(named_after(faulty(begin=[2.0], end=[2.3]), 0, False))  # met no exposure
    guarded = faulty(guarded=t >= 0.3, faulty=[[True, True]])
    assert named_after(guarded, 0, True) == pytest.approx(0.3 - 7 / 30, abs=DT)  # once no camera measures anyone
    assert np.isnan(named_after(faulty(), 0, True))  # the other camera still does


def test_green_too_near_counts() -> None:
    assert green_ticks(faulty(), 0, 0.31) == len(
        np.flatnonzero((DT * np.arange(100) >= 0.2) & (DT * np.arange(100) < 0.65))
    )
    assert green_ticks(faulty(zone=np.ones(100, int)), 0, 0.31) == 0
    assert green_ticks(faulty(true_now=np.full(100, 0.4)), 0, 0.31) == 0
    rows = fault_rows({"blocked": [faulty()]}, 0.31)
    assert value(rows, "fault_blocked_green") > 0 and not holds(
        "fault_blocked_green", value(rows, "fault_blocked_green")
    )
    assert value(rows, "fault_blocked_over_max") == pytest.approx(700)


def test_moments_of_faults_are_apart_and_while_somebody_is_near() -> None:
    t = DT * np.arange(1250)
    distance = np.where((t > 2) & (t < 6), 1.0, 3.0)
    times = near_times(t, distance, 4)
    assert len(times) == 4 and min(np.diff(times)) >= 0.7 - 1e-9 and times[0] > 2 and times[-1] < 6
    sets = [window.cameras for window in windows_of(times, 2, 0)]
    assert sets == [(0,), (0, 1), (1,), (0, 1)]
    made = schedule_of(BLOCKED, [Window((0, 1), 1.0, 1.4)], 2, 4)
    assert made.kind.shape == (2, 4) and np.asarray(made.kind)[:, :2].tolist() == [[BLOCKED, 0], [0, BLOCKED]]


def test_hands_that_few_pixels_show_do_not_count() -> None:
    case = {"kind": np.asarray([0, 0, 1]), "pixels": np.asarray([3, 20, 90]), "found": np.asarray([False, False, True])}
    rows = hand_rows([case])
    assert value(rows, "hand_first_frame") == 0.5 and value(rows, "hand_thin_first_frame") == 0


def test_the_image_in_use_is_the_newest_good_one() -> None:
    stamp = np.asarray([-0.1, 0.0, 0.1, 0.2])
    index, age = image_in_use(stamp, np.asarray([True, True, False, True]), np.asarray([0.0, 0.16, 0.26]), 0.05)
    assert index.tolist() == [0, 1, 3]
    np.testing.assert_allclose(age, [0.1, 0.16, 0.06], atol=1e-6)
    assert np.isinf(image_in_use(stamp, np.zeros(4, bool), np.asarray([1.0]), 0.05)[1]).all()


def test_every_row_is_explained_and_every_bar_has_a_row() -> None:
    cases = {"episode/a-0-nobody": record(), "episode/a-0-reach_in": record(), "fault/blocked/a-0-reach_in-0": faulty()}
    cases["camera-lost/a-0-0"] = record()
    rows = all_rows(cases, Params(), 0.05, 1.07, 0.31)
    assert all(definition(name) for name in [*rows, *BARS])
    text = page(rows, SensingConfig(), ["`cloud.png`: points"])
    assert all(f"| {name} |" in text for name in rows) and "`cloud.png`" in text
    assert json.loads(json.dumps(rows)) == rows


# folder and options


def test_a_run_resumes_and_another_is_refused(tmp_path: Path) -> None:
    made = []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"x": np.arange(3)}

    store = RunStore(tmp_path / "run", "a", {}, False)
    assert store.take("episode/x", make)[1] and not store.take("episode/x", make)[1]
    again = RunStore(tmp_path / "run", "a", {}, False)
    found, computed = again.take("episode/x", make)
    assert not computed and found["x"].tolist() == [0, 1, 2] and len(made) == 1
    next((tmp_path / "run" / "cases").glob("*.npz")).write_bytes(b"PK\x03\x04broken")  # cut off
    assert again.take("episode/x", make)[1] and len(made) == 2
    with pytest.raises(UsageError, match="other options or other code"):
        RunStore(tmp_path / "run", "b", {}, False)
    assert RunStore(tmp_path / "run", "b", {}, True).get("episode/x") is None
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "file").write_text("")
    with pytest.raises(UsageError, match="holds other files"):
        RunStore(tmp_path / "other", "a", {}, False)


SET_UP = {k: np.asarray(v) for k, v in {"error": [], "share_seen": [], "in_map": [], "radius": [], "unseen_share": 0, "unseen_free_share": 0, "rounds": 1, "settled": True, "seconds": 1}.items()}  # fmt: skip


def test_a_killed_run_computes_the_rest_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from experiments.sensing import run as program

    calls: list[str] = []

    def case(_bench: object, _set_up: object, name: str) -> dict[str, np.ndarray]:
        calls.append(name)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return record()

    monkeypatch.setattr(program, "static_case", lambda *_: SET_UP)
    monkeypatch.setattr(program, "episode_case", case)
    monkeypatch.setattr(program.Runner, "set_up", lambda *_: None)
    words = ["--scenes", "hri", "--people", "nobody", "reach_in", "pass_by", "--moments", "0", "--appearances", "0", "--hands", "0", "--images", "0", "--no-figures"]  # fmt: skip
    config = replace(parse(words), out=tmp_path / "run", json=tmp_path / "rows.json", page=tmp_path / "page.md")
    with pytest.raises(KeyboardInterrupt):
        program.run(config)
    assert program.run(config) == 0
    assert sorted(calls) in (
        ["nobody", "pass_by", "reach_in", "reach_in"],
        ["nobody", "pass_by", "pass_by", "reach_in"],
    )
    rows = json.loads((tmp_path / "rows.json").read_text())["sensing"]
    assert rows["episodes"] == {"value": 3.0, "unit": "episodes"} and set(rows["pessimism_mean"]) == {"value", "unit"}
    assert (tmp_path / "page.md").read_text().startswith("# What the cell senses")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--scenes", "moon"], "unknown scene 'moon'"),
        (["--people", "ghost"], "unknown person 'ghost'"),
        (["--people", "nobody", "nobody"], "each once"),
        (["--seeds", "0"], "accepted is 1 or more"),
        (["--hands", "-1"], "accepted is 0 or more"),
        (["--json", "none/x.json"], "no folder none"),
        (["--config", "huge"], "no config 'huge'"),
    ],
)
def test_mistakes_get_one_line(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from experiments.sensing.__main__ import main

    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1 and not list(tmp_path.iterdir())


def test_help_explains_every_option() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "experiments.sensing", "--help"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert all(f"--{name}" in done.stdout for name in SensingConfig.__dataclass_fields__)


def test_named_settings_are_those_of_the_options() -> None:
    assert parse([]).seeds == 1 and parse(["--config", "full"]).seeds == 10
    quick = parse(["--quick"])
    assert quick.scenes == ("robotica", "clutter") and quick.moments == 5


def test_parameters_of_a_file_are_those_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from experiments.sensing import run as program

    used: list[float] = []

    def case(bench: Any, _set_up: object, _name: str) -> dict[str, np.ndarray]:
        used.append(float(bench.params.potential.zeta))
        return record()

    monkeypatch.setattr(program, "static_case", lambda *_: SET_UP)
    monkeypatch.setattr(program, "episode_case", case)
    monkeypatch.setattr(program.Runner, "set_up", lambda *_: None)
    write_tuned(tmp_path / "tuned.toml", {"potential.zeta": 2.5}, "")
    config = replace(parse(["--scenes", "hri", "--people", "nobody", "--moments", "0", "--appearances", "0", "--hands", "0", "--images", "0", "--no-figures"]), out=tmp_path / "run")  # fmt: skip
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
