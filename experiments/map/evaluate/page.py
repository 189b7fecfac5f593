"""`python -m experiments.map.evaluate.page [ROWS.json] > docs/map-evaluation.md`: the page of the evaluation from its rows."""

import json
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hrcjax.lab.compiled import keep_compiled

from .published import COW_AND_LADY, RESOLUTIONS
from .rows import Rows

PROTOCOL = """# Accuracy of a map

```
python -m experiments.map --evaluate [--json]
```

prints the rows below; this page was written by `python -m experiments.map.evaluate.page` from one such run (single precision,
one core of a shared x86-64 machine, 2.5 cm spacing, default parameters).

## Protocol

* **Worlds.** Five families with exact distances in closed form: boxes, columns and spheres on a table (`clutter`, 3 seeds); the
  Robotica paper's obstacles (`robotica`: columns, spheres of 3 and of 12 cm); spheres, capsules and tori of 4 to 15 cm
  (`smooth`, 2 seeds); a corner of two walls with shelves and a gap of 6 to 9 cm (`shelf`, 2 seeds); a person who reaches over
  a table, or works at it (`person`).
* **Images.** 24 of 640 x 480 pixels for each world, with exact poses and the errors of a D435i as `hrcjax.sense` simulates
  them: disparity noise, quantisation to 1 mm, flying pixels, holes in the stereo shadow, range limits. All methods get the same
  images.
* **Held-out queries.** Drawn uniformly in a box around the bodies, outside all solids, within 30 cm of the nearest surface, 4,096
  for each world. A query counts if the nearest point of the exact surface was observed by at least 3 images: visible in the
  exact depth image (within 1 cm, at its pixel or a neighbour), at an incidence angle below 78 degrees, with a measurement
  there. All methods get the same queries.
* **Far away.** 256 queries in each of seven bands from 0.2 to 3 m for each world, drawn in the box enlarged by the distance, also
  outside of the mapped box; the nearest surface lies within it and was observed as above.
* **Other methods.** Distance to the nearest point (a k-d tree) and the Euclidean distance transform of the 2.5 cm voxels that
  hold a point, interpolated between voxel centres. Each gets (a) the map's own points, (b) one of the measured pixels of each
  voxel, drawn at random, (c) the same without pixels that fewer than 2 of 4 neighbours support and without voxels that hold
  fewer than 16 pixels of all images. The result of (b) is dominated by flying pixels.
* **Jumps.** 24 lines of 30 cm for each family in steps of 0.5 mm: change of the distance less the mean of the slopes at both
  ends times the step. The 64 steps with the largest residuals are halved to 8 micrometres; what remains is a jump.
* **Change.** A box of 16 cm moves by 25 cm between two frames. Stale: its old points, more than 4 cm off all surfaces of
  the new scene, where the exact image is at least 10 cm deeper. New: voxels of the new position with at least 16 pixels in view.
  Noisy: every pose is off by 5 mm and 0.3 degrees in random directions. Eaten: points of surfaces that did not move, without a
  point within a voxel's edge afterwards. A person walks between camera and table for 12 frames; hidden: points occluded in some exact image.
* **Surfaces.** Samples of analytic bodies, one point in each voxel, 2 mm of noise on each coordinate or none; radii in
  millimetres in the names. Curvature errors are relative to the larger principal curvature. On the map: round bodies of a `smooth`
  world, where the length scale (2 spacings) can resolve them, R > 8.7 cm.
* **Recorded frames.** Four of five RGB-D frames (the pose of the first one is wrong): the map of three, queried at those points
  of the fourth that one of the three could have measured.

## Measured
"""

PUBLISHED = """
## Published results of other systems

Cow and Lady sequence, distance RMSE in cm and cosine of the gradient by grid resolution. The protocol differs: a recorded room
with a laser scan as truth, errors of poses included, all of the observed volume. The numbers give the order of magnitude; they are not a ranking.
"""


REMARKS = """
## Targets that are not met, and why

* **Cosine.** Two kinds of queries cause nearly all of the error. Within 2 cm of a surface, above all
  in a corner, a voxel's point is the mean of points of both faces. Near the medial axis between two surfaces, 8 to 14 % of the queries, the exact gradient reverses within a few
  millimetres, and a map with one point per voxel reverses it elsewhere. All other queries (`settled_cosine`) meet the target.
  Noise is not the cause: with every point moved to the exact surface (`cosine_exact_points`) the target would still be missed.
  The uncorrected gradient of `map_distance_and_gradient` has the better direction from 1 cm on; the derivative of the corrected
  `map_distance` is consistent with its value. A policy that needs a direction should use the uncorrected one.
* **Bound.** On smooth bodies it is conservative (coverage over 0.99): its sampling term is meant for worlds with edges, and the
  spread of the points around a query does not distinguish a round body from a sharp edge. Its constants were chosen on other
  seeds of the same families, by the coverage there. It over-estimates most often where few images observed the nearest
  surface, at edges, and where a surface has gaps between its points.
* **Curvature on a map** is within 1 or 2 % in the median, and wrong by far in 5 % of the points, probably near the border of the
  observed surface or close to another body, where the neighbouring points are not a sample of one surface; not all of these are
  refused.
"""


def held(value: float, bar: str) -> bool | None:
    """Whether a value meets a target such as "< 3", ">= 0.95" or "0.93 to 0.99"; None: the target is in words."""
    words = bar.split(",")[0].split()
    if len(words) == 3 and words[1] == "to":
        return float(words[0]) <= value <= float(words[2])
    if len(words) == 2 and words[0] in ("<", ">", ">="):
        limit = float(words[1])
        return value < limit if words[0] == "<" else value > limit or (words[0] == ">=" and value == limit)
    return value == float(words[0]) if len(words) == 1 else None


def page(rows: Rows | Mapping[str, Mapping[str, Any]], remarks: str = REMARKS) -> str:
    """The page as text."""
    lines = [PROTOCOL, "| row | measured | unit | target | met |", "|---|---|---|---|---|"]
    for name, entry in rows.items():
        bar, value = entry["bar"], entry["value"]
        kept = None if bar is None or not math.isfinite(value) else held(value, bar)
        mark = "-" if kept is None else "yes" if kept else "**no**"
        lines.append(f"| {name} | {value:.4g} | {entry['unit']} | {bar or '-'} | {mark} |")
    head = " | ".join(f"{cm:g} cm" for cm in RESOLUTIONS)
    lines += [PUBLISHED, f"| system | {head} |", "|---|" + "---|" * len(RESOLUTIONS)]
    for system, figures in COW_AND_LADY.items():
        lines.append(f"| {system} | " + " | ".join(f"{rmse:g} / {cosine:.2f}" for rmse, cosine in figures) + " |")
    return "\n".join(lines) + "\n" + remarks


def main() -> None:
    """Prints the page of a file of rows, or of a new run."""
    if len(sys.argv) > 1:
        rows = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    else:
        from .report import run_evaluation  # a run takes minutes; a file does not need it

        keep_compiled()
        rows = run_evaluation()
    print(page(rows), end="")


if __name__ == "__main__":
    main()
