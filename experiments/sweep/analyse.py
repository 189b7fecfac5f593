"""`--analyse RUN`: what the swept parameters of a finished run do to its metrics, as a table, as JSON and as figures."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.errors import UsageError
from hrcjax.lab.rows import Row, read_results, table
from hrcjax.lab.table import aligned
from hrcjax.lab.writable import check_writable
from hrcjax.sweeps.analysis import SECTION, SHARES, KnobEffects, analysis_rows, effects_of, is_grid
from hrcjax.sweeps.store import open_run
from hrcjax.sweeps.summary import metric_names


def analyse(folder: Path, by: str, json_file: Path | None, figures: bool) -> int:
    """Prints the rows, merges them into a JSON file, draws the figures; returns the exit status.

    Raises:
        UsageError: no finished run there, no such metric, or a JSON file of another format.
        StorageError: a file cannot be written.
    """
    if json_file:
        if not json_file.parent.is_dir():
            raise UsageError(f"no folder {json_file.parent} for --json")
        check_writable(json_file.parent, "--json")
    sections = read_results(json_file) if json_file else {}
    with open_run(folder) as results:
        by = by or str(results.attrs["rank"])
        if by not in metric_names(results):
            raise UsageError(f"--by {by}: no such metric; accepted: {', '.join(metric_names(results))}")
        effects = effects_of(results, by)
        rows = analysis_rows(results, by, effects)
        print(table(SECTION, {name: row for name, row in rows.items() if name in SHARES}))
        if effects:
            print("\n" + _effects_table(effects))
        for text in _missing(is_grid(results), rows):
            print(text, file=sys.stderr, flush=True)
        if json_file:
            write_bytes(json_file, (json.dumps({**sections, SECTION: rows}, indent=1) + "\n").encode())
        if figures:
            from hrcjax.sweeps.figures import analysis_figures, write_figures  # here: drawing is slow to import

            for path in write_figures(folder, analysis_figures(results, by, effects)):
                print(path)
    return 0


def _effects_table(effects: KnobEffects) -> str:
    """A line per kind and knob, a column per metric: together they are the name of the row in the JSON file."""
    lines = [["", *effects.metrics]]
    for prefix, numbers in effects.kinds().items():
        for knob, values in zip(effects.knobs, numbers, strict=True):
            lines.append([f"{prefix}_{knob}", *(f"{value:.3f}" if np.isfinite(value) else "-" for value in values)])
    return aligned(lines, ">")


def _missing(grid: bool, rows: Mapping[str, Row]) -> list[str]:
    """Why rows are absent."""
    if not grid:
        return ["line ranges and Sobol indices need a full grid, without --sobol"]
    if not rows["success_share"]["value"]:
        return ["no setting succeeded: line ranges and Sobol indices are of those that did"]
    return []
