"""Provenance of results: commit, versions, a digest of the code, and the fingerprint that a resumed run must match."""

import hashlib
import json
import platform
import subprocess
import sys
from collections.abc import Collection, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parents[1]
PACKAGES = ("hrcjax", "jax", "jaxlib", "mujoco", "mujoco-mjx", "equinox", "numpy", "scipy")
NO_INFLUENCE = ("viz", "tune", "reference", "programs", "configs")
"""Folders of the package that do not affect results."""


def file_digest(path: Path) -> str:
    """SHA-256 of a file's content."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def code_digest(package: Path = PACKAGE) -> str:
    """SHA-256 over the names and contents of all Python files of a package that affect results."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package)
        if name.parts[0] not in NO_INFLUENCE:
            digest.update(f"{name.as_posix()}\0{file_digest(path)}\0".encode())
    return digest.hexdigest()


def program_digests(folder: Path, afterwards: Collection[str] = ()) -> dict[str, str]:
    """SHA-256 of every file of a program, by name.

    Args:
        folder: of the program.
        afterwards: files to leave out, as they only read finished cases.
    """
    return {path.name: file_digest(path) for path in sorted(folder.glob("*.py")) if path.name not in afterwards}


def as_asked(config: Any) -> dict[str, Any]:
    """The options of a program as JSON values."""
    return {key: str(value) if isinstance(value, Path) else value for key, value in asdict(config).items()}


LOADED_CODE = code_digest()
"""The digest at program start, unaffected by later edits."""


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that affect results."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def commit(root: Path = PACKAGE.parent) -> str:
    """The git commit of the code, with "+changes" if files differ from it; "unknown" outside a checkout."""

    def git(*arguments: str) -> str:
        done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, text=True, timeout=20, check=True)
        return done.stdout.strip()

    try:
        if Path(git("rev-parse", "--show-toplevel")).resolve() != root:
            return "unknown"
        return git("rev-parse", "HEAD") + ("+changes" if git("status", "--porcelain") else "")
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def provenance() -> dict[str, Any]:
    """Origin of results: not part of the fingerprint."""
    return {
        "commit": commit(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": " ".join(sys.argv),
        "versions": versions(),
        "platform": platform.platform(),
    }


def fingerprint(identity: Mapping[str, Any]) -> str:
    """SHA-256 of everything that determines the results."""
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
