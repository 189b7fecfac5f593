"""The page of the rows, as Markdown."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hrcjax.lab.case_store import Case

from .config import FRESH, TaskSpaceConfig
from .measures import COVER, TOUCH
from .rows import BARS, WORDS, holds
from .tables import LARGE, SMALL, TOUCHING

HEAD = """# Task-space mapping

Written by `{command}`; do not edit. `--help` explains every option.

The Robotica paper's perception (section 2.2, figure 4): obstacles of a task space from RGB-D images, once, before the task. Depth images
of a still table come in; out come the table's plane, every thing on it as a sphere, an upright column or an upright box, with standard
deviations, or kept as points, and the paper's grid of 1 (obstacle) and 0 (free) in metres (`hrcjax/task_space`):

1. **Mean images.** Several images of one camera are averaged, pixel by pixel, about the median.
2. **The table** is the highest large plane: points whose own normals agree with it vote, then least squares with Cauchy weights. Its
   residual says whether the noise is larger than assumed; all deviations are scaled by that.
3. **Things** are what is above it, and what hangs together with that beyond its border, if it ends within 30 cm: pixels that hang together in an image without a step in depth, and within one box or mask of a detector
   if there is one (`Segmenter`: any function from a colour image to boxes, masks, names); parts of several images are one thing where they
   share cells of a grid of 1 cm.
4. **Shapes.** Sphere, column and box are fitted by damped least squares. Residuals are the distances of the points from the surface, and how
   deep every ray along which something behind was seen would pass through the shape. The kind with the least sum, plus log n for every free
   number, is taken. So a shape is chosen by residual and by the free space that it would claim.
5. **Things that touch** hang together; a group that no shape explains is cut where it is thinnest from above, or between points on and off the
   best shape, and kept as two if two explain it better. A shape does not explain a group if its points are farther from the surface than their noise
   across that surface makes them, if it claims free rays, if pixels are not of the surface, or if it leaves out what was measured. Solids do not
   pass through each other: two parts whose shapes do are one thing, where one shape explains both, and a thing whose shape passes through another's,
   and most of whose points lie on that one's surface, hands them over.
6. **No thing is smaller than what was measured of it.** A shape leaves out the distance by which most pixels of some neighbourhood of 5 x 5 are
   outside of it, beyond their noise, and the height at which it ends over the table under which nothing was seen to pass. A thing whose shape
   leaves out more than 1 cm, has a residual over 1 cm, or claims more than a tenth of the free rays about it, is kept as points; the planner takes the
   upright box about all of them, down to the table where nothing was seen to pass below, and the grid the points.
"""
EVALUATION = """
## Measured on random tables

{tables:.0f} tables of one to eight spheres, upright cylinders and boxes turned about the vertical, every edge, height and diameter between {small:.0f} and
{large:.0f} cm, at least 2 mm apart; in every {touching}th the second is put that near to the first. Two D435i as in the cell (`hrcjax/sense/rig.py`), 1.2 m
beside, 0.7 m before and 1.5 m above, 640 x 480 pixels, with the noise model of `hrcjax/sense/noise.py`: 14 mm at 1.8 m in a pixel of one
image; {images} images each. The noise of pixels and images is independent in that model; a real stereo camera has errors that averaging does not
remove.

Truth are the exact shapes. A thing is found if an instance is given to it (one to one, least sum of distances) whose centre lies within the
radius of the ball, or of the upright cylinder, about the thing; or if it is nearer than {touch:.0f} cm to another and one instance covers 99 in 100
of its points with it. An instance that belongs to none is false. Covered is a thing all of whose 1500 surface points, also those that no
camera saw and those on the table, lie within a shape or {cover:.0f} cm about it. A thing that a neighbour hides from both cameras counts as not found.

Tables 0 to 99, 176, 1000 to 1199, 2000 to 2099 and 3000 to 3099, and some from 10000 on, were looked at while the mapping was made, so that figures of these tables
alone say little of new ones. Nobody had looked at the tables from {fresh} to 9999 when these numbers were measured{what}.

{rows}

{missed}
"""


def row_table(rows: Mapping[str, Mapping[str, Any]], fresh: Mapping[str, Mapping[str, Any]] | None = None) -> str:
    """All rows with bars.

    Args:
        fresh: the same of the tables that nobody has looked at; none: no column of theirs.
    """
    sets = [rows, fresh] if fresh else [rows]
    heads = ["row", "value", *([f"tables from {FRESH} on"] if fresh else []), "unit", "bar", "what it measures"]
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    for name, entry in rows.items():
        found = [one[name]["value"] for one in sets]
        kept = all(holds(name, value) for value in found)
        bar = "" if name not in BARS else f"{BARS[name][0]} {BARS[name][1]:g}" + ("" if kept else " (missed)")
        values = " | ".join("-" if math.isnan(value) else f"{value:.3g}" for value in found)
        lines.append(f"| {name} | {values} | {entry['unit']} | {bar} | {WORDS[name]} |")
    return "\n".join(lines)


def missed_table(numbered: Sequence[tuple[int, Case]]) -> str:
    """Things that were not found, and those that were not covered whole, with the numbers of their tables."""
    names = ("sphere", "column", "box")
    lines = []
    for k, case in numbered:
        for i in range(len(case["kind"])):
            found = case["match"][i] >= 0 or case["merged"][i]
            if found and case["covered"][i] >= 1:
                continue
            size = " x ".join(f"{200 * v:.0f}" for v in case["size"][i])
            what = (
                f"{100 * case['covered'][i]:.0f} % covered, worst {1e3 * case['worst'][i]:.0f} mm"
                if found
                else "not found"
            )
            lines.append(
                f"| {k} | {names[int(case['kind'][i])]} | {size} | {1e3 * case['gap'][i]:.0f} | {int(case['seen'][i])} | {what} |"
            )
        lines += [f"| {k} | false | | | | at {', '.join(f'{v:.2f}' for v in at)} m |" for at in np.atleast_2d(case["false_center"]) if at.size]  # fmt: skip
    if not lines:
        return "Every thing was found and covered, and no instance was false."
    head = ["Not found, not covered whole, or false:", "", "| table | kind | size [cm] | gap to the next [mm] | points seen of 1500 | what |", "|---|---|---|---|---|---|"]  # fmt: skip
    return "\n".join([*head, *lines])


def page(
    rows: Mapping[str, Mapping[str, Any]], cases: Sequence[Case], config: TaskSpaceConfig, figures: Sequence[str], frames: str,
    fresh: Mapping[str, Mapping[str, Any]] | None = None, others: Sequence[Case] = (),
) -> str:  # fmt: skip
    """A Markdown page.

    Args:
        figures: of the tables, their places from the page.
        frames: the part about recorded frames; "" if there are none.
        fresh: rows of the tables that nobody has looked at.
        others: and their measures.
    """
    text = HEAD.format(command=config.command())
    if cases:
        numbered = [*zip(config.numbers, cases, strict=False), *zip(config.fresh_numbers, others, strict=False)]
        what = f": {len(others)} of them have a column of their own" if others else ""
        text += EVALUATION.format(
            tables=len(cases), small=100 * SMALL, large=100 * LARGE, touching=TOUCHING, images=config.images, touch=100 * TOUCH,
            cover=100 * COVER, rows=row_table(rows, fresh), missed=missed_table(numbered),
            fresh=FRESH, what=what,
        )  # fmt: skip
        text += "\n" + "\n\n".join(f"![{name}]({name})" for name in figures) + "\n"
    return text + frames
