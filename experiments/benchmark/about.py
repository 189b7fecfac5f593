"""What rows were measured on: machine, versions, commit, and how busy the machine was.

A file of rows holds it in the reserved section `about`, {section: {what: value}}. Files without it are older.
"""

import os
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import jax

from hrcjax.lab.provenance import commit, versions

ABOUT = "about"
"""Name of the reserved section."""
VERSIONS = ("python", "jax", "jaxlib", "numpy", "mujoco")
SAME = ("cpu", "cores", "memory_gb", "device", *VERSIONS)
"""What must agree for two figures to be comparable."""


def load() -> float:
    """Processes that ran or waited in the last minute, on average [1]."""
    return os.getloadavg()[0]


def cpu_model() -> str:
    """The processor by its maker's name, or its architecture where the system does not tell."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or platform.machine()


def about(load_before: float) -> dict[str, Any]:
    """The machine and the versions of this process.

    Args:
        load_before: `load` at the start of the measurement; later it contains the measurement itself.
    """
    device = jax.devices()[0]
    found = versions()
    return {
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        "memory_gb": round(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e9, 1),
        "device": f"{device.platform}: {device.device_kind}" if device.platform != "cpu" else "cpu",
        **{name: found.get(name, "unknown") for name in VERSIONS},
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit(),
        "load_before": round(load_before, 2),
    }


def sentence(known: Mapping[str, Any] | None) -> str:
    """One line about the machine of a section."""
    if not known:
        return "Machine and versions were not recorded."
    packages = ", ".join(f"{name} {known.get(name, '?')}" for name in VERSIONS)
    return (
        f"Measured {known.get('date', '?')} on {known.get('cpu', '?')}, {known.get('cores', '?')} cores, "
        f"{known.get('memory_gb', '?')} GB, device {known.get('device', '?')}; {packages}; "
        f"commit {str(known.get('commit', '?'))[:12]}; load average before {known.get('load_before', '?')}."
    )


def differences(
    before: Mapping[str, Mapping[str, Any]], now: Mapping[str, Mapping[str, Any]], sections: list[str]
) -> str:
    """What keeps the figures of two files from being compared, in one line; "": nothing known does.

    Args:
        before: the section `about` of the earlier file; now: of the later one.
        sections: those that are compared.
    """
    found: dict[str, list[str]] = {}
    for section in sections:
        old, new = before.get(section), now.get(section)
        if not old or not new:
            sides = [name for name, known in (("before", old), ("now", new)) if not known]
            found.setdefault(f"machine and versions not recorded {' and '.join(sides)}", []).append(section)
            continue
        for name in SAME:
            if old.get(name) != new.get(name):
                found.setdefault(f"{name} {old.get(name, '?')} -> {new.get(name, '?')}", []).append(section)
    said = [f"{text} ({', '.join(where) if len(where) < len(sections) else 'all'})" for text, where in found.items()]
    return f"not the same machine or versions: {'; '.join(said)}" if said else ""
