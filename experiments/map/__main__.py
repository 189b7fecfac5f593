"""`python -m experiments.map`: integrates a recording of depth images or point clouds into a distance field map."""

import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from hrcjax.lab.compiled import keep_compiled
from hrcjax.lab.errors import UsageError, exit_status
from hrcjax.lab.rows import table

from .config import MapConfig, parse

STOPPED = "stopped before the results were complete"
MEMORY = "not enough memory for this map; give a smaller --capacity or --shape, or a larger --spacing"


def evaluate(config: MapConfig) -> int:
    """Prints the rows of the evaluation as a table, or as JSON.

    Raises:
        UsageError: a recording is given too.
    """
    if config.input is not None:
        raise UsageError("--evaluate generates its own scenes: accepted is --evaluate without --input")
    from .evaluate.report import run_evaluation  # here, so that --help answers at once

    rows = run_evaluation(progress=not config.json)
    print(
        json.dumps(rows, indent=1) if config.json else table("map", {name: with_bar(row) for name, row in rows.items()})
    )
    return 0


def with_bar(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row whose unit includes the target value, if the row has one."""
    bar = row.get("bar")
    return {**row, "unit": row["unit"] if bar is None else f"{row['unit']}  (target {bar})"}


def main(argv: Sequence[str] | None = None) -> int:
    """The program; returns its exit status."""

    def program() -> int:
        config = parse(sys.argv[1:] if argv is None else argv)
        if config.list:
            from .choices import parameter_table  # here, so that --help answers at once

            print(parameter_table())
            return 0
        keep_compiled()
        if config.evaluate:
            return evaluate(config)
        from .run import run

        return run(config)

    return exit_status(program, STOPPED, MEMORY)


if __name__ == "__main__":
    sys.exit(main())
