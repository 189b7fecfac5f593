"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hrcjax.lab.configs import parse_config

from .play import FUNCTIONS

DESCRIPTION = """Functions of an arm beside people, each beside the function switched off:

  keep_away  the tool holds a pose, and stays at least a set distance from people
  follow     the tool keeps a set distance from a hand that moves at up to 0.3 m/s
  hand_over  the tool goes to a pose beside a hand that has been still for half a second, holds, and withdraws when it moves
  give_way   a task to and fro; who comes into its way gets it; it is resumed without a jump

Every run is an episode of images, with the arm where it is; the hand is found in the sensed points. The exact shape of the person is
for the measures alone. The safety layer stays the last word: speed and separation, or where a task is near a contact, power and force
limiting. Every run is stored as it comes: an interrupted program is resumed by the same command.

Examples:

  One run of each:
    python -m experiments.interact --quick

  Recorded people too, rows in a file and a page:
    python -m experiments.interact --recordings FOLDER --json interact.json --page docs/interact.md"""


@dataclass(frozen=True)
class InteractConfig:
    """Functions of an arm beside people."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    functions: tuple[str, ...] = FUNCTIONS
    """Functions: keep_away, follow, hand_over, give_way."""
    people: tuple[str, ...] = ("reach_in", "reach_and_stay", "pass_by", "stand_and_work")
    """Who comes in keep_away and give_way: names of motions, or BVH files."""
    recordings: Path | None = None
    """Folder of BVH files that are added to them."""
    seeds: int = 2
    """Number of seeds of these people; recorded ones have one."""
    hands: int = 5
    """Number of hands that are followed, and of hands that are held out."""
    seconds: float = 10.0
    """Length of a run [s]."""
    task_seconds: float = 16.0
    """Length of a run of give_way: a person comes and goes, and the task comes to an end after that [s]."""
    quick: bool = False
    """One person or hand for each function, without variants that are only compared."""
    out: Path | None = None
    """Folder of the run; runs/interact-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {"interact": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows; its figures go into the folder `figures` beside it."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""


def parse(argv: Sequence[str]) -> InteractConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(InteractConfig, argv, "interact", DESCRIPTION)
    return replace(config, people=config.people[:1], recordings=None, seeds=1, hands=1) if config.quick else config
