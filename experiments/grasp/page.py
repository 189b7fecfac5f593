"""The page of the rows, as Markdown."""

from collections.abc import Mapping, Sequence
from typing import Any

from .config import GraspConfig
from .rows import BARS, definition, holds

HEAD = """# Grasps from noisy depth

Written by `python -m experiments.grasp --json FILE --page FILE`; do not edit. `--help` explains every option.

Ten shapes of household size ({poses} poses each, seed {seed}) on a table before a UR5, {cameras}, with the D435i's noise. The median of {frames}
images from every place is fused into a map of 6 mm. Its points have normals in three ways:

* **Hessian**: the eigenvector of the most negative eigenvalue of the Hessian of a Gaussian-process field with exact weights and a
  length scale of 5.5 mm (HRI 2025); usable from a planarity of 0.9 on.
* **PCA**: of the plane through 16 neighbours; usable where the least variance is under a tenth of the middle one.
* **nearest**: from the nearest point, read 18 mm off the surface, where it errs least; it knows no planarity.

From there on all is the same: pairs within the stroke of 85 mm whose closing axis lies within both cones of friction (0.5), scored by
cone, planarity, nearness to the object's middle and steepness; approaches whose fingers and palm stay 3 mm off object and table by
the field; the best of 16 that the arm's inverse kinematics reach, with the begin of the approach. Arm motion is not part of it.
A gripper with box fingers (40 N each, pads with a friction of {friction:g}) then grasps in C MuJoCo: nothing but contact and friction
holds the object. Objects weigh 500 kg/m^3.
"""
READ = """
## How to read it

Whether an object is lifted hardly tells the ways apart: a parallel gripper with rubber pads turns and shifts the object until it fits. What
tells them apart is how far the closing axis is off the exact normals at the contacts (`true_angle`), and what slippery pads still lift
(`lifted_share_friction...`: the same grasps, pads with that coefficient times 100). The Hessian rates fewer places as usable than the plane does,
and errs less at them on curved shapes; on flat faces the plane through 16 points errs least, as it averages more of them.
"""


def page(rows: Mapping[str, Mapping[str, Any]], config: GraspConfig, figures: Sequence[str] = ()) -> str:
    """A Markdown page of the rows.

    Args:
        figures: their places from the page.
    """
    cameras = "seen by two stationary cameras" + (" and one in the hand from three sides" if config.hand else "")
    text = HEAD.format(poses=config.poses, seed=config.seed, cameras=cameras, frames=config.frames, friction=config.friction)  # fmt: skip
    lines = ["| row | value | unit | bar | what it measures |", "|---|---|---|---|---|"]
    for name, entry in rows.items():
        bar = f">= {BARS[name]:g}" if name in BARS else ""
        missed = " (missed)" if holds(name, entry["value"]) is False else ""
        lines.append(f"| {name} | {entry['value']:.3g} | {entry['unit']} | {bar}{missed} | {definition(name)} |")
    text += "\n" + "\n".join(lines) + "\n" + READ
    if figures:
        text += "\n" + "\n".join(f"![{name}]({name})" for name in figures) + "\n"
    return text
