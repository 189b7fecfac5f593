"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

from hrcjax.lab.configs import parse_config

DESCRIPTION = """What stands on a table, from depth images: the plane, every thing on it as a sphere, an upright column or a box, and a grid
of 1 (obstacle) and 0 (free) in metres.

With --evaluate it is measured on random tables whose exact shapes are known; every table is stored as it comes, so that an interrupted
run is resumed by the same command. With --input a recording is mapped into a scene file, scene.toml, which the sweep and its planner take.

Examples:

  A hundred tables of one to eight things, rows in a file:
    python -m experiments.task_space --evaluate --json task_space.json

  Five tables; or one, by its number:
    python -m experiments.task_space --evaluate --quick
    python -m experiments.task_space --evaluate --first 75 --tables 1

  Recorded depth into a scene file, one for every frame, with figures; then the sweep in it:
    python -m experiments.task_space --input path/to/recording --out runs/desk
    python -m experiments.sweep --scene runs/desk/figures/scene-1.toml --quick

  One scene from several frames of a still camera, named by a detector that you bring (extra: perception):
    python -m experiments.task_space --input path/to/recording --together --segmenter mask_rcnn.onnx --names coco.txt"""


FRESH = 4000
"""Number of the first table of `TaskSpaceConfig.fresh`."""
FILES = {"input": "FRAMES", "segmenter": "FILE", "names": "FILE", "json": "FILE", "page": "FILE"}
"""What a command line shows in place of files and folders."""


@dataclass(frozen=True)
class TaskSpaceConfig:
    """What stands on a table, from depth images."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    evaluate: bool = False
    """Measure on random tables."""
    input: tuple[str, ...] = ()
    """Recordings to map: folders with depth/ and pose.txt, TUM RGB-D folders, NPZ files or ROS bags, as of `experiments.map`. Colour images are read from color/ of a folder of numbered images."""
    tables: int = 100
    """With --evaluate: number of tables."""
    first: int = 0
    """With --evaluate: number of the first table; a table is drawn by its number."""
    fresh: int = 0
    """With --evaluate: so many tables more, from number 4000 on, at which nobody has looked while the mapping was made; they have rows of their own, in the section task_space_fresh."""
    images: int = 16
    """With --evaluate: images of each camera, whose mean is mapped."""
    together: bool = False
    """With --input: all frames show one still table; else each is mapped alone."""
    frames: int = 0
    """With --input: frames of a recording that are read, the first; 0: all."""
    up: tuple[float, ...] = ()
    """With --input: three numbers, about upwards in the recording's world; upwards in the first image (0 -1 0 of its camera) if not given."""
    start: tuple[float, ...] = ()
    """With --input: start of the task in the scene file, three numbers [m]; that of the Robotica paper if not given."""
    goal: tuple[float, ...] = ()
    """With --input: its goal [m]."""
    segmenter: Path | None = None
    """With --input: an ONNX file of a detector with boxes, and masks if it has them, such as a Mask R-CNN (extra perception: onnxruntime)."""
    names: Path | None = None
    """With --segmenter: a text file with the name of a class on every line."""
    quick: bool = False
    """Five tables, and five fresh ones if there are any."""
    out: Path | None = None
    """Folder of the run; runs/task_space-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """With --evaluate: output file {"task_space": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """With --evaluate: output file for a Markdown page of the rows; its figures go into the folder `figures` beside it. With --input too, its frames are on the page."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""

    def command(self) -> str:
        """The command line, as far as it is not the usual one; without the places of files."""
        words = ["python -m experiments.task_space"]
        for field in fields(self):
            value = getattr(self, field.name)
            if value == field.default or field.name in ("out", "figures", "overwrite"):
                continue
            words.append(f"--{field.name}")
            if field.name in FILES:
                words.append(FILES[field.name])
            elif not isinstance(value, bool):
                words.append(" ".join(f"{number:g}" for number in value) if isinstance(value, tuple) else str(value))
        return " ".join(words)

    @property
    def numbers(self) -> range:
        """Of the tables."""
        return range(self.first, self.first + self.tables)

    @property
    def fresh_numbers(self) -> range:
        """Of those that nobody has looked at."""
        return range(FRESH, FRESH + self.fresh)


def parse(argv: Sequence[str]) -> TaskSpaceConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(TaskSpaceConfig, argv, "task_space", DESCRIPTION)
    return replace(config, tables=min(config.tables, 5), fresh=min(config.fresh, 5)) if config.quick else config
