"""`python -m experiments.map`: a recording of depth, frame by frame, into a map of distances."""

import importlib
import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from configs.map_config import MapConfig
from experiments.benchmark import table
from experiments.compiled import keep_compiled
from experiments.errors import UsageError, exit_status
from experiments.options import parse_options

DESCRIPTION = """Take a recording of depth frame by frame into a map: a smooth distance field that remembers.

Writes to runs/map-NAME: map.npz (the map, to be opened again), cloud.ply (its points: static, dynamic, new),
statistics.json, and figures: slices of the distance, the points from three sides. Ctrl-C ends early and still writes.

Examples:

  A folder with depth/ and pose.txt, or a TUM RGB-D folder; the box is chosen by a first look:
    python -m experiments.map --input path/to/recording --fit

  A room instead of a table: coarser, and surfaces up to 6 m away:
    python -m experiments.map --input path/to/recording --fit --spacing 0.05 --param far=6

  The surroundings of an arm at the origin, every second of 300 frames:
    python -m experiments.map --input path/to/recording --lower -1 -1 -0.2 --shape 20 20 12 --every 2 --frames 300

  A ROS bag with two depth cameras, in the frame of the robot's base:
    python -m experiments.map --input run.bag --topics /left/depth /right/depth --world-frame base_link

  Point clouds taken by a sensor that stood 1.2 m over the origin:
    python -m experiments.map --input path/to/plys --fit --origin 0 0 1.2

  A UR5 that works in the picture, and nothing but its table:
    python -m experiments.map --input run.npz --joints joints.npz --crop -0.8 -0.8 -0.1 0.8 0.8 1.0

  Go on from a map:
    python -m experiments.map --input path/to/more --continue-from runs/map-recording/map.npz

  How true is it?
    python -m experiments.map --evaluate

In a notebook: from experiments.map_file import open_map; layout, params, state = open_map("runs/.../map.npz");
hrcjax.map.map_distance(layout, state.levels, params.ratio, x)"""

EVALUATION = "experiments.evaluate.report"
STOPPED = "stopped before the results were complete"
MEMORY = "not enough memory for this map; give a smaller --capacity or --shape, or a larger --spacing"


def parse(argv: Sequence[str]) -> MapConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    return parse_options(MapConfig, argv, "python -m experiments.map", description=DESCRIPTION)


def evaluate(config: MapConfig) -> int:
    """Prints the rows of the evaluation as a table, or as JSON.

    Raises:
        UsageError: a recording is given too, or the evaluation is not part of this copy.
    """
    if config.input is not None:
        raise UsageError("--evaluate makes scenes of its own: leave --input out")
    try:
        report = importlib.import_module(EVALUATION)
    except ModuleNotFoundError as error:
        if error.name is None or not EVALUATION.startswith(error.name):
            raise
        raise UsageError("this copy has no evaluation of the map; accepted is --input PATH") from error
    rows: dict[str, dict[str, Any]] = report.run_evaluation(progress=not config.json)
    print(
        json.dumps(rows, indent=1) if config.json else table("map", {name: with_bar(row) for name, row in rows.items()})
    )
    return 0


def with_bar(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row whose unit also tells its bar, if it has one."""
    bar = row.get("bar")
    return {**row, "unit": row["unit"] if bar is None else f"{row['unit']}  (bar {bar})"}


def main(argv: Sequence[str] | None = None) -> int:
    """The program; returns its exit status."""

    def program() -> int:
        config = parse(sys.argv[1:] if argv is None else argv)
        if config.list:
            from experiments.mapping.choices import parameter_table  # here, so that --help answers at once

            print(parameter_table())
            return 0
        keep_compiled()
        if config.evaluate:
            return evaluate(config)
        from experiments.mapping.run_map import run

        return run(config)

    try:
        return exit_status(program, STOPPED, MEMORY)
    except SystemExit as stop:  # --help
        return int(stop.code or 0)


if __name__ == "__main__":
    sys.exit(main())
