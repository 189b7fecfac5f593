"""Rows of measurements, {row: {"value": number, "unit": text}}: as an aligned table, and in sections of a JSON file."""

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import UsageError
from hrcjax.lab.table import aligned

Row = Mapping[str, Any]


def table(name: str, rows: Mapping[str, Row]) -> str:
    """The rows of a section as an aligned table."""
    lines = [[name, "", ""]]
    for row, entry in rows.items():
        value = entry["value"]
        text = f"{value:,.0f}" if isinstance(value, int | float) and math.isfinite(value) and abs(value) >= 1000 else ""
        lines.append([row, text or f"{value:.3g}", str(entry["unit"])])
    return aligned(lines, "<><")


def report(name: str, rows: Mapping[str, Row], holds: Callable[[str, float], bool | None]) -> None:
    """Prints the rows of a section, and which of their bars do not hold.

    Args:
        holds: row, value -> whether the row keeps its bar; None: it has none.
    """
    print(table(name, rows))
    failed = [row for row, entry in rows.items() if holds(row, entry["value"]) is False]
    print(f"\n{len(failed)} bars do not hold" + (f": {', '.join(failed)}" if failed else ""))


def write_rows(folder: Path, file: Path | None, sections: Mapping[str, Mapping[str, Row]]) -> None:
    """Writes sections of rows into rows.json of a run's folder, and into a file whose other sections stay.

    Raises:
        UsageError: the file has another format.
        StorageError: one of them cannot be written.
    """
    write_bytes(folder / "rows.json", (json.dumps(sections, indent=1) + "\n").encode())
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(file, (json.dumps(read_results(file) | dict(sections), indent=1) + "\n").encode())


def read_results(path: Path) -> dict[str, dict[str, Row]]:
    """The sections of a file; none if the file is missing or empty.

    Raises:
        UsageError: the file has another format.
    """
    if not path.exists():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8").strip() or "{}")
    except (OSError, ValueError) as error:
        raise UsageError(f"{path} is not valid JSON; remove it or choose another --json") from error
    if not isinstance(found, dict):
        raise UsageError(f"{path} has no benchmark sections; remove it or choose another --json")
    return found
