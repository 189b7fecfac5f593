"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hrcjax.lab.options import parse_options

DESCRIPTION = """Measure the planner of the whole arm: problems of a UR5 among boxes, each path accepted by an exact collision check at
steps of 2 degrees, and the speed of plans in the Robotica paper's scene.

Examples:

  300 problems drawn evenly:
    python -m experiments.plan_benchmark --count 300

  All, with rows in a file and a page:
    python -m experiments.plan_benchmark --json plan.json --page docs/plan-benchmark.md"""


@dataclass(frozen=True)
class PlanBenchmarkConfig:
    """Measure the planner of the whole arm."""

    problems: Path = Path("../shared/data/planning/ur5s_6_3000.npz")
    """Problems: start, goal, box_center, box_half_extents, n_boxes, and reference paths."""
    count: int = 0
    """Problems to take, drawn evenly from the file. 0: all."""
    settings: int = 128
    """Settings of K_att, K_rep and zeta that are planned at once in the Robotica paper's scene. 0: none."""
    json: Path | None = None
    """Output file {"plan_benchmark": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows, with what is measured."""


def parse(argv: Sequence[str]) -> PlanBenchmarkConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    return parse_options(
        PlanBenchmarkConfig, argv, "python -m experiments.plan_benchmark", description=DESCRIPTION, default=PlanBenchmarkConfig()
    )  # fmt: skip
