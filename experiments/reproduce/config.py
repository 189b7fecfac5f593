"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hrcjax.lab.options import parse_options

DESCRIPTION = """The Robotica paper's tables I to X, printed beside computed, and figures like its own:

  tables I-VII   time to goal of the improved potential field, of gradient descent and of RRT*, in three readings of the obstacles
  at one speed   length, bending energy and clearance of every planner's path, and its time at one common speed
  tables VIII-X  scores from their own rows
  claims         every claim of both papers: reproduced, refuted, not decidable or open

RRT* is OMPL's: pip install 'hrcjax[baselines]'; without it those rows are left out. Every part is stored as it comes: an interrupted
run is resumed by the same command.

Examples:

  One reading, one search of RRT* for each row:
    python -m experiments.reproduce --quick

  All, with rows to a file and both pages:
    python -m experiments.reproduce --json reproduce.json --page docs/reproduce.md --claims docs/claims.md

  The reading in which the first obstacle blocks the straight line, with ten searches of 5,000 samples:
    python -m experiments.reproduce --readings columns --seeds 10 --samples 5000"""

READINGS = ("spheres", "columns", "clearance")


@dataclass(frozen=True)
class ReproduceConfig:
    """The Robotica paper's tables and figures, printed beside computed."""

    readings: tuple[str, ...] = READINGS
    """Readings of the obstacles: spheres (balls about the printed points), columns (from the table up to them), clearance (balls of zeta times the radius)."""
    seeds: int = 5
    """Searches of RRT* for each row and reading, seeds from 1. 0: none."""
    samples: int = 1500
    """Iterations of each search."""
    quick: bool = False
    """Spheres alone, one search of at most 500 samples."""
    out: Path | None = None
    """Folder of the run; runs/reproduce-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {"reproduce": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the tables."""
    claims: Path | None = None
    """Output file for a Markdown page of the claims of both papers."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""


def reduced(config: ReproduceConfig) -> ReproduceConfig:
    """The options of a quick run."""
    return replace(
        config, readings=config.readings[:1], seeds=min(config.seeds, 1), samples=min(config.samples, 500)
    )  # fmt: skip


def parse(argv: Sequence[str]) -> ReproduceConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_options(
        ReproduceConfig, argv, "python -m experiments.reproduce", description=DESCRIPTION, default=ReproduceConfig()
    )
    return reduced(config) if config.quick else config
