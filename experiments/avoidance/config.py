"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Measure how the arm avoids, over whole episodes of the closed loop against the exact geometry. Four sections:

  unknown_obstacle   an obstacle that the planner does not know stands on the path; the cameras saw it at the set-up
  hand_in_the_way    people reach into the path or pass by; the path may be left ("both") or not ("path")
  stop_retreat       while the arm is stopped for closeness: does it draw back where it can?
  knob_gradient      the derivative of the episode's loss by K_att, K_rep and zeta, against finite differences

Every episode is stored as it comes: an interrupted run is resumed by the same command.

Examples:

  A few scenes, people and settings:
    python -m experiments.avoidance --quick

  Obstacles alone, in a hundred scenes:
    python -m experiments.avoidance --sections unknown_obstacle --obstacles 100

  With two recorded people, rows to a file, and the page:
    python -m experiments.avoidance --people reach_in reach_and_stay a.bvh b.bvh --json avoidance.json --page avoidance.md"""

SECTIONS = ("unknown_obstacle", "hand_in_the_way", "stop_retreat", "knob_gradient")
PEOPLE = ("reach_in", "reach_and_stay", "pass_by", "stand_and_work")
LEAST = 1


@dataclass(frozen=True)
class AvoidanceConfig:
    """Measure how the arm avoids, over whole episodes against the exact geometry."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    cell: str = "ur5"
    """The cell: ur5, ur5e, ur5-reflected, ur5-body, or MODULE:FUNCTION that returns one of your own."""
    params: str = ""
    """Parameters in place of the cell's defaults: a file of tuned parameters, the folder of a tuning, or the name of a shipped file (configs/tuned)."""
    sections: tuple[str, ...] = SECTIONS
    """Sections: unknown_obstacle, hand_in_the_way, stop_retreat, knob_gradient."""
    obstacles: int = 60
    """Number of scenes with unknown obstacles, seeds from 0."""
    scenes: tuple[str, ...] = ("robotica", "hri")
    """Scenes in which people come: robotica, robotica-spheres, robotica-clearance, hri, clutter."""
    people: tuple[str, ...] = PEOPLE
    """People: names of motions (reach_in, reach_and_stay, pass_by, stand_and_work) or BVH files."""
    recordings: Path | None = None
    """Folder of BVH files that are added to the people."""
    seeds: int = 2
    """Number of seeds of people and of cluttered scenes, from 0."""
    gradients: int = 200
    """Number of random settings of K_att, K_rep and zeta."""
    quick: bool = False
    """At most 6 obstacles, one scene, two people, one seed, 8 gradients."""
    out: Path | None = None
    """Folder of the run; runs/avoidance-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {section: {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows, with what is measured."""
    figures: bool = True
    """Draw figures into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""


def reduced(config: AvoidanceConfig) -> AvoidanceConfig:
    """The options of a quick run."""
    return replace(
        config, obstacles=min(config.obstacles, 6), scenes=config.scenes[:1], people=config.people[:2], recordings=None,
        seeds=1, gradients=min(config.gradients, 8),
    )  # fmt: skip


def parse(argv: Sequence[str]) -> AvoidanceConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(AvoidanceConfig, argv, "avoidance", DESCRIPTION)
    return reduced(config) if config.quick else config
