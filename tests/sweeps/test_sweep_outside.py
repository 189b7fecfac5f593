"""A sweep and the world outside: names of files, folders that cannot be written, an end asked for by the system."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import toy_cell

from experiments.figures.__main__ import main as figures
from experiments.sweep.__main__ import main
from experiments.sweep.config import SweepConfig
from experiments.sweep.run import identity
from hrcjax.sweeps.settings import make_settings
from hrcjax.sweeps.store import open_run

TOY = Path(__file__).parents[1] / "helpers" / "toy_sweep.py"
SMALL = ["--grid", "K_att=log:0.01:0.1:4", "K_rep=lin:0.1:1:3", "zeta=2,4", "--memory", "0.5"]
HOME = b"ha\xe4nd".decode(errors="surrogateescape")


@pytest.fixture(autouse=True)
def toy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "hrcjax.cells.problem", toy_cell)
    monkeypatch.chdir(tmp_path)


def test_any_name_of_a_person_and_of_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = r"a $x_{$ 中文 " + HOME
    (tmp_path / f"{name}.bvh").write_text("")
    assert main([*SMALL, "--no-figures", "--person", f"{name}.bvh", "--out", f"out {name}"]) == 0
    with open_run(tmp_path / f"out {name}") as ds:
        assert ds.person.values.tolist() == [r"a $x_{$ 中文 ha\xe4nd.bvh"]
        assert len(json.loads(ds.attrs["config"])["person"]) == 1
    assert figures([f"out {name}"]) == 0
    assert "metric-score.png" in os.listdir(tmp_path / f"out {name}" / "figures")
    assert "Traceback" not in capsys.readouterr().err


def test_many_people_with_long_names_have_a_folder(tmp_path: Path) -> None:
    people = [f"{'x' * 49}{i}.bvh" for i in range(8)]
    for name in people:
        (tmp_path / name).write_text("")
    assert main([*SMALL, "--no-figures", "--person", *people]) == 0
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder.name.startswith("sweep-robotica-xxxx") and len(folder.name) < 120


def test_folders_that_take_no_file_are_refused_before_anything_is_built(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def never(*_: object) -> None:
        raise AssertionError("work began")

    monkeypatch.setattr(toy_cell, "build_problem", never)
    (tmp_path / "file").write_text("")
    for out, why in (("file", "is a file"), ("file/x", "is not a folder"), ("x" * 300, "File name too long")):
        assert main([*SMALL, "--out", out]) == 2
        error = capsys.readouterr().err
        assert why in error and "give another --out" in error and error.count("\n") == 1


def test_too_little_space_is_told_before_the_first_chunk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    free = shutil.disk_usage(tmp_path)._replace(free=50_000)
    monkeypatch.setattr("hrcjax.sweeps.engine.shutil.disk_usage", lambda _: free)
    assert main([*SMALL, "--out", "r"]) == 1
    error = capsys.readouterr().err.splitlines()[-1]
    # 24 settings twice, as chunks and in the results: 5 numbers, 15 + 60 points, 60 zones of a byte, 120 numbers
    assert f"{24 * 2 * (4 * (5 + 3 * 75 + 120) + 60) / 1e6:.0f} MB are needed in r, 0 MB are free" in error
    assert not list((tmp_path / "r" / "chunks").glob("*chunk*"))


def test_sigterm_ends_as_ctrl_c_and_the_same_command_goes_on(tmp_path: Path) -> None:
    words = [sys.executable, str(TOY), *SMALL, "--no-figures", "--out", str(tmp_path / "r")]
    slow = {**os.environ, "TOY_DELAY": "0.2", "JAX_PLATFORMS": "cpu"}
    process = subprocess.Popen(words, env=slow, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    begin = time.monotonic()
    while len(list((tmp_path / "r" / "chunks").glob("*chunk*.h5"))) < 2:
        assert process.poll() is None and time.monotonic() - begin < 120
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 143
    assert error.splitlines()[-1] == "error: stopped; the same command resumes the run"
    done = subprocess.run(words, env={**slow, "TOY_DELAY": "0"}, capture_output=True, text=True)
    assert done.returncode == 0 and "settings are finished already" in done.stderr
    assert main([*SMALL, "--no-figures", "--out", "whole"]) == 0
    with open_run(tmp_path / "r") as a, open_run(tmp_path / "whole") as b:
        np.testing.assert_allclose(a.score.values, b.score.values, rtol=1e-5)


def test_settings_of_a_motion_file_and_its_names_decide_the_run(tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text("one")
    (tmp_path / "n.toml").write_text("")

    def mark(person: str) -> str:
        config = SweepConfig(person=(person,), grid=("zeta=2,4",))
        problem = toy_cell.build_problem(("hri",), ("reach_in",), (0,), "folded")
        return json.dumps(identity(config, problem, make_settings(config.grid, problem.params), 3))

    marks = [mark("a.bvh"), mark("a.bvh,unit=cm"), mark("a.bvh,names=n.toml")]
    (tmp_path / "n.toml").write_text('hip = "Hips"')
    marks.append(mark("a.bvh,names=n.toml"))
    (tmp_path / "a.bvh").write_text("two")
    marks += [mark("a.bvh"), mark("a.bvh,names=n.toml")]
    assert len(set(marks)) == len(marks)
