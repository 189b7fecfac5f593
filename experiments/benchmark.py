"""`python -m experiments.benchmark SECTION`: speed of a part, or of all parts, as a table and as JSON.

A section is a module of `experiments.benchmarks` with a function `run() -> {row: {"value": number, "unit": text}}`.
"""

import importlib
import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import tyro

from experiments.atomic import write_bytes
from experiments.errors import UsageError, exit_status
from experiments.options import parse_options

SECTIONS = ("arm", "field", "grad", "sweep", "map")
Row = Mapping[str, Any]


def run_section(name: str) -> dict[str, Row]:
    """Measures one section.

    Raises:
        UsageError: no such section, or its module is not there.
    """
    if name not in SECTIONS:
        raise UsageError(f"no section {name!r}; accepted: {', '.join(SECTIONS)}, all")
    module = f"experiments.benchmarks.{name}"
    try:
        section = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module:
            raise
        raise UsageError(f"section {name} has no module {module}") from error
    return dict(section.run())


def table(name: str, rows: Mapping[str, Row]) -> str:
    """The rows of a section, aligned."""
    wide = max([len(row) for row in rows] + [len(name)])
    lines = [name.ljust(wide)]
    for row, entry in rows.items():
        value = entry["value"]
        text = f"{value:,.0f}" if isinstance(value, int | float) and math.isfinite(value) and abs(value) >= 1000 else ""
        lines.append(f"{row.ljust(wide)}  {(text or f'{value:.3g}').rjust(12)}  {entry['unit']}")
    return "\n".join(lines)


def read_results(path: Path) -> dict[str, dict[str, Row]]:
    """The sections that a file has already; empty if there is no file.

    Raises:
        UsageError: it is no such file.
    """
    if not path.exists():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(f"{path} cannot be read as JSON; remove it or choose another --json") from error
    if not isinstance(found, dict):
        raise UsageError(f"{path} holds no benchmark sections; remove it or choose another --json")
    return found


def benchmark(section: str, json_file: Path | None) -> int:
    """Measures a section, or all, prints tables and merges the rows into a JSON file."""
    names = SECTIONS if section == "all" else (section,)
    results = read_results(json_file) if json_file else {}
    if json_file and not json_file.parent.is_dir():
        raise UsageError(f"no folder {json_file.parent} for --json")
    for name in names:
        rows = run_section(name)
        print(table(name, rows) + "\n", flush=True)
        results[name] = rows
        if json_file:  # after each section: what was measured is kept
            write_bytes(json_file, (json.dumps(results, indent=1) + "\n").encode())
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """The program; returns its exit status."""

    def program() -> int:
        def arguments(
            section: Annotated[str, tyro.conf.Positional],
            json: Path | None = None,
        ) -> tuple[str, Path | None]:
            """Measure speed: as rates, and as ratios to peers measured in the same process.

            Args:
                section: arm, field, grad, sweep, map or all.
                json: File to write {section: {row: {value, unit}}} to; sections that it has already stay.
            """
            return section, json

        return benchmark(*parse_options(arguments, argv, "python -m experiments.benchmark"))

    try:
        return exit_status(program)
    except SystemExit as stop:
        return int(stop.code or 0)


if __name__ == "__main__":
    sys.exit(main())
