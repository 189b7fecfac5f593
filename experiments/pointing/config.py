"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Start and goal chosen by pointing, in simulation: how far the places are from what is meant, and which are refused.

  tip      the finger touches the table or an obstacle
  finger   the line along the index finger, to a surface 0.3 to 1.2 m away
  fresh    the same, with errors of the landmarks that are new in every image
  wide     the same, in images in which what is near is wider by a pixel to each side, as of windows that are matched
  thick    the same, with fingers 20 % thicker than the method is told
  thin     and 20 % thinner
  noisy    the same, with errors of landmarks and depths 1.5 times as large as it is told
  arm      the line from shoulder to wrist
  away     a finger that points at nothing: refused
  through  a hand that passes, pointing: no choice

A finger's line is the likeliest by all depth pixels about it and its landmarks; beside it stand the line by the landmarks alone, and the least
error that is possible with them. A hand that wanders faster than 3 cm/s chooses nothing.

The cell is surveyed with its table. People of capsules point with hands of 21 landmarks; two noisy depth cameras of 15 Hz see them, and a
detector whose landmarks err by some pixels. Beside each place stand those by the exact shapes, of the true line, and of a line by
a detector's own model in space. Every set of trials is stored as it comes: an interrupted program is resumed by the same command.

Examples:

  A dozen trials of each kind in one scene:
    python -m experiments.pointing --quick

  Rows in a file, and a page:
    python -m experiments.pointing --json pointing.json --page docs/pointing.md

  Landmarks twice as bad, whose errors stay the same while the hand is held:
    python -m experiments.pointing --pixel 5 --shared 1 --kinds finger

  Fingers in other scenes of obstacles:
    python -m experiments.pointing --scenes clutter --seeds 5 --kinds tip finger

  Other trials, on which nothing was chosen:
    python -m experiments.pointing --first 20 --seeds 2"""


@dataclass(frozen=True)
class PointingConfig:
    """Places chosen by pointing."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    kinds: tuple[str, ...] = ("tip", "finger", "fresh", "arm", "away", "through", "wide", "thick", "thin", "noisy")
    """Kinds of trials: tip, finger, fresh, arm, away, through, wide, thick, thin, noisy."""
    scenes: tuple[str, ...] = ("robotica", "clutter")
    """Scenes: robotica, robotica-spheres, robotica-clearance, hri, clutter."""
    seeds: int = 1
    """Number of seeds of clutter; the other scenes have one."""
    first: int = 0
    """The first seed, of trials and of clutter: those of another are others."""
    trials: int = 48
    """Trials of each kind in each scene."""
    pixel: float = 2.5
    """Error of a landmark in a colour image, as a standard deviation along each axis [px]."""
    shared: float = 0.3
    """Share of its variance that is the same in all images of a trial [1]."""
    quick: bool = False
    """A dozen trials of each kind in the first scene."""
    out: Path | None = None
    """Folder of the run; runs/pointing-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {"pointing": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows; its figures go into the folder `figures` beside it."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""


def parse(argv: Sequence[str]) -> PointingConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(PointingConfig, argv, "pointing", DESCRIPTION)
    return replace(config, scenes=config.scenes[:1], seeds=1, trials=12) if config.quick else config
