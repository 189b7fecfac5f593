"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Measure safety beside people, against the exact shapes. Four parts:

  stop         from random states: does the arm come to rest before the intrusion distance, under stated speeds, latency and braking?
  episodes     whole episodes sensed through images, in six variants: with zones, without a safety layer, tool's distance alone,
               stop before contact, power and force limiting by the standard's and the reflected mass; in the ways to move "both" and "path"
  path         does scaled speed keep the path, and how does motion resume?
  chance       many episodes by chance, with noise, latency and missing images; violations with their 95 % upper limit

Every part is stored as it comes: an interrupted run is resumed by the same command.

Examples:

  One scene, two people, 128 episodes by chance:
    python -m experiments.safety --quick

  Recorded people too, 20,000 episodes by chance, rows and page to files:
    python -m experiments.safety --recordings FOLDER --episodes 20000 --json safety.json --page safety.md

  Episodes by chance alone:
    python -m experiments.safety --parts chance --episodes 5000"""

PARTS = ("stop", "episodes", "path", "chance")
PEOPLE = ("reach_in", "reach_and_stay", "pass_by", "stand_and_work")
MODES = ("both", "path")


@dataclass(frozen=True)
class SafetyConfig:
    """Measure safety beside people, against the exact shapes."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    cell: str = "ur5"
    """The cell: ur5, ur5e, ur5-reflected, ur5-body, or MODULE:FUNCTION that returns one of your own with the monitor of hrcjax.safety."""
    params: str = ""
    """Parameters in place of the cell's defaults: a file of tuned parameters, the folder of a tuning, or the name of a shipped file (configs/tuned)."""
    parts: tuple[str, ...] = PARTS
    """Parts: stop, episodes, path, chance."""
    scenes: tuple[str, ...] = ("robotica", "hri")
    """Scenes: robotica, robotica-spheres, robotica-clearance, hri, clutter."""
    people: tuple[str, ...] = PEOPLE
    """People: names of motions (reach_in, reach_and_stay, pass_by, stand_and_work) or BVH files."""
    recordings: Path | None = None
    """Folder of BVH files that are added to the people."""
    seeds: int = 2
    """Number of seeds of generated people, of cluttered scenes and of noise, from 0."""
    states: int = 20000
    """Random states of the part stop."""
    episodes: int = 2000
    """Episodes by chance."""
    quick: bool = False
    """One scene, two people, one seed, at most 2,000 states and 128 episodes by chance; without the part path."""
    finished: bool = False
    """Compute nothing: rows, page and figures of the parts that an interrupted run has finished."""
    out: Path | None = None
    """Folder of the run; runs/safety-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {"safety": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows, with what is measured."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""


def reduced(config: SafetyConfig) -> SafetyConfig:
    """The options of a quick run."""
    return replace(
        config, parts=tuple(part for part in config.parts if part != "path"), scenes=config.scenes[:1],
        people=config.people[:2], recordings=None, seeds=1, states=min(config.states, 2000),
        episodes=min(config.episodes, 128),
    )  # fmt: skip


def parse(argv: Sequence[str]) -> SafetyConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(SafetyConfig, argv, "safety", DESCRIPTION)
    return reduced(config) if config.quick else config
