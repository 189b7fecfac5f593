"""The program: what it writes, how it resumes, and how it fails."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
import toy_cell
import xarray as xr

from experiments.sweep.__main__ import main
from hrcjax.lab import atomic
from hrcjax.sweeps import store
from hrcjax.sweeps.store import open_run
from hrcjax.tune.tuned import write_tuned

TOY = Path(__file__).parents[1] / "helpers" / "toy_sweep.py"
SMALL = ["--grid", "K_att=log:0.01:0.1:4", "K_rep=lin:0.1:1:3", "zeta=2,4", "--memory", "0.5", "--no-figures"]


@pytest.fixture(autouse=True)
def toy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The toy cell in place of the real one, in an empty folder."""
    monkeypatch.setitem(sys.modules, "hrcjax.cells.problem", toy_cell)
    monkeypatch.setattr("experiments.sweep.run.LOADED_CODE", "toy")  # somebody may edit the package meanwhile
    monkeypatch.chdir(tmp_path)


def run(*arguments: str) -> int:
    return main([*SMALL, *arguments])


def same(a: xr.Dataset, b: xr.Dataset) -> None:
    assert list(a.variables) == list(b.variables)
    for name in a.variables:
        np.testing.assert_array_equal(a[name].values, b[name].values, err_msg=str(name))


def test_results_are_labelled_and_self_explaining(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--scene", "robotica", "hri", "--seed", "0", "3", "--out", "r") == 0
    with open_run(tmp_path / "r") as ds:
        assert ds.score.dims == ("scene", "person", "seed", "k_att", "k_rep", "zeta")
        assert ds.score.shape == (2, 1, 2, 4, 3, 2)
        assert ds.tool.dims[-2:] == ("time", "xyz")
        assert ds.zeta.values.tolist() == [2.0, 4.0] and ds.seed.values.tolist() == [0, 3]
        assert ds.k_att.attrs["parameter"] == "potential.k_att" and ds.k_att.attrs["scale"] == "log"
        assert (ds.length.attrs["units"], ds.length.attrs["better"]) == ("m", "low")
        assert all("units" in ds[name].attrs and "long_name" in ds[name].attrs for name in ds.data_vars)
        assert ds.zone.dtype == np.int8 and ds.score.dtype == np.float32
        assert json.loads(ds.attrs["versions"])["jax"] and ds.attrs["commit"]
        assert json.loads(ds.attrs["config"])["scene"] == ["robotica", "hri"]
        assert float(ds.status.attrs["long_name"].count("collision")) == 1
        # a cell of the array is the result of its labels: brute force on one of them
        params = toy_cell.ToyParams()
        place = dict(k_att=ds.k_att[1].item(), k_rep=ds.k_rep[2].item(), zeta=4.0)
        potential = toy_cell.Potential(**{k: np.full(1, v, np.float32) for k, v in place.items()})
        params = toy_cell.ToyParams(potential, params.collision, params.field)
        world = toy_cell.build_problem(("hri",), ("reach_in",), (3,), "folded").worlds[0][1]()
        alone = toy_cell.evaluate(params, world)["score"][0]
        np.testing.assert_allclose(ds.score.sel(scene="hri", person="reach_in", seed=3, **place), alone, rtol=1e-5)
    printed = capsys.readouterr()
    assert "Best settings (highest score, means over all worlds; failed settings last):" in printed.out
    assert "settings/s" in printed.out and "r/results.nc" in printed.out
    assert "24 settings in 4 worlds" in printed.err


def test_analysis_of_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its numbers are those of the results; other sections of the file stay."""
    assert run("--out", "r") == 0
    (tmp_path / "a.json").write_text('{"arm": {"rate": {"value": 1, "unit": "1/s"}}}')
    capsys.readouterr()
    assert main(["--analyse", "r", "--json", "a.json"]) == 0
    found = json.loads((tmp_path / "a.json").read_text())
    assert list(found) == ["arm", "sweep_analysis"]
    rows = found["sweep_analysis"]
    assert all(set(row) == {"value", "unit"} for row in rows.values())
    with open_run(tmp_path / "r") as ds:
        assert rows["success_share"]["value"] == float((ds.status == 0).mean())
        spread = ds.length.where(ds.status == 0)
        along = spread.max("k_rep") - spread.min("k_rep")
        expected = float(along.where((ds.status == 0).sum("k_rep") > 1).median() / (spread.max() - spread.min()))
    assert rows["line_range_K_rep_length"]["value"] == pytest.approx(expected, rel=1e-5)
    assert rows["line_range_K_rep_length"]["value"] > 0.5 > rows["line_range_k_att_length"]["value"]
    printed = capsys.readouterr().out
    assert "success_share" in printed and "sobol_total_K_rep" in printed and "bending_energy" in printed
    assert {file.stem for file in (tmp_path / "r" / "figures").iterdir()} == {"knobs", "sensitivity", "line-ranges"}
    assert main(["--analyse", "r", "--by", "length", "--no-figures"]) == 0
    assert main(["--analyse", "r", "--by", "beauty"]) == 2
    assert "beauty: no such metric; accepted: score, length" in capsys.readouterr().err


def test_analysis_of_a_sample_says_what_is_missing(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--grid", "k_att=log:0.01:0.1", "zeta=lin:2:4", "--sobol", "6", "--no-figures"]
    assert main([*options, "--out", "r"]) == 0
    capsys.readouterr()
    assert main(["--analyse", "r", "--no-figures"]) == 0
    printed = capsys.readouterr()
    assert "distinct_share" in printed.out and "sobol" not in printed.out
    assert printed.err == "line ranges and Sobol indices need a full grid, without --sobol\n"


def test_config_file_is_enough_to_repeat_the_run(tmp_path: Path) -> None:
    assert run("--out", "r") == 0
    record = json.loads((tmp_path / "r" / "config.json").read_text())
    assert record["config"]["grid"][0] == "K_att=log:0.01:0.1:4"
    assert record["identity"]["params"]["field.speed"] == 0.5
    assert {"commit", "created", "command", "versions"} <= set(record["provenance"])
    assert len(record["fingerprint"]) == 64


def test_samples(tmp_path: Path) -> None:
    options = ["--grid", "k_att=log:0.01:0.1", "field.length_scale=lin:0.1:0.3", "--sobol", "6", "--no-figures"]
    assert main([*options, "--out", "r"]) == 0
    with open_run(tmp_path / "r") as ds:
        assert ds.score.dims == ("scene", "person", "seed", "sample") and ds.sizes["sample"] == 6
        assert ds.k_att.dims == ("sample",) and ds.field_length_scale.attrs["parameter"] == "field.length_scale"


def test_the_same_command_finds_its_folder_and_does_nothing_twice(tmp_path: Path) -> None:
    assert run() == 0
    folders = list((tmp_path / "runs").iterdir())
    assert len(folders) == 1 and folders[0].name.startswith("sweep-robotica-reach_in-")
    toy_cell.BUILT.clear()
    assert run() == 0
    assert toy_cell.BUILT == [] and list((tmp_path / "runs").iterdir()) == folders
    assert run("--seed", "1") == 0
    assert len(list((tmp_path / "runs").iterdir())) == 2


def test_what_does_not_change_numbers_does_not_change_the_folder(tmp_path: Path) -> None:
    assert run() == 0
    assert run("--best", "2", "--by", "length") == 0
    assert len(list((tmp_path / "runs").iterdir())) == 1


def test_missing_results_are_assembled_again(tmp_path: Path) -> None:
    assert run("--out", "r") == 0
    with open_run("r") as before:
        before.load()
    (tmp_path / "r" / "results.nc").write_bytes(b"rubbish")
    toy_cell.BUILT.clear()
    assert run("--out", "r") == 0
    assert toy_cell.BUILT == []
    with open_run("r") as after:
        same(before, after)


def test_damaged_chunk_is_computed_again(tmp_path: Path) -> None:
    assert run("--out", "r") == 0
    with open_run("r") as before:
        before.load()
    chunk = tmp_path / "r" / "chunks" / "world-000-chunk-00001.h5"
    chunk.write_bytes(chunk.read_bytes()[:-100])
    assert run("--out", "r") == 0
    with open_run("r") as after:
        same(before, after)


@pytest.mark.slow
@pytest.mark.parametrize("after", [1, 4])
def test_killed_run_resumes_to_the_same_numbers(tmp_path: Path, after: int) -> None:
    options = [*SMALL, "--out", str(tmp_path / "r")]
    slow = {**os.environ, "TOY_DELAY": "0.2", "JAX_PLATFORMS": "cpu"}
    process = subprocess.Popen(
        [sys.executable, str(TOY), *options], env=slow, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    chunks = tmp_path / "r" / "chunks"
    begin = time.monotonic()
    while len(list(chunks.glob("world-000-chunk-*.h5"))) < after:
        assert time.monotonic() - begin < 120 and process.poll() is None
        time.sleep(0.005)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    left = len(list(chunks.glob("world-000-chunk-*.h5")))
    assert after <= left < 5 and not (tmp_path / "r" / "results.nc").exists()
    for seconds, folder in (("0", "r"), ("0", "whole")):
        environment = {**slow, "TOY_DELAY": seconds}
        command = [sys.executable, str(TOY), *SMALL, "--out", str(tmp_path / folder)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert ("are finished already" in done.stderr) == (folder == "r")
    with open_run(tmp_path / "r") as resumed, open_run(tmp_path / "whole") as whole:
        same(resumed, whole)


def test_full_disk_is_one_line_and_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    written = []
    write = atomic.write_bytes

    def until_full(path: Path, data: bytes) -> None:
        if len(written) == 4:
            with atomic.storage_errors(path):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written.append(path)
        write(path, data)

    with monkeypatch.context() as patch:
        patch.setattr(store, "write_bytes", until_full)
        assert run("--out", "r") == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("error: cannot write r/chunks/world-000-chunk-") and "No space left on device" in error
    assert len(list((tmp_path / "r" / "chunks").glob("*chunk-*.h5"))) == 2
    assert run("--out", "r") == 0
    assert "of 24 settings are finished already" in capsys.readouterr().err


def test_full_disk_at_the_end_keeps_the_chunks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise RuntimeError("Unable to flush file's cached information\n(errno = 28, 'No space left on device')")

    with monkeypatch.context() as patch:
        patch.setattr("hrcjax.sweeps.dataset.write_rows", full)
        assert run("--out", "r") == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert "cannot write r/results.nc" in error and "No space left" in error
    assert not list((tmp_path / "r").glob(".tmp*"))
    toy_cell.BUILT.clear()
    assert run("--out", "r") == 0
    assert toy_cell.BUILT == []


def test_other_run_in_the_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--out", "r") == 0
    assert run("--out", "r", "--seed", "5") == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert "seed is [0] there, [5] here" in error and "--overwrite" in error
    assert run("--out", "r", "--seed", "5", "--overwrite") == 0
    with open_run("r") as ds:
        assert ds.seed.values.tolist() == [5]


def test_results_that_are_not_finite_end_with_a_warning_and_status_3(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    build = toy_cell.build_problem

    def broken(*arguments: object) -> object:
        cell = build(*arguments)  # pyright: ignore[reportArgumentType]
        evaluate = cell.evaluate

        def spoil(p, w):
            return {
                **(out := evaluate(p, w)),
                "score": jnp.where(p.potential.zeta > 3, out["score"], jnp.inf),
            }

        return type(cell)(**{**vars(cell), "evaluate": spoil})

    monkeypatch.setattr(toy_cell, "build_problem", broken)
    assert run("--out", "r") == 3
    printed = capsys.readouterr()
    assert "warning: 12 of 24 results are not finite" in printed.err
    with open_run("r") as ds:
        assert (ds.status.sel(zeta=2) == -1).all() and (ds.status.sel(zeta=4) == 0).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--grid", "k_at=1"], "unknown parameter 'k_at'; close: k_att"),
        (["--grid", "zeta=0.5"], "potential.zeta = 0.5 is outside its domain [1, inf]"),
        (["--grid", "k_att=log:0:1:3"], "a log range must start above 0"),
        (["--scene", "mars"], "no scene 'mars'; accepted: robotica, hri"),
        (["--person", "none.bvh"], "none.bvh: no such BVH file"),
        (["--config", "fast"], "no config 'fast'; accepted: paper, people, quick"),
        (["--config=fast"], "no config 'fast'"),
        (["--by", "beauty"], "--by beauty: no such metric; accepted: score, length"),
        (["--seed", "-1"], "--seed -1: accepted is 0 to 4294967295"),
        (["--seed", "4294967296"], "--seed 4294967296: accepted is 0"),
        (["--seed", "1", "1"], "--seed: a value is given twice"),
        (["--seed", "x"], "--seed"),
        (["--best", "2", "--best", "3"], "--best is given twice; give all its values after one --best"),
        (["--scene"], "--scene is empty"),
        (["--memory", "0"], "--memory 0: accepted is"),
        (["--memory", "nan"], "--memory nan: accepted is"),
        (["--memory", "0.01"], "one setting needs about 0.1 MB"),
        (["--json", "a.json"], "--json needs --analyse RUN"),
        (["--analyse", "others"], "others holds no run"),
        (["--analyse", "others", "--json", "none/a.json"], "no folder none for --json"),
        (["--best", "0"], "--best 0: accepted is 1 or more"),
        (["--backend", "bullet"], "invalid choice 'bullet'"),
        (["--sobol", "4"], "a sample needs"),
        (["--sed", "1"], "Unrecognized options: --sed, 1; close: --seed; --help shows all"),
        (["--out", "file"], "file is a file, not a folder"),
        (["--out", "others"], "others holds other files"),
        (["--out", "file/below"], "cannot write to file/below"),
    ],
)
def test_mistakes_get_one_line_and_leave_nothing(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "others").mkdir()
    (tmp_path / "others" / "thesis.tex").write_text("mine")
    base = [] if "--grid" in options else SMALL[:4] if "--memory" in options else SMALL
    status = main([*base, *options])
    printed = capsys.readouterr().err
    errors = [line for line in printed.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1 and message in errors[0] and printed.splitlines()[-1] == errors[0]
    assert "Traceback" not in printed
    assert status == 2
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "others", "thesis.tex"]


def test_a_cell_without_the_default_parameters_asks_for_a_grid(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    problem = toy_cell.build_problem(("robotica",), ("reach_in",), (0,))
    monkeypatch.setattr(
        "experiments.sweep.run._build", lambda config: replace(problem, aliases={}, params={"gain": 1.0})
    )
    assert main(["--out", "q"]) == 2
    said = capsys.readouterr().err
    assert "lacks a parameter that is swept by default" in said and "--grid gain=lin:LOW:HIGH:COUNT" in said


def test_quick_is_small(tmp_path: Path) -> None:
    assert main(["--quick", "--no-figures", "--out", "q"]) == 0
    assert main(["--config", "quick", "--no-figures", "--out", "q"]) == 0  # the same run
    with open_run("q") as ds:
        assert ds.score.shape == (1, 1, 1, 4, 4, 2)


def test_list_and_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["parameter", "default", "unit", "domain", "alias", "meaning"]
    assert lines[1].split()[:2] == ["potential.k_att", "0.03"] and "k_att" in lines[1].split()[3:]
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert shown.count("python -m experiments.sweep --") == 9
    for option in ("--scene", "--person", "--seed", "--out", "--quick", "--grid", "--sobol"):
        assert option in shown


def test_interrupt_says_how_to_go_on(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("experiments.sweep.run.run_sweep", stop)
    assert run("--out", "r") == 130
    assert "the same command resumes" in capsys.readouterr().err


def test_identity_changes_with_everything_that_decides_numbers(tmp_path: Path) -> None:
    from dataclasses import replace

    from experiments.sweep.config import SweepConfig
    from experiments.sweep.run import identity
    from hrcjax.sweeps.settings import make_settings

    bvh = tmp_path / "a.bvh"
    bvh.write_text("one")
    base = SweepConfig(person=(str(bvh),), grid=("zeta=lin:2:4:3",))

    def mark(config: SweepConfig, chunk: int = 3, **params: float) -> str:
        problem = toy_cell.build_problem(("hri",), (str(bvh),), (0,), "folded")
        settings = make_settings(
            config.grid, problem.params, samples=config.sobol, sample_seed=config.sobol_seed, quick=config.quick
        )
        changed = type(problem)(**{**vars(problem), "params": toy_cell.ToyParams(toy_cell.Potential(**params))})
        return json.dumps(identity(config, changed, settings, chunk))

    marks = [
        mark(base),
        mark(base, chunk=2),
        mark(base, k_att=0.04),
        mark(replace(base, scene=("hri",))),
        mark(replace(base, person=("reach_in",))),
        mark(replace(base, seed=(1,))),
        mark(replace(base, quick=True, grid=("zeta=2,4",))),
        mark(replace(base, grid=("zeta=2,4",))),
        mark(replace(base, backend="mjx")),
        mark(replace(base, sobol=4)),
        mark(replace(base, sobol=4, sobol_seed=1)),
        mark(replace(base, sobol=5)),
    ]
    bvh.write_text("two")
    marks.append(mark(base))
    assert len(set(marks)) == len(marks)
    assert mark(replace(base, out=tmp_path, best=9, by="length", figures=False, memory=7.0)) == marks[-1]


def test_parameters_of_a_file_hold_where_nothing_is_swept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As one value each of an axis, which overrides the file; a folder of its own, and the values in its record."""
    write_tuned(tmp_path / "mine.toml", {"field.speed": 0.75, "potential.zeta": 3.0, "potential.k_att": 0.07}, "")
    grid = ["--grid", "K_att=0.02,0.05", "--no-figures"]
    assert main([*grid, "--params", "mine.toml"]) == 0
    said = capsys.readouterr().err
    assert (
        "parameters of mine.toml: 3 differ from the defaults: field.speed 0.5 -> 0.75, potential.zeta 4 -> 3, "
        "potential.k_att 0.03 -> 0.07 (swept)\n" in said
    )
    (folder,) = (tmp_path / "runs").iterdir()
    record = json.loads((folder / "config.json").read_text())
    assert record["config"]["params"] == "mine.toml" and record["identity"]["params"]["field.speed"] == 0.75
    assert main([*grid[:2], "speed=0.75", "zeta=3", "--no-figures", "--out", "axes"]) == 0
    assert main([*grid, "--out", "defaults"]) == 0
    with open_run(folder) as found, open_run("axes") as axes, open_run("defaults") as defaults:
        np.testing.assert_allclose(found.score.values.squeeze(), axes.score.values.squeeze(), rtol=1e-6)
        assert found.score.dims == defaults.score.dims and not np.allclose(found.score, defaults.score, rtol=1e-5)
    assert main([*grid, "--out", str(folder)]) == 2
    assert "holds another run (params.potential.k_att is 0.07 there, 0.03 here)" in capsys.readouterr().err
    write_tuned(tmp_path / "mine.toml", {"field.sped": 0.75}, "")
    assert main([*grid, "--params", "mine.toml"]) == 2
    assert capsys.readouterr().err.startswith("error: --params mine.toml: the cell has no parameter 'field.sped'")
