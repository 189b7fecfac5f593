"""Command-line options of the program."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hrcjax.lab.configs import parse_config

DESCRIPTION = """Grasp objects that noisy depth cameras see, and lift them by friction in C MuJoCo.

Ten shapes stand or lie on a table before the arm, in poses by chance. Two stationary cameras and one in the hand see them; the
images are fused into a map of 6 mm. Its points have normals in three ways:

  hessian    by the Hessian of the Gaussian-process field (HRI 2025), with its planarity
  pca        by the plane through 16 neighbours
  nearest    by the direction from the nearest point, read 18 mm off the surface

From there on all is the same: antipodal pairs within stroke and friction cone, approaches free of collision by the field, the best
that the arm reaches. To the grasps by the Hessian the arm moves by its policies. A two-finger gripper opens, goes there along the approach, closes, lifts 15 cm and holds for 1 s. An object counts
as lifted if its centre rose by more than 10 cm and both fingers still hold it. Every object is stored as it comes: an interrupted
run is resumed by the same command.

Examples:

  Three shapes in one pose each:
    python -m experiments.grasp --quick

  All, with rows in a file and a page:
    python -m experiments.grasp --json grasp.json --page docs/grasp.md

  By the stationary cameras alone, all rows, with pads as slippery as metal:
    python -m experiments.grasp --no-hand --friction 0.3

  Only the mug and the wedge, 20 poses each:
    python -m experiments.grasp --shapes mug wedge --poses 20"""


@dataclass(frozen=True)
class GraspConfig:
    """Grasp objects that noisy depth cameras see."""

    config: str = "standard"
    """Named settings: standard, or a TOML file of options. Other options on the command line override them."""
    shapes: tuple[str, ...] = ()
    """Shapes; none named: all. box, cylinder, lying_cylinder, ball, capsule, frustum, l_shape, mug, hexagon, wedge."""
    poses: int = 5
    """Poses of each shape."""
    seed: int = 7
    """Seed of poses and noise; numbers of the method were chosen with 0."""
    hand: bool = True
    """Whether the camera in the hand looks too, from three sides; the rows `_fixed` are without it in any case."""
    frames: int = 16
    """Images of every camera from every place, about 1 s; their median is fused."""
    friction: float = 0.8
    """Coefficient of friction of the pads."""
    slippery: tuple[float, ...] = (0.3, 0.15)
    """Further coefficients of friction, at which the same grasps are tried again."""
    quick: bool = False
    """Three shapes in one pose each, one further coefficient of friction."""
    out: Path | None = None
    """Folder of the run; runs/grasp-FINGERPRINT if not given, so that the same command resumes."""
    json: Path | None = None
    """Output file {"grasp": {row: {value, unit}}}; other sections in it are kept."""
    page: Path | None = None
    """Output file for a Markdown page of the rows; its figures go into the folder `figures` beside it."""
    figures: bool = True
    """Draw figures and the animation of one lift (GIF) into the folder at the end."""
    overwrite: bool = False
    """Replace another run in the folder."""


def reduced(config: GraspConfig) -> GraspConfig:
    """The options of a quick run."""
    return replace(config, shapes=config.shapes[:3] or ("box", "ball", "mug"), poses=1, slippery=config.slippery[:1])


def parse(argv: Sequence[str]) -> GraspConfig:
    """The settings from the command line.

    Raises:
        UsageError: an unknown option or config, a value of the wrong type.
        SystemExit: with status 0 after --help.
    """
    config = parse_config(GraspConfig, argv, "grasp", DESCRIPTION)
    return reduced(config) if config.quick else config
