"""The page of the rows, as Markdown."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from .config import GraspConfig
from .objects import NAMES
from .rows import BARS, definition, holds

HEAD = """# Grasps from noisy depth

Written by `python -m experiments.grasp --poses {poses} --seed {seed} --json FILE --page FILE`; do not edit. `--help` explains every option.

Ten shapes of household size ({poses} poses each, seed {seed}) on a table before a UR5, {cameras}, with the D435i's noise. The median of {frames}
images from every place is fused into a map of 6 mm. Its points have normals in three ways:

* **Hessian**: the eigenvector of the most negative eigenvalue of the Hessian of a Gaussian-process field with exact weights and a
  length scale of 5.5 mm (HRI 2025); usable from a planarity of 0.9 on.
* **PCA**: of the plane through 16 neighbours; usable where the least variance is under a tenth of the middle one.
* **nearest**: from the nearest point, read 18 mm off the surface, where it errs least; it knows no planarity.

From there on all is the same: pairs within the stroke of 85 mm whose closing axis lies within both cones of friction (0.5), scored by
cone, planarity, nearness to the object's middle and steepness; approaches whose fingers and palm stay 3 mm off object and table by
the field; the best of 16 that the arm's inverse kinematics reach, with the begin of the approach. Where the camera in the hand looks is
the middle of what the stationary ones saw. A gripper with box fingers (40 N each, pads with a friction of {friction:g}) then grasps in C MuJoCo: nothing
but contact and friction holds the object. Objects weigh 500 kg/m^3.

For the Hessian's grasps the arm goes there too: a UR5 with its own dynamics at 125 Hz, by the leaves of `hrcjax/grasp/motion_policy.py`, from home to the
begin of the approach along the straight line in joint space, and along the approach at 0.1 m/s, past what the map knows of the object and the table. Touching is judged by the exact
shapes. The gripper then lifts from where the arm arrived, having come the arm's way (rows `reach...`).

Numbers of the method (length scale, spacings, weights, where the nearest point is read, gains) were chosen on objects of seed 0.
"""


def _percent(rows: Mapping[str, Mapping[str, Any]], name: str) -> str:
    return " / ".join(f"{rows[name + end]['value']:.3g}" if name + end in rows else "-" for end in ("", "_pca", "_nearest"))  # fmt: skip


def _shapes(rows: Mapping[str, Mapping[str, Any]]) -> tuple[list[str], list[str]]:
    """Shapes on which the Hessian's normals err less in the median than the plane's, and all others."""
    less, more = [], []
    for shape in NAMES:
        own, other = (rows.get(f"normal_error_{shape}{end}") for end in ("", "_pca"))
        if own and other:
            (less if own["value"] < other["value"] else more).append(shape.replace("_", " "))
    return less, more


def reading(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """How to read the rows: sentences whose numbers are the rows'. Three numbers: Hessian / plane / nearest point."""
    less, more = _shapes(rows)
    lines = [
        f"**Whether an object is lifted hardly tells the ways apart**: {_percent(rows, 'lifted_share')}. All choose among thousands of pairs, and a "
        "parallel gripper with a strong grip forgives. More tells whether the closing axis lies within the cones of the exact "
        f"normals, of all grasps that a way offers (`antipodal_share`): {_percent(rows, 'antipodal_share')}; and the angle to them of the one that is "
        f"taken (`true_angle`): {_percent(rows, 'true_angle')} degrees.",
        f"**How hard an object can be pulled** (`pull`), in weights, in the median: {_percent(rows, 'pull')}; the tenth that bears least: "
        f"{_percent(rows, 'pull_p10')}. While the fingers closed objects turned by {_percent(rows, 'settled')} degrees in the median.",
        f"**Errors of the normals** (`normal_error`): {_percent(rows, 'normal_error')} degrees in the median. The Hessian errs less than the plane on "
        f"{', '.join(less) or 'no shape'}; not less on {', '.join(more) or 'no shape'}. Over a flat face any average is right, and the plane averages over "
        "more points; the Hessian's planarity refuses more places, next to edges above all. Noise is drawn anew for every image: "
        "what a camera gets wrong in all of them alike is not in it.",
        "`lifted_share_friction...` are the same grasps with more slippery pads, a hundred times the coefficient in the name.",
    ]  # fmt: skip
    if "found_share_fixed" in rows:
        lines.append(
            f"**By the stationary cameras alone** (`_fixed`) {_percent(rows, 'found_share_fixed')} have a grasp and {_percent(rows, 'lifted_share_fixed')} are lifted: "
            "the sides towards the arm are not seen, so that there may be no two contacts. Who refuses more places finds fewer grasps; of "
            f"those that were found {_percent(rows, 'lifted_of_found_fixed')} were lifted, and {_percent(rows, 'antipodal_share_fixed')} of all grasps lie within the exact cones."
        )  # fmt: skip
    if "reached" in rows:
        lines.append(
            f"**The arm comes to {rows['reached']['value']:.3g} of the grasps** within 5 mm and 3 degrees without touching; {rows['reach_lifted']['value']:.3g} are lifted from there."
        )  # fmt: skip
    return "\n## How to read it\n\nThree numbers in a row: Hessian / PCA / nearest.\n\n" + "".join(f"* {_wrapped(line)}\n" for line in lines)  # fmt: skip


def _wrapped(line: str) -> str:
    return "\n  ".join(textwrap.wrap(line, 128))


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
    text += "\n" + "\n".join(lines) + "\n" + reading(rows)
    if figures:
        text += "\n" + "\n".join(f"![{name}]({name})" for name in figures) + "\n"
    return text
