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

* **Whether an object is lifted does not tell the ways apart**: all ways choose among thousands of pairs, what decides is the score's
  place and the free way, and a parallel gripper with a strong grip turns and shifts the object until it fits. What tells them
  apart is the error of the normals, and how far the closing axis is off the exact normals at the contacts (`true_angle`).
* `lifted_share_friction...` are the same grasps with more slippery pads, a hundred times the coefficient in the name. From
  0.15 on what has no parallel sides falls out (the frustum, whose sides lean by 9 degrees), whatever the normals.
* **Hessian and PCA**: on balls, cylinders and capsules the Hessian errs less, by a third or more in the median and by 30 to 60 % in the 95th
  percentile; on mug and frustum both are alike. On the flat faces of box, L and wedge the plane through 16 neighbours does, as it averages over more points, and over a flat face any average is right. Next to edges both are off by some 10 degrees; the Hessian's
  planarity refuses more places.
* The Hessian needs a field with exact weights, a length scale below the spacing of the points, and points of one layer. With lumped weights
  half of the flat places had planarities under 0.9; with single noisy images fused as they come, faces that the stationary cameras alone
  see had two layers of points and no usable place, and 4 objects of 50 no grasp, where the plane through neighbours still found some.
* By the stationary cameras alone (`--no-hand --poses 3`, 30 objects) 0.70 are lifted by the Hessian, 0.73 by the plane and 0.77 by the nearest
  point: the sides towards the arm are not seen, so that there are no two contacts. All that had a grasp by the first two were
  lifted.
"""


def page(rows: Mapping[str, Mapping[str, Any]], config: GraspConfig, figures: Sequence[str] = ()) -> str:
    """A Markdown page of the rows.

    Args:
        figures: their places from the page.
    """
    cameras = "seen by two stationary cameras" + ("\nand one in the hand from three sides" if config.hand else "")
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
