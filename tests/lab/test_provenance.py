"""What guards a resume changes exactly with what decides the numbers."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import jax
import mujoco
import numpy as np
import pytest

from hrcjax.lab.provenance import (
    NO_INFLUENCE,
    PACKAGE,
    code_digest,
    commit,
    file_digest,
    fingerprint,
    provenance,
    versions,
)


def package(folder: Path, **files: str) -> Path:
    """A package of files by names whose dots are folders."""
    for name, text in files.items():
        path = folder / (name.replace(".", "/") + ".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


FILES = {"a": "x = 1", "sim.b": "x = 1", "sweeps.engine": "x = 1", "cells.cell": "x = 1"}


def test_code_digest_sees_contents_and_names(tmp_path: Path) -> None:
    first = code_digest(package(tmp_path / "first", **FILES))
    assert code_digest(package(tmp_path / "same", **FILES)) == first
    marks = {first}
    for name in FILES:
        changed = package(tmp_path / f"changed {name}", **{**FILES, name: "x = 2"})
        marks.add(code_digest(changed))
        (changed / (name.replace(".", "/") + ".py")).write_text("x = 1")
        assert code_digest(changed) == first
        renamed = {f"{other}_" if other == name else other: text for other, text in FILES.items()}
        marks.add(code_digest(package(tmp_path / f"renamed {name}", **renamed)))
    moved = {"a": "x = 1", "lab.b": "x = 1", "sweeps.engine": "x = 1", "cells.cell": "x = 1"}
    marks.add(code_digest(package(tmp_path / "moved", **moved)))
    assert len(marks) == 2 + 2 * len(FILES)


def test_code_digest_passes_over_what_does_not_change_results(tmp_path: Path) -> None:
    first = code_digest(package(tmp_path, **FILES))
    for folder in NO_INFLUENCE:
        package(tmp_path, **{f"{folder}.new": "x = 1"})
    (tmp_path / "sim" / "notes.txt").write_text("not code")
    assert code_digest(tmp_path) == first
    for name in ("visual.a", "sim.viz.a", "viz"):  # alike, elsewhere, and a file of that name
        assert code_digest(package(tmp_path, **{name: "x = 1"})) != first


def test_code_digest_does_not_depend_on_the_order_in_which_files_are_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, found = code_digest(package(tmp_path, **FILES)), Path.rglob
    monkeypatch.setattr(Path, "rglob", lambda self, pattern: reversed(sorted(found(self, pattern))))
    assert code_digest(tmp_path) == first


def test_every_folder_named_without_influence_is_there_and_has_none() -> None:
    """A misspelt name would leave its folder in the digest; a wrong one would hide a change of numbers."""
    project = PACKAGE.parent
    assert set(NO_INFLUENCE) == {"viz", "tune", "reference", "programs", "configs"}
    installed = {"programs": project / "experiments", "configs": project / "configs"}
    for name in NO_INFLUENCE:
        assert installed.get(name, PACKAGE / name).is_dir(), name
    tree = sorted(PACKAGE.rglob("*.py"))
    digested = [path for path in tree if path.relative_to(PACKAGE).parts[0] not in NO_INFLUENCE]
    hidden = re.compile(rf"(?:from|import) hrcjax(?:\.| import )(?:{'|'.join(NO_INFLUENCE)})\b")
    assert len(digested) > 80
    drawn = {PACKAGE / "sweeps" / name for name in ("figures.py", "knob_figures.py", "drawn_world.py")}
    for path in digested:
        if path not in drawn:  # they draw what is computed already
            assert not hidden.search(path.read_text()), path


def test_code_digest_of_this_package_depends_on_its_numerics_alone(tmp_path: Path) -> None:
    copy = tmp_path / "hrcjax"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    first = code_digest(copy)
    assert code_digest() == first  # it is the package's own by default
    (copy / "viz" / "style.py").write_text("")
    assert code_digest(copy) == first
    for name in ("sim/tick.py", "cells/cell.py", "sweeps/engine.py", "lab/parameters.py", "robot/chain.py"):
        before = code_digest(copy)
        with open(copy / name, "a") as file:
            file.write("\n")
        assert code_digest(copy) != before, name


def test_fingerprint_ignores_the_order_of_keys_alone() -> None:
    assert fingerprint({"a": 1, "b": [1, 2]}) == fingerprint({"b": [1, 2], "a": 1})
    assert fingerprint({"a": [1, 2]}) != fingerprint({"a": [2, 1]})
    assert (
        fingerprint({"b": 1, "a": 2}) == "21501dbaf73f5223934d22283f01caff4132bc1de4a9550c1ed0dffeb397a323"
    )  # of {"a": 2, "b": 1}


def test_file_digest_is_sha256(tmp_path: Path) -> None:
    (tmp_path / "f").write_bytes(b"abc")
    assert file_digest(tmp_path / "f") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


def test_commit_of_a_repository(tmp_path: Path) -> None:
    assert commit(tmp_path) == "unknown"
    who = {"GIT_AUTHOR_NAME": "a", "GIT_AUTHOR_EMAIL": "a@b", "GIT_COMMITTER_NAME": "a", "GIT_COMMITTER_EMAIL": "a@b"}

    def git(*arguments: str) -> str:
        run = subprocess.run(
            ["git", *arguments], cwd=tmp_path, env={**os.environ, **who}, capture_output=True, text=True, check=True
        )
        return run.stdout.strip()

    git("init", "-q")
    (tmp_path / "f").write_text("1")
    git("add", "f")
    git("commit", "-q", "-m", "one")
    assert commit(tmp_path) == git("rev-parse", "HEAD")
    (tmp_path / "f").write_text("2")
    assert commit(tmp_path) == git("rev-parse", "HEAD") + "+changes"
    (tmp_path / "below").mkdir()
    assert commit(tmp_path / "below") == "unknown"


def test_versions_and_origin() -> None:
    found = versions()
    for name in ("python", "jax", "jaxlib", "mujoco", "mujoco-mjx", "equinox", "numpy", "scipy"):
        assert found[name][0].isdigit(), name  # a misspelt one would read "not installed"
    assert (found["jax"], found["numpy"], found["mujoco"]) == (jax.__version__, np.__version__, mujoco.__version__)
    assert {"commit", "created", "command", "versions", "platform"} == set(provenance())
