"""Where results come from: commit, versions, a digest of the code, and the fingerprint that guards a resume."""

import hashlib
import json
import platform
import subprocess
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parents[1]
PACKAGES = ("hrcjax", "jax", "jaxlib", "mujoco", "mujoco-mjx", "equinox", "numpy", "scipy")
NO_INFLUENCE = ("viz", "tune", "reference", "programs", "configs")
"""Folders of the package on whose code results do not depend."""


def file_digest(path: Path) -> str:
    """SHA-256 of a file's content."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def code_digest(package: Path = PACKAGE) -> str:
    """SHA-256 over the names and contents of all Python files of a package on which results depend."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package)
        if name.parts[0] not in NO_INFLUENCE:
            digest.update(f"{name.as_posix()}\0{file_digest(path)}\0".encode())
    return digest.hexdigest()


LOADED_CODE = code_digest()
"""The digest when this program began: what it runs, whatever is edited meanwhile."""


def versions() -> dict[str, str]:
    """Versions of Python and of the packages on which results depend."""
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
    """Everything about the origin of results that does not decide their numbers, and the versions, which may."""
    return {
        "commit": commit(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": " ".join(sys.argv),
        "versions": versions(),
        "platform": platform.platform(),
    }


def fingerprint(identity: Mapping[str, Any]) -> str:
    """SHA-256 of everything that decides the numbers."""
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
