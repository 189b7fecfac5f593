"""The HRI experiment: one set of images for all systems, contacts by the exact truth, pairs, rows, page, resume."""

import json
import types
from dataclasses import fields, replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.hri import animation
from experiments.hri import run as run_module
from experiments.hri.baseline.cameras import Cameras
from experiments.hri.case import kept, measures_of, trace_of
from experiments.hri.config import SYSTEMS, HriConfig, parse
from experiments.hri.cycle import LEGS, to_and_fro
from experiments.hri.measures import Measured
from experiments.hri.nearest import nearest_point
from experiments.hri.page import page
from experiments.hri.rows import BARS, Pair, all_rows, definition, holds, interval, row
from experiments.hri.systems import EXPLAINED, Bench, cell_of
from experiments.hri.trace import PROBE_TICKS, PROBES, Trace, arrivals, probes_between, true_distances
from experiments.hri.unguarded import UNBOUNDED, UNGUARDED
from hrcjax.cells.ur5 import make_cell
from hrcjax.lab.errors import UsageError
from hrcjax.plan import path_curve
from hrcjax.robot import tool_frame
from hrcjax.sense import no_faults
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Separation, separation_monitor, watch
from hrcjax.sim.own_sensing import tick_images, ticks_of
from hrcjax.sim.params import Params
from hrcjax.sim.route import Route
from hrcjax.sim.survey import SenseParams
from hrcjax.world import Person, scene_named

SCENE = scene_named("hri")
CELL = make_cell()
A = np.array([-1.778224, -1.4850419, 1.6393753, -1.7251298, -1.5707964, 0.01309992])
B = np.array([-0.26363474, -1.4830216, 1.637163, -1.7249378, -1.5707964, 0.01343654])
ENDS = np.array([[0.0, 0.53, 0.25], [-0.53, 0.03, 0.25]])


def ball(place: np.ndarray, radius: float = 0.1) -> Person:
    """A person of one ball that stays at a place."""
    at = jnp.broadcast_to(jnp.asarray(place, SCENE.start.dtype), (2, 1, 3))
    return Person(at, at, jnp.full((1,), radius, at.dtype), jnp.asarray(1.0, at.dtype), jnp.ones((2,), bool), ("hand",))


def swing(ticks: int = 625, period: float = 2.5) -> np.ndarray:
    """(tick joint) to and fro between the waypoints by a cosine [rad]"""
    u = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(ticks) * CELL.dt / period)
    return A + u[:, None] * (B - A)


tools = jax.jit(jax.vmap(lambda q: tool_frame(CELL.arm, q)[1]))


def trace(q: np.ndarray, person: Person, shake: float = 0.0) -> Trace:
    """The run of an arm that moves so, with the exact truth as what it knows."""
    t = np.arange(len(q)) * CELL.dt
    cell = replace(CELL, ticks=len(q))
    separation, clearance = true_distances(cell, SCENE, person, q, t)
    times = t[::PROBE_TICKS]
    probes = np.tile(probes_between(np.stack([A, B])), (len(times), 1))
    true, _ = true_distances(cell, SCENE, person, probes, np.repeat(times, PROBES))
    tool = np.array(tools(jnp.asarray(q, jnp.float32)), float)
    tool[:, 2] += shake * np.sin(2 * np.pi * 3 * t)
    known = true.reshape(-1, PROBES)
    return Trace(
        CELL.dt, t, q, np.gradient(q, CELL.dt, axis=0), tool, separation, clearance, separation, np.zeros(len(q)),
        np.zeros(len(q), int), times, known, known,
    )  # fmt: skip


def test_ours_and_the_baseline_see_the_same_image(monkeypatch: pytest.MonkeyPatch) -> None:
    """Same camera, time, person, noise: what our sensing measures is what the octree gets, but for the robot's pixels."""
    cell = replace(CELL, ticks=60)
    rig, person, key = cell_rig(SCENE, decimation=16), ball(np.array([-0.4, 0.5, 0.5])), jax.random.key(5)
    cameras = Cameras(cell, SCENE, rig, person, key)
    stage = watch.stage_of(rig, SCENE, person, no_faults(rig.count, SCENE.start.dtype))
    known = types.SimpleNamespace(q_start=SCENE.start, stage=stage)
    images = ticks_of.__wrapped__(cell, known, key)  # type: ignore[attr-defined]
    _, _, _, which = tick_images(cell, rig.rates)

    class Measured_(Exception):
        pass

    def measure(*args: object) -> None:
        raise Measured_(watch_measure(*args))

    watch_measure = watch.measure
    monkeypatch.setattr(watch, "measure", measure)

    @jax.jit
    def measured(camera, exposed, arm, key):
        with pytest.raises(Measured_) as told:
            watch.watch_image.__wrapped__(  # type: ignore[attr-defined]
                cell.voxels, SenseParams(), None, stage, None, camera, exposed, arm, key, cell.latency
            )
        return told.value.args[0]

    for tick in np.flatnonzero(which >= 0)[:3]:
        q = A + 0.01 * tick * (B - A)
        cameras.expose(int(tick), q)
        frame = cameras._sent.pop()
        ours = measured(jnp.asarray(which[tick]), images.exposed[tick], watch_arm(cell, q), images.key[tick])
        ours = np.asarray(ours).ravel()
        there = frame.depth > 0
        assert there.mean() > 0.5 and frame.stamp == pytest.approx(float(images.exposed[tick]))
        np.testing.assert_array_equal(ours[there], frame.depth[there].astype(ours.dtype))


def watch_arm(cell, q):
    from hrcjax.robot import arm_capsules

    return arm_capsules(cell.arm, jnp.asarray(q, SCENE.start.dtype))


def test_a_contact_made_on_purpose_is_counted_and_none_else() -> None:
    tool = np.asarray(tool_frame(CELL.arm, jnp.asarray((A + B) / 2, jnp.float32))[1], float)
    hit = measures_of(trace(swing(), ball(tool)), ENDS)
    assert hit.contacts == 4 and not hit.success and hit.min_separation < 0  # two periods: four passes
    assert hit.recall == 1.0
    free = measures_of(trace(swing(), ball(tool + np.array([0, 0, 0.6]))), ENDS)
    assert free.contacts == 0 and free.success and free.min_separation > 0
    assert free.legs == 4 and free.cycle_time == pytest.approx(2.5, rel=0.06)
    standing = measures_of(trace(np.tile((A + B) / 2, (200, 1)), ball(tool)), ENDS)
    assert standing.contacts == 0 and standing.contacts_standing == 1


def test_who_only_passes_a_waypoint_has_not_arrived() -> None:
    t = np.arange(1000) * 0.008
    through = ENDS[0] + np.outer(t / 4, 1.5 * (ENDS[1] - ENDS[0]))  # at 0.27 m/s and beyond
    assert arrivals(through, ENDS, 0.008) == []
    turns = ENDS[0] + np.outer(0.5 - 0.5 * np.cos(np.pi * t / 2), ENDS[1] - ENDS[0])
    found = arrivals(turns, ENDS, 0.008)
    assert len(found) == 4 and np.allclose(found, [2, 4, 6, 8], atol=0.15)
    assert arrivals(turns, ENDS[::-1], 0.008) == pytest.approx(
        [0.0, *found]
    )  # the other one is the first to be reached


def test_the_route_turns_without_a_step_in_acceleration() -> None:
    x = jnp.asarray(np.linspace(0, 1, 20)[:, None] * np.r_[0.3, 0.4, 0.0, np.zeros(12)], jnp.float32)
    route = Route(path_curve(x, x), jnp.zeros(20, jnp.float32), jnp.zeros((3, 3), jnp.float32))
    way = to_and_fro(route)
    leg = float(way.length) / LEGS
    assert leg == pytest.approx(np.pi / 2 * 0.5, rel=1e-3)
    s = np.linspace(0, 3 * leg, 301)
    closed = np.outer(0.5 - 0.5 * np.cos(np.pi * s / leg), [0.3, 0.4, 0.0])
    np.testing.assert_allclose(jax.vmap(way.curve.point)(jnp.asarray(s))[:, :3], closed, atol=2e-4)
    speed = np.linalg.norm(jax.vmap(way.curve.tangent)(jnp.asarray(s))[:, :3], axis=1)
    assert speed.max() < 1.005 and speed[100] < 0.01 and speed[200] < 0.01
    bend = np.asarray(
        jax.vmap(way.curve.curvature)(jnp.asarray([leg - 1e-3, leg + 1e-3, 2 * leg - 1e-3, 2 * leg + 1e-3]))
    )
    np.testing.assert_allclose(bend[0, :3], bend[1, :3], rtol=0.02)  # at the turn; the step there would be twice this
    np.testing.assert_allclose(bend[2, :3], -bend[0, :3], rtol=0.05)


def test_the_nearest_point_is_the_nearest_point() -> None:
    draw = np.random.default_rng(0)
    points, x = draw.normal(size=(50, 3)).astype(np.float32), draw.normal(size=3).astype(np.float32)
    points[7] = x  # masked, so it does not count
    mask = np.arange(50) != 7
    people = types.SimpleNamespace(field=types.SimpleNamespace(points=jnp.asarray(points), mask=jnp.asarray(mask)))
    d, offset = nearest_point(people, jnp.asarray(x))
    apart = np.linalg.norm(points[mask] - x, axis=1)
    assert float(d) == pytest.approx(apart.min(), rel=1e-5)
    np.testing.assert_allclose(x - np.asarray(offset), points[mask][apart.argmin()], atol=1e-5)
    nobody = types.SimpleNamespace(field=types.SimpleNamespace(points=jnp.asarray(points), mask=jnp.zeros(50, bool)))
    assert float(nearest_point(nobody, jnp.asarray(x))[0]) > 5 and not np.any(nearest_point(nobody, jnp.asarray(x))[1])


def test_without_the_safety_layer_nothing_is_limited_but_bad_data_hold() -> None:
    params = jax.tree.map(lambda v: jnp.asarray(v, jnp.float32), Params().safety)

    def seen(d: float, age: float = 0.05) -> Separation:
        ok = jnp.asarray(True)
        return Separation(jnp.full(4, d, jnp.float32), jnp.zeros(4, jnp.float32), jnp.asarray(age, jnp.float32), ok, ~ok, jnp.asarray(0.008, jnp.float32))  # fmt: skip

    start = UNGUARDED.start(jnp.float32)
    near = UNGUARDED.decide(params, start, seen(0.05))[1]
    assert float(near.point_limit.min()) == float(near.any_limit) == UNBOUNDED and not near.hold and int(near.zone) == 0
    assert near.aside is None and near.gain is None
    assert float(separation_monitor(params, start, seen(0.05))[1].point_limit.max()) <= 0
    for bad in (seen(float("nan")), seen(0.5, age=9.0)):
        held = UNGUARDED.decide(params, start, bad)[1]
        assert bool(held.hold) and float(held.point_limit.max()) == 0 and int(held.zone) == 3


def test_every_system_is_what_its_name_says() -> None:
    cells = {name: cell_of(name, CELL) for name in ("ours", "nearest", "path", "ours_free")}
    assert [cell.motion for cell in cells.values()] == ["both", "both", "path", "both"]
    assert cells["nearest"].field is not CELL.field and cells["nearest"].safety is CELL.safety
    assert cells["ours_free"].safety is UNGUARDED and cells["ours_free"].field is CELL.field
    assert tuple(EXPLAINED) == SYSTEMS


SOME = Measured(**dict.fromkeys(Measured._fields, 1.0))._replace(contacts=0, contacts_standing=0, success=True, legs=4)


def pair(name: str, ours: float, baseline: float, clean: bool = True, **changes: object) -> Pair:
    by = {"ours": SOME._replace(msj=ours, **changes), "baseline": SOME._replace(msj=baseline)}
    return Pair(name, clean, by)


def test_ratios_are_of_pairs() -> None:
    """Ratios 10, 10, 0.1: the median of pairs is 10, the ratio of medians is 1."""
    pairs = [pair("a 0", 1, 10), pair("b 0", 10, 100), pair("c 0", 100, 10)]
    rows = all_rows(pairs, ("ours", "baseline"))
    assert rows["msj_ratio"]["value"] == 10 and rows["msj_ours"]["value"] == 10 and rows["msj_baseline"]["value"] == 10
    assert rows["msj_ratio_low"]["value"] <= 10 <= rows["msj_ratio_high"]["value"]
    assert list(rows)[1:6] == list(BARS)


def test_rows_of_contacts_tell_clean_motions_from_those_that_jump() -> None:
    pairs = [pair("a 0", 1, 1, contacts=2), pair("b 0", 1, 1, clean=False, contacts=5)]
    rows = all_rows(pairs, ("ours", "baseline"))
    assert rows["contacts"]["value"] == 2 and rows["contacts_jumping_ours"]["value"] == 5
    assert holds("contacts", 2.0) is False and holds("contacts", 0.0) is True


def test_a_system_left_out_changes_the_rows() -> None:
    pairs = [pair("a 0", 1, 10)]
    assert "msj_ratio" in all_rows(pairs, ("ours", "baseline"))
    alone = all_rows([Pair("a 0", True, {"ours": pairs[0].by["ours"]})], ("ours",))
    assert not any(name.startswith("msj_ratio") or "baseline" in name for name in alone)
    more = [Pair("a 0", True, {**pairs[0].by, "ours_free": SOME._replace(msj=0.5)})]
    rows = all_rows(more, ("ours", "ours_free", "baseline"))
    assert rows["msj_ratio_free"]["value"] == 20 and rows["msj_ratio"]["value"] == 10
    assert all(definition(name, SYSTEMS) for name in rows)


def test_bars() -> None:
    assert (
        holds("msj_ratio", 5.0) is True
        and holds("msj_ratio", 4.9) is False
        and holds("msj_ratio", float("nan")) is False
    )
    assert holds("cycle_time_ratio", 1.01) is False and holds("clearance_difference", -0.001) is False
    assert holds("recall_ours", 0.1) is None
    assert np.isnan(interval(np.array([np.nan]))).all()


def test_the_measure_of_a_row_is_the_one_named() -> None:
    ours, base = (SOME._replace(cycle_time=c, min_separation=s, curvature=k) for c, s, k in ((4, 0.1, 1), (5, 0.3, 7)))
    rows = all_rows([Pair("a 0", True, {"ours": ours, "baseline": base})], ("ours", "baseline"))
    assert rows["cycle_time_ratio"]["value"] == pytest.approx(0.8)
    assert rows["clearance_difference"]["value"] == pytest.approx(-0.2)
    assert rows["curvature_ratio"]["value"] == 7


def test_options() -> None:
    assert parse([]) == HriConfig()
    quick = parse(["--quick"])
    assert quick.people == ("reach_in", "reach_and_stay") and quick.seeds == 1 and "baseline" in quick.systems
    assert parse(["--baseline.acceleration-scale", "0.2"]).baseline.acceleration_scale == 0.2
    for words in (["--systems", "theirs"], ["--people", "no_one"], ["--speed", "0"], ["--seeds", "0"]):
        with pytest.raises(UsageError):
            run_module._check(parse(words))


def test_the_program_keeps_runs_and_writes_rows_page_and_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made = []
    runs = {system: trace(swing(375), ball(np.array([-0.3, 0.9, 0.4])), shake) for system, shake in (("ours", 0.0), ("baseline", 0.002))}  # fmt: skip

    def fake(self: Bench, system: str, name: str, seed: int) -> Trace:
        made.append((system, name, seed))
        return runs[system]

    monkeypatch.setattr(Bench, "trace", fake)
    monkeypatch.setattr(run_module, "PARTS", {})
    monkeypatch.setattr(animation, "RATE", 2.0)  # a short film
    (tmp_path / "docs").mkdir()
    words = [
        "--systems",
        "ours",
        "baseline",
        "--people",
        "reach_in",
        "reach_and_stay",
        "--seeds",
        "1",
        "--seconds",
        "3",
    ]
    config = parse([*words, "--out", str(tmp_path / "run"), "--json", str(tmp_path / "rows.json"), "--page", str(tmp_path / "docs/hri.md")])  # fmt: skip
    assert run_module.run(replace(config, figures=False)) == 0 and len(made) == 4
    assert run_module.run(config) == 0 and len(made) == 4  # taken from the folder
    assert run_module.run(replace(config, people=("reach_in", "nobody"), figures=False)) == 0 and len(made) == 6
    assert run_module.run(replace(config, seeds=2, finished=True, figures=False)) == 0 and len(made) == 6
    capsys.readouterr()
    rows = json.loads((tmp_path / "rows.json").read_text())["hri"]
    assert (
        rows["pairs"]["value"] == 2
        and rows["msj_si_ratio"]["value"] > 2
        and rows["cycle_time_ratio"]["value"] == pytest.approx(1, abs=0.05)
    )
    text = (tmp_path / "docs/hri.md").read_text()
    assert "| msj_ratio |" in text and "(missed)" in text and "| reach_in 0 |" in text
    for name in ("trajectories.png", "measures.png", "trade.png", "pair.gif"):
        assert (tmp_path / "run/figures" / name).stat().st_size > 1000
        assert f"figures/hri-{name}" in text or (tmp_path / "docs/figures" / f"hri-{name}").exists()


def test_a_run_comes_back_as_it_was_stored() -> None:
    one = trace(swing(50), ball(np.array([-0.3, 0.9, 0.4])))
    back = trace_of({key: np.asarray(value) for key, value in kept(one).items()})
    for f in fields(Trace):
        if f.name not in ("events", "seconds"):
            np.testing.assert_array_equal(getattr(back, f.name), getattr(one, f.name))


def test_the_page_of_nothing_says_so() -> None:
    assert "No pair is finished" in page({"pairs": row(0)}, [], HriConfig())
