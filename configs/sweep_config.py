"""What can be set on the command line of the sweep."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class SweepConfig:
    """Run the whole system for many settings of its parameters, and keep all results in one labelled file."""

    config: str = "paper"
    """Named settings to start from: paper, quick or people. Other options override them."""
    scene: tuple[str, ...] = ("robotica",)
    """Scenes: robotica, robotica-spheres, robotica-clearance, hri, clutter."""
    person: tuple[str, ...] = ("reach_in",)
    """People: names of motions (reach_in, pass_by, stand_and_work, nobody) or BVH files."""
    seed: tuple[int, ...] = (0,)
    """Seeds of the camera's noise, of the person's variation and of cluttered scenes."""
    grid: tuple[str, ...] = ("K_att=log:0.005:0.1:16", "K_rep=log:1e-6:1e-3:16", "zeta=lin:1.5:5:8")
    """Axes; they replace the default ones: NAME=lin:LOW:HIGH:COUNT, NAME=log:LOW:HIGH:COUNT or NAME=V1,V2,..."""
    sobol: int = 0
    """Number of Sobol samples inside the ranges of --grid; 0: all combinations."""
    sobol_seed: int = 0
    """Seed of the scrambling of the Sobol samples."""
    out: Path | None = None
    """Folder of the run; runs/sweep-SCENE-PERSON-FINGERPRINT if not given, so that the same command resumes."""
    quick: bool = False
    """At most 4 x 4 x 2 settings (or 16 samples)."""
    memory: float = 1000.0
    """Memory for the settings computed together [MB]. Fixes the size of chunks."""
    backend: Literal["folded", "mjx"] = "folded"
    """Dynamics of the arm: the fast folded model, or MuJoCo XLA."""
    by: str = ""
    """Metric that ranks the settings in the table; the score if not given."""
    best: int = 5
    """Rows of the table."""
    figures: bool = True
    """Draw the figures into the folder at the end."""
    overwrite: bool = False
    """Discard another run that is in the folder."""
    list: bool = False
    """Show all parameters that can be swept, and stop."""
