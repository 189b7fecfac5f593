"""`python -m experiments.benchmark SECTION`: speed of a part, or of all parts, as a table and as JSON.

With --page the rows are also written as a Markdown page; section `page` writes it from the rows of --json without measuring.
A section is a module of this folder with a function `run() -> {row: {"value": number, "unit": text}}`.
"""

import importlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import tyro

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import UsageError, exit_status
from hrcjax.lab.options import parse_options
from hrcjax.lab.rows import Row, read_results, table
from hrcjax.lab.writable import check_writable

from .page import page

SECTIONS = ("arm", "field", "grad", "sweep", "map", "scale")


def run_section(name: str) -> dict[str, Row]:
    """Measures one section.

    Raises:
        UsageError: no such section, or its module is missing.
    """
    if name not in SECTIONS:
        raise UsageError(f"no section {name!r}; accepted: {', '.join(SECTIONS)}, all, page")
    module = f"{__package__}.{name}"
    try:
        section = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module:
            raise
        raise UsageError(f"section {name} has no module {module}") from error
    return dict(section.run())


def benchmark(section: str, json_file: Path | None, page_file: Path | None) -> int:
    """Measures a section, or all, prints tables, merges the rows into a JSON file and writes the page of all rows.

    Raises:
        UsageError: no such section; a missing folder; no rows for the page.
    """
    for option, file in (("--json", json_file), ("--page", page_file)):
        if file and not file.parent.is_dir():
            raise UsageError(f"no folder {file.parent} for {option}")
    if section == "page" and not (json_file and page_file):
        raise UsageError("section page needs --json FILE with the rows and --page FILE to write")
    results = read_results(json_file) if json_file else {}
    if json_file:
        check_writable(json_file.parent, "--json")
    if section == "page" and not results:
        raise UsageError(f"{json_file} holds no rows to write a page from; measure first, with section all")
    names = {"all": SECTIONS, "page": ()}.get(section, (section,))
    for name in names:
        rows = run_section(name)
        print(table(name, rows) + "\n", flush=True)
        results[name] = rows
        if json_file:  # after each section, so that finished ones are kept
            write_bytes(json_file, (json.dumps(results, indent=1) + "\n").encode())
    if page_file:
        write_bytes(page_file, page(results).encode())
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """The program; returns its exit status."""

    def program() -> int:
        def arguments(
            section: Annotated[str, tyro.conf.Positional],
            json: Path | None = None,
            page: Path | None = None,
        ) -> tuple[str, Path | None, Path | None]:
            """Measure speed as rates, and as ratios to peers measured in the same process.

            Args:
                section: arm, field, grad, sweep, map or all; page: write --page from the rows of --json without measuring.
                json: Output file {section: {row: {value, unit}}}; other sections in it are kept.
                page: Output file for a Markdown page of all sections, with descriptions.
            """
            return section, json, page

        return benchmark(*parse_options(arguments, argv, "python -m experiments.benchmark"))

    return exit_status(program, "stopped; the sections finished before are in the file of --json")


if __name__ == "__main__":
    sys.exit(main())
