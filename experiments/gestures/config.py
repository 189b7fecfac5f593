"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hrcjax.lab.configs import configs_folder
from hrcjax.lab.errors import UsageError
from hrcjax.lab.options import parse_options

PROGRAM = "python -m experiments.gestures"
DESCRIPTION = """usage: python -m experiments.gestures train | evaluate | run [OPTIONS]

Gestures of hands as commands: an open hand stops the arm, a closed one lets it go on, a pointing one names a place.

  train      train the classifier, seconds of work, and write its weights
  evaluate   accuracy on blocks of the recording that training did not see, hands in disorder, commands in streams
  run        commands from a video, with overlays; needs pip install 'hrcjax[perception]'

COMMAND --help explains the options of each."""
TRAIN = """Train the classifier of gestures, and write its weights.

The file of --data has a row for each frame of a recording: class (0 open, 1 closed, 2 pointing), then x and y of 21 landmarks in
MediaPipe's order. Each class is divided into ten blocks in the order of the recording; blocks 2 and 7 are held out, since
neighbouring frames are nearly alike. Hyperparameters are chosen on four inner folds of the other eight.

Examples:

  The weights that are shipped:
    python -m experiments.gestures train --data keypoint.csv --weights configs/gestures/weights.toml

  Compare hyperparameters on the inner folds:
    python -m experiments.gestures train --data keypoint.csv --choose"""
EVALUATE = """Measure the classifier and its commands on the blocks of a recording that training did not see.

Examples:

  All rows, in a file and as a page:
    python -m experiments.gestures evaluate --data keypoint.csv --json gestures.json --page docs/gestures.md

  With one's own weights and table of commands:
    python -m experiments.gestures evaluate --data keypoint.csv --weights my.toml --commands my_commands.toml

  A first look:
    python -m experiments.gestures evaluate --data keypoint.csv --quick"""
RUN = """Read commands from a video, or a folder of images, by MediaPipe's hand landmarks.

Prints a table of commands with their times; frames with landmarks, gestures and commands drawn over them go into the folder of
--out as PNG. Needs pip install 'hrcjax[perception]' and the file hand_landmarker.task in the folder of --models; nothing is
downloaded.

Examples:

    python -m experiments.gestures run --video hands.mp4 --models path/to/models
    python -m experiments.gestures run --video folder_of_images --rate 15 --models path/to/models --out runs/hands
    python -m experiments.gestures run --video 0 --models path/to/models --seconds 30        # a webcam, by its number"""


def default_weights() -> Path:
    """The weights that are shipped."""
    return configs_folder() / "gestures" / "weights.toml"


def default_commands() -> Path:
    """The table of commands that is shipped."""
    return configs_folder() / "gestures" / "commands.toml"


@dataclass(frozen=True)
class TrainConfig:
    """Train the classifier of gestures."""

    data: Path
    """Rows of a recording: class, then x and y of 21 landmarks."""
    weights: Path = Path("weights.toml")
    """Output file."""
    seed: int = 0
    """Seed of the first weights and of all changes by chance."""
    steps: int = 1500
    """Steps of the optimiser."""
    choose: bool = False
    """Compare hyperparameters on the inner folds instead; writes nothing."""


@dataclass(frozen=True)
class EvaluateConfig:
    """Measure the classifier and its commands."""

    data: Path
    """Rows of a recording: class, then x and y of 21 landmarks."""
    weights: Path | None = None
    """Weights of the classifier; the shipped ones if not given."""
    commands: Path | None = None
    """Table of commands; the shipped one if not given."""
    seed: int = 0
    """Seed of changes and streams."""
    minutes: float = 10.0
    """Duration of the stream without a go [min]."""
    streams: int = 5
    """Further such streams by other draws; their false starts are added up."""
    quick: bool = False
    """One minute, one further stream, no plain network."""
    out: Path = Path("runs/gestures")
    """Folder of rows and figures."""
    json: Path | None = None
    """Output file {"gestures": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows; its figures go into the folder `figures` beside it."""


@dataclass(frozen=True)
class RunConfig:
    """Read commands from a video."""

    video: str
    """A video, a folder of images in the order of their names, or the number of a webcam."""
    models: Path
    """Folder with hand_landmarker.task."""
    rate: float = 30.0
    """Frames in a second of a folder of images [Hz]."""
    seconds: float = 60.0
    """Longest time to read [s]."""
    weights: Path | None = None
    """Weights of the classifier; the shipped ones if not given."""
    commands: Path | None = None
    """Table of commands; the shipped one if not given."""
    out: Path = Path("runs/gestures-video")
    """Folder of the overlays."""
    every: int = 5
    """Every how manieth frame is drawn; frames with a command always are."""


Config = TrainConfig | EvaluateConfig | RunConfig
KINDS = {"train": (TrainConfig, TRAIN), "evaluate": (EvaluateConfig, EVALUATE), "run": (RunConfig, RUN)}


def parse(argv: Sequence[str]) -> Config | None:
    """The settings from the command line; None: help was printed.

    Raises:
        UsageError: no or an unknown command, an unknown option, a value of the wrong type.
        SystemExit: with status 0 after COMMAND --help.
    """
    if argv and argv[0] in ("-h", "--help"):
        print(DESCRIPTION)
        return None
    if not argv or argv[0] not in KINDS:
        given = repr(argv[0]) if argv else "none"
        raise UsageError(f"no command {given}; accepted: {', '.join(KINDS)}; --help explains them")
    kind, text = KINDS[argv[0]]
    return parse_options(kind, argv[1:], f"{PROGRAM} {argv[0]}", description=text)
