"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Measure what the cell senses against the exact geometry, over whole episodes: false stops, errors of distances, what is
missed, speed beside people, faults of the cameras, time.

Every episode's figures are stored as they come: an interrupted run is resumed by the same command.

Examples:

  Two scenes, one seed, few faults:
    python -m experiments.sensing --quick

  The whole matrix, with two recorded people:
    python -m experiments.sensing --config full --people nobody reach_in pass_by stand_and_work a.bvh b.bvh

  Rows to a file, and the page:
    python -m experiments.sensing --json sensing.json --page sensing.md"""

SCENES = ("robotica", "robotica-spheres", "robotica-clearance", "hri", "clutter")
PEOPLE = ("nobody", "reach_in", "pass_by", "stand_and_work")


@dataclass(frozen=True)
class SensingConfig:
    """Measure what the cell senses against the exact geometry."""

    config: str = "standard"
    """Named settings: standard, full, or a TOML file of options. Other options on the command line override them."""
    cell: str = "ur5"
    """The cell: ur5, ur5e, ur5-reflected, ur5-body, or MODULE:FUNCTION that returns one of your own."""
    params: str = ""
    """Parameters in place of the cell's defaults: a file of tuned parameters, the folder of a tuning, or the name of a shipped file (configs/tuned)."""
    sensing: Literal["shared", "own"] = "shared"
    """shared: images show a nominal arm, the same for all settings; own: the arm where it really is."""
    scenes: tuple[str, ...] = SCENES
    """Scenes: robotica, robotica-spheres, robotica-clearance, hri, clutter."""
    people: tuple[str, ...] = PEOPLE
    """People: names of motions (reach_in, pass_by, stand_and_work, reach_and_stay, nobody) or BVH files."""
    seeds: int = 1
    """Number of seeds of noise, people and cluttered scenes, from 0."""
    moments: int = 20
    """Moments at which every kind of fault begins, on one camera and on all at once. 0: no faults."""
    appearances: int = 8
    """Moments at which a person appears at once beside the arm. 0: none."""
    hands: int = 300
    """Hands that appear in free space. 0: none."""
    images: int = 150
    """Images that are timed. 0: none."""
    quick: bool = False
    """Two scenes, one seed, few faults, appearances and hands."""
    out: Path | None = None
    """Folder of the run; runs/sensing-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {"sensing": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows, with what is measured."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""


def reduced(config: SensingConfig) -> SensingConfig:
    """The options of a quick run."""
    some = [scene for scene in ("robotica", "clutter") if scene in config.scenes] or list(config.scenes[:2])
    return replace(
        config, scenes=tuple(some), seeds=1, moments=min(config.moments, 5), appearances=min(config.appearances, 3),
        hands=min(config.hands, 120), images=min(config.images, 40),
    )  # fmt: skip


def parse(argv: Sequence[str]) -> SensingConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(SensingConfig, argv, "sensing", DESCRIPTION)
    return reduced(config) if config.quick else config
