"""A run's folder: what is admitted, what survives, and what is seen as damaged."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hrcjax.lab import atomic
from hrcjax.lab.errors import StorageError, UsageError
from hrcjax.sweeps.store import newest_run, open_run, open_store

ARRAYS = {"score": np.arange(3, dtype=np.float32), "zone": np.ones((3, 2), np.int8), "flag": np.array([True, False])}
RECORD = {"identity": {"axes": {"a": [1, 2]}, "seed": [0]}}


def test_arrays_come_back_as_they_were(tmp_path: Path) -> None:
    with open_store(tmp_path / "run", "f", RECORD) as store:
        store.write("chunk", ARRAYS)
        back = store.read("chunk")
        assert back is not None
        for name, array in ARRAYS.items():
            np.testing.assert_array_equal(back[name], array)
            assert back[name].dtype.itemsize == array.dtype.itemsize
        assert list(store.read("chunk", only="zone") or {}) == ["zone"]
        assert store.read("other") is None


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "text", "renamed"])
def test_damaged_chunks_count_as_absent(tmp_path: Path, damage: str) -> None:
    with open_store(tmp_path, "f", RECORD) as store:
        store.write("chunk", {"score": np.full(1000, np.float32(3.14159))})
        path = tmp_path / "chunks" / "chunk.h5"
        data = path.read_bytes()
        number = np.float32(3.14159).tobytes()
        at = data.index(number * 10) + 200
        changed = {
            "cut": data[: len(data) // 2],
            "flip": data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :],
            "empty": b"",
            "text": b"no such thing",
            "renamed": data,
        }[damage]
        key = "chunk" if damage != "renamed" else "other"
        (tmp_path / "chunks" / f"{key}.h5").write_bytes(changed)
        assert store.read(key) is None


def test_chunks_of_another_run_count_as_absent(tmp_path: Path) -> None:
    with open_store(tmp_path, "f", RECORD) as store:
        store.write("chunk", ARRAYS)
        store.fingerprint = "g"
        assert store.read("chunk") is None


def test_another_run_is_refused_and_the_difference_named(tmp_path: Path) -> None:
    with open_store(tmp_path, "f", RECORD) as store:
        store.write("chunk", ARRAYS)
    other = {"identity": {"axes": {"a": [1, 3]}, "seed": [0]}}
    with (
        pytest.raises(UsageError, match=r"axes\.a is \[1, 2\] there, \[1, 3\] here.*--out, or --overwrite"),
        open_store(tmp_path, "g", other),
    ):
        pass
    assert (tmp_path / "chunks" / "chunk.h5").exists()
    with open_store(tmp_path, "g", other, overwrite=True) as store:
        assert store.read("chunk") is None
    assert not (tmp_path / "chunks" / "chunk.h5").exists()
    assert json.loads((tmp_path / "config.json").read_text())["fingerprint"] == "g"


def test_overwrite_of_the_same_run_resumes(tmp_path: Path) -> None:
    with open_store(tmp_path, "f", RECORD) as store:
        store.write("chunk", ARRAYS)
    with open_store(tmp_path, "f", RECORD, overwrite=True) as store:
        assert store.read("chunk") is not None


def test_damaged_config_is_refused(tmp_path: Path) -> None:
    (tmp_path / "config.json").write_text("{")
    with pytest.raises(UsageError, match=r"config\.json is damaged"), open_store(tmp_path, "f", RECORD):
        pass


def test_folders_of_others_are_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x")
    with pytest.raises(UsageError, match=r"holds other files \(thesis.tex\)"), open_store(tmp_path, "f", RECORD):
        pass
    with pytest.raises(UsageError, match="is a file"), open_store(tmp_path / "thesis.tex", "f", RECORD):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_what_killed_writers_left_is_removed(tmp_path: Path) -> None:
    (tmp_path / "chunks").mkdir()
    for place in (tmp_path, tmp_path / "chunks"):
        (place / ".tmp-1-x.nc").write_bytes(b"half")
    with open_store(tmp_path, "f", RECORD):
        assert not list(tmp_path.rglob(".tmp-*"))


def test_only_one_process_writes(tmp_path: Path) -> None:
    code = (
        f"from hrcjax.sweeps.store import open_store\nwith open_store({str(tmp_path)!r}, 'f', {RECORD!r}): print('in')"
    )
    with open_store(tmp_path, "f", RECORD):
        run = [sys.executable, "-c", code]
        second = subprocess.run(run, cwd=Path(__file__).parents[2], capture_output=True, text=True)
        assert "TakenError: another process writes to" in second.stderr
        assert second.stdout == ""
    third = subprocess.run(run, cwd=Path(__file__).parents[2], capture_output=True, text=True)
    assert third.stdout == "in\n"


@pytest.mark.parametrize("step", ["write", "fsync", "replace"])
def test_failed_writes_leave_the_old_file_and_no_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    path = tmp_path / "a"
    atomic.write_bytes(path, b"old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch, pytest.raises(StorageError, match=r"cannot write .*: No space left on device"):
        if step == "write":
            atomic.replace_file(path, full)
        else:
            patch.setattr(atomic.os, step, full)
            atomic.write_bytes(path, b"new")
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_open_run_says_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="holds no run"):
        open_run(tmp_path / "nothing")
    (tmp_path / "config.json").write_text("{}")
    with pytest.raises(UsageError, match="not finished"):
        open_run(tmp_path)
    (tmp_path / "results.nc").write_bytes(b"rubbish")
    with pytest.raises(UsageError, match="damaged"):
        open_run(tmp_path)


def test_newest_run(tmp_path: Path) -> None:
    assert newest_run(tmp_path) is None
    for age, name in enumerate(["b", "a", "c"]):
        (tmp_path / name).mkdir()
        if name != "c":
            (tmp_path / name / "results.nc").write_bytes(b"")
            os.utime(tmp_path / name / "results.nc", (age, age))
    assert newest_run(tmp_path) == tmp_path / "a"
