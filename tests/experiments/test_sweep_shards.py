"""The sweep as several processes: the results of one, whatever happens to them."""

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

import hrcjax.sweeps.merge as merge
from experiments.sweep.__main__ import main
from hrcjax.sweeps.shard import Shard
from hrcjax.sweeps.store import open_run, open_shard, open_store

TOY = Path(__file__).parents[1] / "helpers" / "toy_sweep.py"
SMALL = ["--grid", "K_att=log:0.01:0.1:4", "K_rep=lin:0.1:1:3", "zeta=2,4", "--memory", "0.5", "--no-figures"]
TWO = [*SMALL, "--scene", "robotica", "hri"]
"""Five chunks in each of two worlds."""


@pytest.fixture(autouse=True)
def toy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The toy cell in place of the real one, in an empty folder."""
    monkeypatch.setitem(sys.modules, "hrcjax.cells.problem", toy_cell)
    monkeypatch.setattr("experiments.sweep.run.LOADED_CODE", "toy")  # somebody may edit the package meanwhile
    monkeypatch.chdir(tmp_path)


def same(one: str, other: str) -> None:
    with open_run(one) as a, open_run(other) as b:
        assert list(a.variables) == list(b.variables)
        for name in a.variables:
            np.testing.assert_array_equal(a[name].values, b[name].values, err_msg=str(name))


def test_shards_in_one_folder_give_the_results_of_one_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    written = []
    write = merge.write_results
    monkeypatch.setattr(merge, "write_results", lambda *a: (written.append(a[0]), write(*a)))
    assert main([*TWO, "--out", "whole"]) == 0
    for number in (2, 3, 1):
        toy_cell.BUILT.clear()
        assert main([*TWO, "--out", "r", "--shard", f"{number}/3"]) == 0
        assert len(toy_cell.BUILT) == (2 if number == 2 else 1)  # chunks 4 to 6 of 10 lie in both worlds
        assert (tmp_path / "r" / "results.nc").exists() == (number == 1)
    assert [str(folder) for folder in written] == ["whole", "r"]
    same("whole", "r")
    printed = capsys.readouterr()
    assert "shard 2/3: 3 of 10 chunks of up to 5 settings -> r" in printed.err
    assert "shard 2/3 has finished; 7 of 12 files of the run are not in r yet" in printed.err
    assert printed.out.count("Best settings") == 2
    toy_cell.BUILT.clear()
    assert main([*TWO, "--out", "r", "--shard", "3/3"]) == 0  # again: nothing to do
    assert toy_cell.BUILT == [] and len(written) == 2


def test_chunks_of_another_number_of_shards_are_used(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SMALL, "--out", "r", "--shard", "1/2"]) == 0
    assert main([*SMALL, "--out", "r", "--shard", "1/1"]) == 0
    assert "15 of 24 settings are finished already" in capsys.readouterr().err
    assert open_run("r").sizes["k_att"] == 4


def test_more_shards_than_chunks_says_who_has_nothing_to_do(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SMALL, "--out", "r", "--shard", "7/8"]) == 0
    said = capsys.readouterr().err
    assert "5 chunks for 8 shards: nothing to do for shards 6 to 8; a smaller --memory makes more chunks" in said
    assert "shard 7/8: 0 of 5 chunks" in said and "compiling" not in said
    for number in range(1, 6):
        assert main([*SMALL, "--out", "r", "--shard", f"{number}/8"]) == 0
    assert main([*SMALL, "--out", "whole"]) == 0
    same("whole", "r")


def test_folders_of_their_own_are_merged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number in (1, 2, 3):
        assert main([*SMALL, "--out", f"part{number}", "--shard", f"{number}/3"]) == 0
    assert main([*SMALL, "--seed", "1", "--out", "other"]) == 0
    (tmp_path / "empty").mkdir()
    capsys.readouterr()
    for folders, message in (
        (["part1", "other"], "--merge: other holds another run than part1"),
        (["part1", "empty"], "--merge: empty holds no run"),
        (["empty"], "--merge: empty holds no run"),
    ):
        assert main(["--no-figures", "--merge", *folders, "--out", "r"]) == 2
        assert message in capsys.readouterr().err and not (tmp_path / "r").exists()
    assert main(["--merge", "part1"]) == 2
    assert "--merge FOLDER ... needs --out" in capsys.readouterr().err
    assert main(["--no-figures", "--merge", "part1", "part3", "--out", "r"]) == 2
    named = "world-000-chunk-00002, world-000-chunk-00003"
    assert f"2 of 6 files are missing or damaged in r/chunks ({named}); run their" in capsys.readouterr().err
    damaged = tmp_path / "part2" / "chunks" / "world-000-chunk-00003.h5"
    whole = damaged.read_bytes()
    damaged.write_bytes(whole[:-50])
    assert main(["--no-figures", "--merge", "part1", "part2", "part3", "--out", "r"]) == 2
    assert "1 of 6 files are missing or damaged in r/chunks (world-000-chunk-00003)" in capsys.readouterr().err
    damaged.write_bytes(whole)
    assert main(["--no-figures", "--merge", "part1", "part2", "part3", "--out", "r"]) == 0
    assert main([*SMALL, "--out", "whole"]) == 0
    same("whole", "r")


def test_merge_without_folders_writes_what_is_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SMALL, "--out", "r", "--merge"]) == 2
    assert "--merge: r holds no run" in capsys.readouterr().err and not (tmp_path / "r").exists()
    assert main([*SMALL, "--out", "r", "--shard", "1/2"]) == 0
    assert main([*SMALL, "--out", "r", "--merge"]) == 2
    assert "2 of 6 files are missing" in capsys.readouterr().err
    assert main([*SMALL, "--out", "r", "--shard", "2/2"]) == 0
    (tmp_path / "r" / "results.nc").unlink()
    toy_cell.BUILT.clear()
    assert main([*SMALL, "--out", "r", "--merge"]) == 0
    assert toy_cell.BUILT == [] and open_run("r").sizes["zeta"] == 2


def test_the_plain_command_computes_what_shards_left(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SMALL, "--out", "r", "--shard", "1/2"]) == 0
    assert main([*SMALL, "--out", "r"]) == 0
    assert "15 of 24 settings are finished already" in capsys.readouterr().err
    assert main([*SMALL, "--out", "whole"]) == 0
    same("whole", "r")


def test_who_may_write_at_the_same_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SMALL, "--out", "r", "--shard", "1/3"]) == 0
    record = json.loads((tmp_path / "r" / "config.json").read_text())
    capsys.readouterr()
    with open_shard(tmp_path / "r", record["fingerprint"], record, Shard(2, 3)):
        assert main([*SMALL, "--out", "r", "--shard", "2/3"]) == 2
        assert "shard 2/3 runs already in r" in capsys.readouterr().err
        assert main([*SMALL, "--out", "r"]) == 2
        assert "another process writes to r; wait for it" in capsys.readouterr().err
        assert main([*SMALL, "--out", "r", "--shard", "3/3"]) == 0
        capsys.readouterr()
        assert main([*SMALL, "--seed", "9", "--out", "r", "--shard", "1/3"]) == 2
        assert "seed is [0] there, [9] here" in capsys.readouterr().err
    with open_store(tmp_path / "r", record["fingerprint"], record):
        assert main([*SMALL, "--out", "r", "--shard", "2/3"]) == 2
        assert "a process that is not a shard writes to r" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--shard", "0/4"], "--shard 0/4: the first number counts from 1 to the second"),
        (["--shard", "a/b"], "--shard a/b: accepted is I/N"),
        (["--shard", "1/2", "--overwrite"], "--shard 1/2 and --overwrite exclude each other"),
        (["--shard", "1/2", "--merge"], "--shard 1/2 and --merge exclude each other"),
        (["--shard", "1/2", "--hosts", "auto"], "--shard 1/2 and --hosts exclude each other"),
        (["--hosts", "auto", "--overwrite"], "--hosts auto and --overwrite exclude each other"),
        (["--hosts", "auto", "--merge"], "--hosts auto and --merge exclude each other"),
        (["--hosts", "1/2"], "--hosts 1/2 needs --coordinator HOST:PORT"),
        (["--devices", "-1"], "--devices -1: accepted is 0 or more"),
        (["--devices", "99"], "--devices 99: accepted is 1 to"),
    ],
)
def test_mistakes_get_one_line(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*SMALL, "--out", "r", *options]) == 2
    assert message in capsys.readouterr().err.splitlines()[-1] and list(tmp_path.iterdir()) == []


def test_not_finite_results_of_a_share_are_its_status(monkeypatch: pytest.MonkeyPatch) -> None:
    base = toy_cell.build_problem(("robotica",), ("reach_in",), (0,))

    def spoil(p: toy_cell.ToyParams, w: toy_cell.ToyWorld) -> dict:
        out = toy_cell.evaluate(p, w)
        return {**out, "score": jnp.where(p.potential.k_att > 0.05, jnp.inf, out["score"])}

    monkeypatch.setattr("experiments.sweep.run._build", lambda _: replace(base, evaluate=spoil))
    assert main([*SMALL, "--out", "r", "--shard", "1/2"]) == 0
    assert main([*SMALL, "--out", "s", "--shard", "2/2"]) == 3
    assert main([*SMALL, "--out", "r", "--shard", "2/2"]) == 3


@pytest.mark.slow
def test_shards_at_the_same_time_of_which_one_is_killed_and_restarted(tmp_path: Path) -> None:
    slow = {**os.environ, "TOY_DELAY": "0.3", "JAX_PLATFORMS": "cpu"}
    words = [sys.executable, str(TOY), *SMALL, "--out"]

    def start(number: int) -> subprocess.Popen:
        return subprocess.Popen(
            [*words, "r", "--shard", f"{number}/2"],
            env=slow,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    first, second = start(1), start(2)
    begin = time.monotonic()
    while not (tmp_path / "r" / "chunks" / "world-000-chunk-00000.h5").exists():
        assert time.monotonic() - begin < 120 and first.poll() is None
        time.sleep(0.005)
    os.kill(first.pid, signal.SIGKILL)
    first.communicate()
    _, said = second.communicate(timeout=120)
    assert second.returncode == 0 and "files of the run are not in r yet" in said
    left = len(list((tmp_path / "r" / "chunks").glob("*-chunk-*.h5")))
    assert 3 <= left < 5 and not (tmp_path / "r" / "results.nc").exists()
    whole = subprocess.Popen([*words, "whole"], env={**slow, "TOY_DELAY": "0"}, stdout=subprocess.DEVNULL)
    again = start(1)
    _, said = again.communicate(timeout=120)
    assert again.returncode == 0 and "of 15 settings are finished already" in said and whole.wait(120) == 0
    same("whole", "r")
