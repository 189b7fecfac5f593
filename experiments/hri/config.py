"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from hrcjax.lab.configs import parse_config

from .baseline.settings import BaselineSettings

DESCRIPTION = """The HRI paper's experiment: a tool goes to and fro between two waypoints while a person's arm enters.

All systems get images of the same cameras, people and noise, with the arm where it is, move the same simulated arm, and are measured by the
exact truth:

  ours              our policies on our field along a route to and fro, with speed and separation (mode both)
  nearest           ours on the distance to the nearest point
  path              our path, whose clock alone reacts (mode path)
  ours_free         ours without speed and separation, as the baseline has none
  baseline          OctoMap, BFMT*, toppra and a monitor that stops and plans anew, as in the paper (pip install 'hrcjax[baselines]')
  baseline_guarded  the same with our safety layer over it: speed and separation slow its motions
  baseline_slow     the baseline with slower accelerations, so that its cycle takes about as long as that of ours

A run is one system beside one person with one seed; runs with the same person and seed are pairs. Every run is stored as it comes: an
interrupted program is resumed by the same command.

Examples:

  Two people, ours and the baseline:
    python -m experiments.hri --quick

  Recorded people too, rows in a file and a page:
    python -m experiments.hri --recordings FOLDER --json hri.json --page docs/hri.md

  The baseline alone, beside a recorded person:
    python -m experiments.hri --systems baseline --people motion.bvh --seeds 1

  Another pace of ours, and of the baseline:
    python -m experiments.hri --quick --speed 0.4 --baseline.acceleration-scale 0.05"""

SYSTEMS = ("ours", "nearest", "path", "ours_free", "baseline", "baseline_guarded", "baseline_slow")


@dataclass(frozen=True)
class HriConfig:
    """The HRI paper's experiment, with our systems and its baseline."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    systems: tuple[str, ...] = SYSTEMS
    """Systems: ours, nearest, path, ours_free, baseline, baseline_guarded, baseline_slow."""
    people: tuple[str, ...] = ("reach_in", "reach_and_stay", "stand_and_work")
    """People: names of motions (reach_in, reach_and_stay, pass_by, stand_and_work, nobody) or BVH files."""
    recordings: Path | None = None
    """Folder of BVH files that are added to the people."""
    seeds: int = 4
    """Number of seeds of generated people, of noise and of the planner's samples, from 0."""
    recording_seeds: int = 2
    """The same for recorded people, of whom noise and planner's samples alone change."""
    seconds: float = 12.0
    """Length of a run [s]."""
    speed: float = 0.51
    """Largest speed of the reference of our systems [m/s]."""
    slow_scale: float = 0.05
    """Share of the joints' accelerations that baseline_slow uses [1]."""
    baseline: BaselineSettings = field(default_factory=BaselineSettings)
    """Numbers of the baseline."""
    quick: bool = False
    """Two people with one seed each, of ours, ours_free, baseline and baseline_guarded."""
    finished: bool = False
    """Compute nothing: rows, page and figures of the pairs that an interrupted run has finished."""
    out: Path | None = None
    """Folder of the run; runs/hri-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {"hri": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows; its figures go into the folder `figures` beside it."""
    figures: bool = True
    """Draw figures and the animation of one pair into the folder at the end: a GIF, and an MP4 where imageio-ffmpeg is installed."""
    overwrite: bool = False
    """Replace another run in the folder."""


def reduced(config: HriConfig) -> HriConfig:
    """The options of a quick run."""
    fast = tuple(name for name in config.systems if name in ("ours", "ours_free", "baseline", "baseline_guarded"))
    return replace(
        config,
        systems=fast or config.systems[:1],
        people=config.people[:2],
        recordings=None,
        seeds=1,
        recording_seeds=1,
    )


def parse(argv: Sequence[str]) -> HriConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(HriConfig, argv, "hri", DESCRIPTION)
    return reduced(config) if config.quick else config
