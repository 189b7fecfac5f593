"""What guards a resume changes exactly with what decides the numbers."""

import os
import subprocess
from pathlib import Path

from hrcjax.lab.provenance import ROOT, code_digest, commit, file_digest, fingerprint, provenance, versions


def test_code_digest_sees_contents_and_names_but_not_figures(tmp_path: Path) -> None:
    for name in ("hrcjax/a.py", "hrcjax/viz/b.py", "experiments/cell.py", "experiments/figures.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x = 1")
    first = code_digest(tmp_path)
    (tmp_path / "hrcjax" / "viz" / "b.py").write_text("x = 2")
    (tmp_path / "experiments" / "figures.py").write_text("x = 2")
    assert code_digest(tmp_path) == first
    (tmp_path / "experiments" / "cell.py").write_text("x = 2")
    second = code_digest(tmp_path)
    assert second != first
    (tmp_path / "hrcjax" / "a.py").rename(tmp_path / "hrcjax" / "c.py")
    assert code_digest(tmp_path) not in (first, second)


def test_code_digest_of_this_checkout_covers_the_package() -> None:
    assert code_digest(ROOT, ("hrcjax/*/*.py",)) != code_digest(ROOT, ("hrcjax/*.py",))
    assert code_digest() == code_digest()


def test_fingerprint_ignores_the_order_of_keys_alone() -> None:
    assert fingerprint({"a": 1, "b": [1, 2]}) == fingerprint({"b": [1, 2], "a": 1})
    assert fingerprint({"a": [1, 2]}) != fingerprint({"a": [2, 1]})


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
    assert versions()["jax"][0].isdigit() and versions()["mujoco"][0].isdigit()
    assert {"commit", "created", "command", "versions", "platform"} == set(provenance())
