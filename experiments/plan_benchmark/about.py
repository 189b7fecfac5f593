"""What rows were measured on: processor, versions, commit, and how busy the machine was before."""

import json
import os
import platform
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.provenance import provenance

VERSIONS = ("python", "jax", "jaxlib", "numpy", "scipy", "ompl", "toppra")


def cpu_model() -> str:
    """The processor by its maker's name, or its architecture where the system does not tell."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or platform.machine()


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def about() -> dict[str, Any]:
    """The machine, versions and commit of this process, before it measures."""
    origin = provenance()
    return {
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        **{name: origin["versions"].get(name) or _version(name) for name in VERSIONS},
        "date": origin["created"],
        "commit": origin["commit"],
        "load_before": round(os.getloadavg()[0], 1),
    }


def stored(found: Mapping[str, Any]) -> dict[str, Any]:
    """As arrays of a case."""
    return {"about": np.array(json.dumps(dict(found)))}


def read(case: Mapping[str, NDArray]) -> dict[str, Any]:
    """What `stored` made."""
    return json.loads(str(case["about"]))


def sentence(known: Mapping[str, Any] | None) -> str:
    """One line about the machine and the code."""
    if not known:
        return "Machine, versions and commit were not recorded."
    packages = ", ".join(f"{name} {known.get(name, '?')}" for name in VERSIONS)
    commit, _, changes = str(known.get("commit", "?")).partition("+")
    return (
        f"Measured {known.get('date', '?')} on {known.get('cpu', '?')}, {known.get('cores', '?')} cores, load average "
        f"{known.get('load_before', '?')} before; {packages}; "
        f"commit {commit[:12]}{' with changes' if changes else ''}."
    )
