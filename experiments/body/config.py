"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Follow a person's body in the images of two depth cameras. Two parts:

  track   the body against the exact person, image by image: surfaces of arms and hands, the body region nearest to the arm, left
          and right, speeds towards the arm, and time
  loop    whole episodes of the arm beside these people, with what the body says and without, in one run: time stopped, arrivals,
          contacts, and speed beyond what the person's real speed allows

Beside the tracker: begun anew in every frame ("cold"), without learning lengths ("fixed"), told wrong radii ("thick"), and the nearest
point alone.
Every person is stored as they come: an interrupted program is resumed by the same command.

Examples:

  Two motions:
    python -m experiments.body --quick

  Recorded people too, rows in a file and a page:
    python -m experiments.body --recordings FOLDER --json body.json --page docs/body.md

  What the loop gains, alone:
    python -m experiments.body --parts loop --recordings FOLDER --json body.json"""

PARTS = ("track", "loop")


@dataclass(frozen=True)
class BodyConfig:
    """Follow a person's body in noisy images."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    parts: tuple[str, ...] = PARTS
    """Parts: track, loop."""
    people: tuple[str, ...] = ("reach_in", "reach_and_stay", "pass_by", "stand_and_work")
    """Who comes: names of motions, or BVH files."""
    recordings: Path | None = None
    """Folder of BVH files that are added to them."""
    seed: int = 0
    """First seed of noise and motions."""
    seeds: int = 1
    """Seeds from there on: everybody comes once with each; other trackers are compared with the first alone."""
    seconds: float = 12.0
    """Length of an episode [s]."""
    variants: tuple[str, ...] = ("full", "fixed", "thick", "cold")
    """Trackers: full, fixed (lengths and radii as usual), thick (told radii of 1.1 times the exact ones), cold (every frame begins anew)."""
    compared: int = 4
    """People, the first ones, with all of these; the others have the first tracker alone."""
    quick: bool = False
    """Two motions, and of the trackers the first alone."""
    out: Path | None = None
    """Folder of the run; runs/body-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {"body": {row: {value, unit}}}; other sections in it are kept, and rows of a part that is not run."""
    page: Path | None = None
    """Output file for a Markdown page of the rows; its figures go into the folder `figures` beside it."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""


def parse(argv: Sequence[str]) -> BodyConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(BodyConfig, argv, "body", DESCRIPTION)
    return replace(config, people=config.people[:2], recordings=None, variants=("full",)) if config.quick else config
