"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Tune parameters of the whole system by the gradient of a loss over whole closed-loop episodes.

Before the first step it says which of the chosen parameters the loss feels, and which pairs it cannot tell apart. At the end it
measures the start and the tuned parameters by the exact metrics, in the training worlds and in worlds never seen. The state is
kept as it goes: an interrupted run is resumed by the same command, to the same numbers; a larger --steps continues it.

Examples:

  Three parameters, a few steps in one short episode:
    python -m experiments.tune --quick

  All gains of the target policy but two, on time and smoothness, from four starts:
    python -m experiments.tune --params policy.target --frozen policy.target.eps policy.target.ramp \\
        --loss time=0.1 progress=1 jerk=1e-3 --starts 4

  A loss of your own, from my_losses.py in this folder, beside the sound score:
    python -m experiments.tune --loss sound=1 my_losses:height=0.5

  Go on from another run, in other worlds:
    python -m experiments.tune --from runs/tune-0123abcd --people pass_by

--list shows all parameters and losses."""


@dataclass(frozen=True)
class TuneConfig:
    """Tune parameters by the gradient of whole episodes."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    cell: str = "ur5"
    """The cell: ur5, ur5e, ur5-reflected, ur5-body, or MODULE:FUNCTION that returns one of your own."""
    params: tuple[str, ...] = ("K_att=0.01:0.2", "K_rep=1e-6:1e-3", "zeta=1.2:5")
    """Parameters: NAME, NAME=LOW:HIGH or NAME=LOW:HIGH:START; the start of dotted names (policy.target) chooses all below it."""
    frozen: tuple[str, ...] = ()
    """Parameters that are left out of those chosen."""
    loss: tuple[str, ...] = ("sound=1", "progress=0.5")
    """Terms of the loss: NAME=WEIGHT; sound, progress, time, clearance, separation, excess_speed, jerk, effort, energy, of the field alone evidence, leave_one_out, or MODULE:FUNCTION of (params, cell, world, episode)."""
    scenes: tuple[str, ...] = ("robotica",)
    """Training scenes: robotica, robotica-spheres, robotica-clearance, hri, clutter."""
    people: tuple[str, ...] = ("reach_in", "pass_by")
    """Training people: names of motions, or BVH files."""
    seeds: tuple[int, ...] = (0, 1)
    """Training seeds of noise, people and cluttered scenes."""
    held_out_scenes: tuple[str, ...] = ()
    """Scenes of the worlds that are held out; those of training if not given."""
    held_out_people: tuple[str, ...] = ()
    """People held out; those of training if not given."""
    held_out_seeds: tuple[int, ...] = (100, 101)
    """Seeds held out; no worlds are held out if empty."""
    steps: int = 40
    """Steps of the optimiser."""
    batch: int = 4
    """Worlds in a step; all of them if not fewer."""
    rate: float = 0.1
    """Rate of the optimiser (adam): about the largest step of a coordinate [1]."""
    clip: float = 1.0
    """Largest norm of a start's gradient; a longer one is shortened to it [1]."""
    starts: int = 1
    """Starts side by side: the parameters' own values, and others drawn within the bounds."""
    seed: int = 0
    """Seed of the other starts, of the minibatches and of the intervals."""
    every: int = 5
    """Steps between two checkpoints and two rows."""
    quick: bool = False
    """At most 3 steps, one world to train and one held out, one start, an episode of 3 s, no slices: does it run?"""
    start_from: Annotated[str, tyro.conf.arg(name="from")] = ""
    """Folder of another run, its tuned.toml, or the name of a shipped file (configs/tuned): its parameters in place of the defaults."""
    out: Path | None = None
    """Folder of the run; runs/tune-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {section: {row: {value, unit}}}; other sections in it are kept."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    slices: int = 4
    """With figures: slices of loss and score through the tuned point, for up to this many parameters; 0: none."""
    overwrite: bool = False
    """Replace another run in the folder."""
    list: bool = False
    """List all parameters and losses and exit."""


def reduced(config: TuneConfig) -> TuneConfig:
    """The options of a quick run."""
    return replace(
        config, steps=min(config.steps, 3), scenes=config.scenes[:1], people=config.people[:1], seeds=config.seeds[:1], starts=1,
        held_out_scenes=config.held_out_scenes[:1], held_out_people=config.held_out_people[:1],
        held_out_seeds=config.held_out_seeds[:1], batch=1, every=1, slices=0,
    )  # fmt: skip


def parse(argv: Sequence[str]) -> TuneConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(TuneConfig, argv, "tune", DESCRIPTION)
    return reduced(config) if config.quick else config
