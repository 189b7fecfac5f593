"""The program that tunes, on functions in place of episodes: what it finds, that it resumes to the same numbers, and messages."""

import importlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

pytest.importorskip("optax")
pytest.importorskip("orbax.checkpoint")

from experiments.tune import optimiser
from experiments.tune import run as program
from experiments.tune.config import TuneConfig, parse
from experiments.tune.judge import Judge, comparison, interval
from experiments.tune.live import LiveTable
from experiments.tune.loop import Tuner
from experiments.tune.optimiser import Checkpoints
from experiments.tune.overlap import digests, not_new
from experiments.tune.problem import Problem, named_cell, world_names
from experiments.tune.report import felt_text
from experiments.tune.slices import most_felt
from hrcjax.lab.errors import UsageError
from hrcjax.numerics import compiler
from hrcjax.tune import LOSSES, choose
from hrcjax.tune.tuned import read_training, read_tuned

OPTIMUM = {"potential.k_att": 0.08, "potential.zeta": 3.5}
CONFIG = TuneConfig(
    params=("K_att=0.01:0.2", "zeta=1.2:5"), loss=("sound=1",), people=("reach_in",), seeds=(0, 1, 2), held_out_seeds=(7, 8),
    steps=6, batch=2, starts=3, every=2, figures=False,
)  # fmt: skip


def build(config: TuneConfig, named) -> Problem:
    """Every world pulls two parameters to a point of its own about the optimum; a third start of one parameter is not finite."""
    chosen = choose(config.params, named.params, named.known_aliases(), named.known_domains(), config.frozen)
    train, held = world_names(config)

    def terms(params, world):
        pulls = [jnp.log(params.potential.k_att / (0.08 * world[0])), jnp.log(params.potential.zeta / (3.5 * world[1]))]
        return jnp.stack([pulls[0] ** 2 + pulls[1] ** 2])

    def measure(params, world):
        return {"loss": terms(params, world)[0]}

    def world(seed):
        tilt = np.random.default_rng(seed % 3).normal(0, 0.02, 2)
        return np.exp(np.where(seed < 3, 1.0, -1.0) * tilt)

    return Problem(
        base=named.params, chosen=chosen, losses=(LOSSES["sound"],), weights=(1.0,), terms=terms, measure=measure,
        units={"loss": ("1", "low")}, training={f"{n}": world(n[2]) for n in train}, held_out={f"{n}": world(n[2]) for n in held},
    )  # fmt: skip


def history(folder: Path, config: TuneConfig):
    """State and history on disk."""
    tuner = Tuner(build(config, named_cell(config)), config)
    kept = Checkpoints(folder / "cases" / "steps")
    found = kept.newest(tuner.start)
    kept.close()
    assert found is not None
    return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    assert program.run(replace(CONFIG, out=folder / "run"), build) == 0
    return folder / "run"


def test_resumed_run_has_the_same_numbers(whole: Path, tmp_path: Path, capsys, monkeypatch) -> None:
    """Three steps, continued, killed in the sixth step, and continued from the last checkpoint."""
    config = replace(CONFIG, out=tmp_path / "run")
    program.run(replace(config, steps=3), build)
    step = Tuner.step

    def killed(self, state):
        if int(state.step) == 5:
            raise KeyboardInterrupt
        return step(self, state)

    monkeypatch.setattr(Tuner, "step", killed)
    with pytest.raises(KeyboardInterrupt):
        program.run(config, build)
    assert "goes on after step 3" in capsys.readouterr().err
    monkeypatch.undo()
    program.run(config, build)
    assert "goes on after step 4" in capsys.readouterr().err
    one, other = history(whole, CONFIG), history(tmp_path / "run", CONFIG)
    assert one[1]["loss"].shape == (6, 3) and one[1]["values"].shape == (6, 3, 2)
    for name, array in one[1].items():
        np.testing.assert_array_equal(array, other[1][name], err_msg=name)
    for field in ("vector", "best", "best_loss", "step", "skipped"):
        np.testing.assert_array_equal(getattr(one[0], field), getattr(other[0], field))
    assert (whole / "tuned.toml").read_text().split("[parameters]")[1] == (tmp_path / "run/tuned.toml").read_text().split("[parameters]")[1]  # fmt: skip


def test_a_damaged_checkpoint_falls_back_to_the_one_before(whole: Path, tmp_path: Path) -> None:
    config = replace(CONFIG, out=tmp_path / "run")
    program.run(replace(config, steps=4), build)
    newest = tmp_path / "run/cases/steps/4"
    for file in [path for path in newest.rglob("*") if path.is_file()]:
        file.write_bytes(b"")
    program.run(config, build)
    np.testing.assert_array_equal(history(whole, CONFIG)[1]["loss"], history(tmp_path / "run", CONFIG)[1]["loss"])


def test_finds_the_optimum_and_tells_it(tmp_path: Path, capsys) -> None:
    config = replace(
        CONFIG, steps=150, batch=3, every=50, out=tmp_path / "run", json=tmp_path / "rows.json", figures=True
    )
    assert program.run(config, build) == 0
    said = capsys.readouterr().out
    assert "potential.zeta" in said and "held out" in said and "95 %" in said
    assert [line.split()[0] for line in said.split("|gradient|")[1].splitlines()[1:4]] == ["50", "100", "150"]
    assert said.count("|gradient|") == 1, "one header"
    values = tomllib.loads((tmp_path / "run/tuned.toml").read_text())["parameters"]
    tilts = np.mean([np.random.default_rng(k).normal(0, 0.02, 2) for k in range(3)], axis=0)
    expected = {name: x * np.exp(t) for (name, x), t in zip(OPTIMUM.items(), tilts, strict=True)}
    assert values == pytest.approx(expected, rel=2e-3)
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert rows["tune"]["steps"]["value"] == 150
    for section in ("tune_training", "tune_held_out"):
        row = {name: entry["value"] for name, entry in rows[section].items()}
        assert row["loss after"] < 0.01 < row["loss before"]
        assert row["loss low"] <= row["loss change"] <= row["loss high"] < 0
    drawn = {path.name for path in (tmp_path / "run/figures").iterdir()}
    assert drawn == {"losses.png", "parameters.png", "gradients.png", "before_after.png", "slices.png", "map.png"}
    assert "Loss along each parameter alone" in said
    slices_lie_about(tmp_path / "run", expected)

    after = replace(CONFIG, steps=0, out=tmp_path / "next", start_from=str(tmp_path / "run"))
    assert program.run(after, build) == 0
    assert read_tuned(tmp_path / "next", "--from") == pytest.approx(values, rel=1e-6)


SLOW_RUN = """
import sys, time
from dataclasses import replace
from pathlib import Path
sys.path[:0] = {paths!r}
from hrcjax.numerics import compiler
compiler.LLVM_LEVEL = {level}
from test_tune_program import CONFIG, Tuner, build, program
step = Tuner.step
def slow(self, state):
    time.sleep(0.3)
    return step(self, state)
Tuner.step = slow
program.run(replace(CONFIG, out=Path({out!r})), build)
"""
"""A run in another process, slowed down so that there are moments between its steps."""


def test_killed_at_any_moment_it_resumes_to_the_same_numbers(whole: Path, tmp_path: Path, capsys) -> None:
    """SIGKILL at a random moment after the first checkpoint; until then nobody else may write to the folder."""
    here = Path(__file__)
    code = SLOW_RUN.format(
        paths=[str(here.parents[2]), str(here.parent)], out=str(tmp_path / "run"), level=compiler.LLVM_LEVEL
    )
    wait = random.SystemRandom().uniform(0.0, 1.2)
    run = [sys.executable, "-c", code]
    env = {**os.environ, "JAX_ENABLE_X64": "1"}  # as here
    with subprocess.Popen(run, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as child:
        end = time.monotonic() + 120
        while (
            not list((tmp_path / "run/cases").glob("steps/[0-9]*")) and child.poll() is None and time.monotonic() < end
        ):
            time.sleep(0.02)
        with pytest.raises(UsageError, match=r"^another process writes to .*; wait for it or give another --out$"):
            program.run(replace(CONFIG, out=tmp_path / "run"), build)
        time.sleep(wait)
        child.kill()
    assert child.returncode == -signal.SIGKILL, "it was still running"
    program.run(replace(CONFIG, out=tmp_path / "run"), build)
    assert "goes on after step" in capsys.readouterr().err
    one, other = history(whole, CONFIG), history(tmp_path / "run", CONFIG)
    for name, array in one[1].items():
        np.testing.assert_array_equal(array, other[1][name], err_msg=f"{name}, killed {wait:.3f} s after a checkpoint")
    np.testing.assert_array_equal(one[0].vector, other[0].vector)
    assert (whole / "tuned.toml").read_text().split("[parameters]")[1] == (tmp_path / "run/tuned.toml").read_text().split("[parameters]")[1]  # fmt: skip


def test_fewer_steps_than_there_are_is_said(whole: Path, tmp_path: Path, capsys) -> None:
    shutil.copytree(whole, tmp_path / "run")
    program.run(replace(CONFIG, steps=2, out=tmp_path / "run"), build)
    said = capsys.readouterr()
    assert "goes on after step 6: more than --steps 2, and all of them count; no step is left" in said.err
    assert "|gradient|" not in said.out, "no table of no steps"


def test_the_table_has_aligned_rows(whole: Path) -> None:
    kept = history(whole, CONFIG)[1]
    table = LiveTable(tuple(OPTIMUM), ("sound",), CONFIG.starts)
    assert table.header.split() == ["step", "start", "loss", "sound", "|gradient|", "k_att", "zeta"]
    for step in (2, 4, 6):
        upto = {name: array[:step] for name, array in kept.items()}
        row, k = table.row(step, upto, 0), int(np.argmin(kept["loss"][step - 1]))
        assert len(row) == len(table.header) and row.split()[:2] == [str(step), str(k)]
        newest = {name: array[-1][k] for name, array in upto.items()}
        expected = [newest["loss"], *newest["terms"], np.linalg.norm(newest["gradient"]), *newest["values"]]
        assert [float(x) for x in row.split()[2:]] == pytest.approx(expected, rel=1e-3)
    broken = {name: np.full_like(array, np.nan) if array.dtype.kind == "f" else array for name, array in kept.items()}
    assert table.row(6, broken, 3).endswith("  3 not finite") and len(table.row(6, broken, 0)) == len(table.header)
    assert "start" not in LiveTable(tuple(OPTIMUM), ("sound",), 1).header


def test_worlds_that_are_not_new_are_named(tmp_path: Path, capsys) -> None:
    """Held out, seed 7 is another world than those of the training, and 8 one of them by another name."""

    def repeated(config, named) -> Problem:
        made = build(config, named)
        names = list(made.held_out)
        return replace(made, held_out={names[0]: made.held_out[names[0]], names[1]: next(iter(made.training.values()))})

    one = replace(CONFIG, steps=1, starts=1, out=tmp_path / "run")
    program.run(one, repeated)
    said = capsys.readouterr().err
    assert "held out, not wholly new: ('robotica', 'reach_in', 8) (world as in training: only noise differs)" in said
    after = replace(one, seeds=(7,), held_out_seeds=(1, 5), start_from=str(tmp_path / "run"), out=tmp_path / "next")
    program.run(after, build)
    said = capsys.readouterr().err
    assert "('robotica', 'reach_in', 1) (trained in by --from)" in said and "reach_in', 5" not in said
    assert list(read_training(tmp_path / "next", "")) == [f"('robotica', 'reach_in', {k})" for k in (0, 1, 2, 7)]


def test_parts_of_worlds_are_compared_by_their_arrays() -> None:
    scene, other, person = np.arange(3.0), np.arange(3.0) + 1, {"a": np.zeros((2, 3)), "b": np.ones(2)}
    worlds = {
        "a": (scene, person),
        "b": (scene.copy(), {"a": np.ones((2, 3)), "b": np.ones(2)}),
        "c": (other, person),
        "d": (other, {}),
    }
    seen = {name: digests(dict(zip(("scene", "people"), parts, strict=True))) for name, parts in worlds.items()}
    held = {name: seen[name] for name in "bcd"} | {"e": seen["a"]}
    assert not_new(held, {"a": seen["a"]}, {}) == (
        "b (scene as in training); c (people as in training); e (scene and people as in training: only noise differs)"
    )
    assert not_new(held, {"x": seen["c"]}, {"d": seen["d"]}).startswith("c (scene and people as in training")
    assert not_new({"d": seen["d"]}, {}, {}) == ""


def slices_lie_about(folder: Path, optimum: dict[str, float]) -> None:
    """The least point of every slice, and of the map, is the optimum that is known; the loss there is the sum of squares."""
    with np.load(folder / "cases/slices.npz") as found:
        values, loss, sides, over = (found[name] for name in ("values", "loss", "sides", "map_loss"))
        start, pair = found["start"], found["pair"]
    begun = named_cell(CONFIG).params.potential
    np.testing.assert_allclose(start, [begun.k_att, begun.zeta], rtol=1e-5)
    for n, name in enumerate(OPTIMUM):
        assert np.argmin(loss[n]) == 5 and values[n, 5] == pytest.approx(optimum[name], rel=2e-3)
        assert values[n, 0] < start[n] < values[n, -1] and (np.diff(values[n]) > 0).all()
        away = np.log(values[n] / optimum[name]) ** 2
        np.testing.assert_allclose(loss[n] - loss[n, 5], away - away[5], atol=1e-5)
    np.testing.assert_array_equal(pair, np.argsort(-np.ptp(loss, axis=1)))
    assert np.unravel_index(np.argmin(over), over.shape) == (4, 4) and over[4, 4] == pytest.approx(loss[0, 5])
    names = list(OPTIMUM)
    first, second = (np.log(sides[k] / optimum[names[pair[k]]]) ** 2 for k in range(2))
    np.testing.assert_allclose(over - over[4, 4], first[:, None] + second, atol=1e-5)


def test_slices_are_of_few_parameters_and_kept(tmp_path: Path, monkeypatch) -> None:
    """None for more parameters than --slices; a second run measures nothing again."""
    config = replace(CONFIG, steps=1, starts=1, figures=True, out=tmp_path / "run")
    program.run(replace(config, slices=1), build)
    assert not (tmp_path / "run/cases/slices.npz").exists()
    program.run(config, build)
    monkeypatch.setattr(Judge, "_measure", property(lambda self: pytest.fail("measured again")))
    program.run(config, build)


def test_the_slices_that_matter_come_first() -> None:
    loss = np.array([[1.0, 1.1, 1.0], [np.nan, 2.0, 5.0], [np.nan, np.nan, np.nan], [1.0, 2.0, 1.0]])
    assert most_felt(loss).tolist() == [1, 3] and most_felt(loss[:1]).tolist() == [0, 0]


def test_not_finite_is_counted_and_said(tmp_path: Path, capsys) -> None:
    def broken(config, named) -> Problem:
        made = build(config, named)
        return replace(made, terms=lambda p, w: made.terms(p, w) + jnp.where(p.potential.zeta < 4.5, jnp.nan, 0.0))

    config = replace(CONFIG, starts=1, out=tmp_path / "run")
    assert program.run(config, broken) == 3
    said = capsys.readouterr()
    assert "6 of 6 gradients were not finite" in said.err and "the loss is not finite here: no step" in said.out
    start = named_cell(CONFIG).params.potential
    found = read_tuned(tmp_path / "run", "--from")
    assert found == pytest.approx({"potential.k_att": start.k_att, "potential.zeta": start.zeta}, rel=1e-5)


def test_what_is_not_felt_is_said() -> None:
    config = replace(CONFIG, params=("K_att=0.01:0.2", "zeta=1.2:5", "motion.speed"), starts=1)
    made = build(config, named_cell(config))
    assert "does not feel motion.speed (" in felt_text(Tuner(made, config).feel(), made)

    def product(params, world):
        return (params.potential.k_att * params.potential.zeta - 0.2)[None] ** 2 + 1

    both = replace(CONFIG, params=("potential.k_att=1e-4:1e0", "zeta=1.0:10"), starts=1)
    alike = replace(build(both, named_cell(both)), terms=product)
    said = felt_text(Tuner(alike, both).feel(), alike)
    assert "does not feel" not in said


def test_another_run_in_the_folder_is_refused_or_replaced(tmp_path: Path) -> None:
    config = replace(CONFIG, steps=1, starts=1, out=tmp_path / "run")
    program.run(config, build)
    with pytest.raises(UsageError, match="another --out, or --overwrite"):
        program.run(replace(config, rate=0.3), build)
    program.run(replace(config, rate=0.3, overwrite=True), build)
    assert int(history(tmp_path / "run", replace(config, rate=0.3))[0].step) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"steps": -1}, "--steps -1"),
        ({"rate": 0.0}, "--rate 0"),
        ({"seeds": (0, 0)}, "--seeds: a value is given twice"),
        ({"held_out_seeds": (0,)}, "in training and held out"),
        ({"seeds": ()}, "no world to train in"),
        ({"people": ("nobdy",)}, "nobdy"),
        ({"loss": ("soud",)}, "no loss 'soud'"),
        ({"params": ("K_at",)}, "unknown parameter"),
        ({"start_from": "nowhere"}, "--from nowhere"),
    ],
)
def test_messages(change, message, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=message):
        program.run(replace(CONFIG, out=tmp_path / "run", **change), build)


def test_a_missing_package_names_the_extra(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "optax", None)
    with pytest.raises(UsageError, match=r"pip install 'hrcjax\[tune\]'"):
        importlib.reload(optimiser)


def test_options() -> None:
    config = parse(["--params", "zeta", "--from", "runs/other", "--quick"])
    assert config.params == ("zeta",) and config.start_from == "runs/other"
    assert (config.steps, config.batch, config.starts, len(config.people)) == (3, 1, 1, 1)
    with pytest.raises(UsageError, match="close: --params"):
        parse(["--param", "zeta"])


def test_interval_holds_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    inside = [low < 0.5 < high for low, high in (interval(rng.normal(0.5, 1, 30), k) for k in range(200))]
    assert 0.88 < np.mean(inside) < 0.99
    assert np.isnan(interval(np.array([1.0]), 0)).all()
    rows = comparison({"a": np.array([[1.0, np.nan, 3.0], [2.0, 5.0, 4.0]])}, {"a": ("m", "low")}, 0)
    assert rows["a before"]["value"] == 2 and rows["a after"]["value"] == 3, "of worlds in which both are known"
    assert rows["a change"]["value"] == 1 and rows["a low"]["value"] == rows["a high"]["value"] == 1
