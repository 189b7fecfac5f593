"""`python -m experiments.benchmark SECTION`: speed of a part, or of all parts, as a table and as JSON.

With --page the rows are also written as a Markdown page; section `page` writes it from the rows of --json without measuring.
With --against the rows are compared with those of an earlier file; section `compare` does so without measuring.
A section is a module of this folder with a function `run() -> {row: {"value": number, "unit": text}}`; a row may also have
"better": "low", "high", or "" for neither.
"""

import importlib
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import tyro

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import UsageError, exit_status, one_line
from hrcjax.lab.options import parse_options
from hrcjax.lab.progress import duration
from hrcjax.lab.rows import Row, read_results, table
from hrcjax.lab.writable import check_writable

from .about import ABOUT, about, load
from .compare import comparison
from .page import page

SECTIONS = ("arm", "field", "grad", "horizon", "sweep", "loop", "tick", "map", "scale", "plan")
WITHOUT = ("page", "compare")
"""What measures nothing."""


def run_section(name: str) -> dict[str, Row]:
    """Measures one section.

    Raises:
        UsageError: its module is missing.
    """
    module = f"{__package__}.{name}"
    try:
        section = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module:
            raise
        raise UsageError(f"it has no module {module}") from error
    return dict(section.run())


def measure(names: Sequence[str], results: dict[str, Any], json_file: Path | None) -> list[str]:
    """Measures sections, prints their tables and puts their rows into `results` and the file; the names of those measured.

    A section that fails is named with its error, and the others go on.
    """
    measured = []
    for number, name in enumerate(names, 1):
        place = f"section {name}, {number} of {len(names)}"
        print(f"{place} ...", file=sys.stderr, flush=True)
        begin, busy = time.monotonic(), load()
        try:
            rows = run_section(name)
        except Exception as error:
            if os.environ.get("HRCJAX_DEBUG") == "1":
                raise
            after = duration(time.monotonic() - begin)
            print(f"error: {place}, failed after {after}: {one_line(error)}", file=sys.stderr, flush=True)
            continue
        print(f"{place}: {duration(time.monotonic() - begin)}", file=sys.stderr, flush=True)
        print(table(name, rows) + "\n", flush=True)
        measured.append(name)
        results[name] = rows
        results[ABOUT] = {**results.get(ABOUT, {}), name: about(busy)}
        if json_file:  # after each section, so that finished ones are kept
            write_bytes(json_file, (json.dumps(results, indent=1) + "\n").encode())
    return measured


def check(section: str, json_file: Path | None, page_file: Path | None, against: Path | None) -> None:
    """Raises `UsageError` if the options do not fit together."""
    if section not in (*SECTIONS, "all", *WITHOUT):
        raise UsageError(f"no section {section!r}; accepted: {', '.join((*SECTIONS, 'all', *WITHOUT))}")
    for option, file in (("--json", json_file), ("--page", page_file)):
        if file and not file.parent.is_dir():
            raise UsageError(f"no folder {file.parent} for {option}")
    if section == "page" and not (json_file and page_file):
        raise UsageError("section page needs --json FILE with the rows and --page FILE to write")
    if section == "compare" and not (json_file and against):
        raise UsageError("section compare needs --json FILE with the rows and --against FILE with the earlier ones")
    if section == "page" and against:
        raise UsageError("section page compares nothing; leave --against out, or take section compare")


def benchmark(section: str, json_file: Path | None, page_file: Path | None, against: Path | None) -> int:
    """Measures a section, or all, prints tables, merges the rows into a JSON file, writes the page of all rows, and compares.

    Returns:
        the exit status: 1 if a section failed.

    Raises:
        UsageError: no such section; a missing folder; no rows for the page or to compare with.
    """
    check(section, json_file, page_file, against)
    before = read_results(against) if against else {}  # now, as it may be the file that is written
    if against and not before:
        raise UsageError(f"{against} holds no rows to compare with")
    results: dict[str, Any] = read_results(json_file) if json_file else {}
    if section in WITHOUT and not results:
        raise UsageError(f"{json_file} holds no rows; measure first, with section all")
    if json_file and section not in WITHOUT:
        check_writable(json_file.parent, "--json")
    names = {"all": SECTIONS, "page": (), "compare": ()}.get(section, (section,))
    measured = measure(names, results, json_file)
    if page_file:
        write_bytes(page_file, page(results).encode())
    if against and (measured or section == "compare"):
        if section not in ("all", "compare"):  # nothing is said of what was not asked for
            before, results = ({name: file.get(name, {}) for name in (*names, ABOUT)} for file in (before, results))
        elif section == "all":
            results = {name: results[name] for name in (*measured, ABOUT)}
        print(comparison(before, results))
    return 1 if len(measured) < len(names) else 0


def main(argv: Sequence[str] | None = None) -> int:
    """The program; returns its exit status."""

    def program() -> int:
        def arguments(
            section: Annotated[str, tyro.conf.Positional],
            json: Path | None = None,
            page: Path | None = None,
            against: Path | None = None,
        ) -> tuple[str, Path | None, Path | None, Path | None]:
            """Measure speed as rates, and as ratios to peers measured in the same process.

            Args:
                section: arm, field, grad, horizon, sweep, loop, tick, map, scale, plan or all; page: write --page from the rows of --json without
                    measuring; compare: compare the rows of --json with those of --against without measuring.
                json: Output file {section: {row: {value, unit}}}; other sections in it are kept. Section "about" holds machine,
                    versions and commit of each.
                page: Output file for a Markdown page of all sections, with descriptions.
                against: An earlier file of --json: prints the ratio now / before of every row in both, worst first.
            """
            return section, json, page, against

        return benchmark(*parse_options(arguments, argv, "python -m experiments.benchmark"))

    return exit_status(program, "stopped; the sections finished before are in the file of --json")


if __name__ == "__main__":
    sys.exit(main())
