"""The file of rows: checked before anything is measured, and merged with what was."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import UsageError
from hrcjax.lab.rows import read_results

from .rows import POINT, Rows

SECTION, ABOUT = "plan_benchmark", "about"
"""Sections of the rows, and of what they were measured on."""
SPACES = ("point", "arm")
Origins = dict[str, dict[str, Any]]
"""Space -> what its rows were measured on."""


def merged(old: Mapping[str, Mapping[str, Any]], new: Rows, space: str) -> Rows:
    """The new rows, and of the old ones those of the space that was not measured."""
    kept = {k: dict(v) for k, v in old.items() if space == ("arm" if k.startswith(POINT) else "point")}
    return {**kept, **new} if space == "point" else {**new, **kept}


def read_kept(file: Path | None, space: str) -> tuple[Rows, Origins]:
    """The rows of a file that a run in `space` keeps, and what those were measured on.

    Raises:
        UsageError: the file has another format.
    """
    sections = read_results(file) if file else {}
    rows, known = sections.get(SECTION, {}), sections.get(ABOUT, {})
    if not isinstance(rows, dict) or not isinstance(known, dict):
        raise UsageError(f"{file}: {SECTION} and {ABOUT} are not sections; remove it or choose another --json")
    for name, entry in rows.items():
        if not isinstance(entry, dict) or not isinstance(entry.get("value"), int | float):
            raise UsageError(f"{file}: row {name} has no value; remove it or choose another --json")
    kept = {name: {"unit": "", **entry} for name, entry in merged(rows, {}, space).items()}
    origins = {one: known.get(f"{SECTION}_{one}") for one in SPACES if space not in (one, "both")}
    return kept, {one: dict(found) for one, found in origins.items() if isinstance(found, dict)}


def write_results(file: Path, rows: Rows, origins: Origins) -> None:
    """Puts the rows into the file; its other sections stay.

    Raises:
        UsageError: the file has another format.
        StorageError: it cannot be written.
    """
    sections = read_results(file)
    known = {f"{SECTION}_{space}": found for space, found in origins.items()}
    other = {name: found for name, found in sections.get(ABOUT, {}).items() if name not in {f"{SECTION}_{one}" for one in SPACES}}  # fmt: skip
    text = json.dumps(sections | {SECTION: rows, ABOUT: {**other, **known}}, indent=1)
    write_bytes(file, (text + "\n").encode())
