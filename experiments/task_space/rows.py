"""The rows: value, unit, definition and bar of each."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.case_store import Case

from .measures import LEAST_SEEN

Rows = dict[str, dict[str, Any]]
BARS: dict[str, tuple[str, float]] = {
    "found": (">=", 95.0), "false": ("<", 2.0), "centre_mm": ("<", 10.0), "size_mm": ("<", 10.0), "covered": (">=", 100.0),
}  # fmt: skip
"""Row -> sign and bar."""
WORDS = {
    "tables": "random tables, of one to eight things",
    "things": "spheres, upright cylinders and turned boxes of 3 to 15 cm on them",
    "found": "share of things that an instance was given to, or that were covered with one that they touch",
    "found_seen": f"the same of things of which the cameras see at least {LEAST_SEEN} of 1500 points",
    "merged": "share of things that are found as one with a neighbour nearer than 2 cm",
    "false": "share of instances that belong to no thing",
    "centre_mm": "median distance of the centre of an instance from that of its thing",
    "centre_mm_p95": "95th percentile",
    "size_mm": "median over things of the largest error of a radius or half extent",
    "size_mm_p95": "95th percentile",
    "covered": "share of found things all of whose surface lies within the fitted shapes and 1 cm about them, the side that no camera saw too",
    "covered_seen": "the same, of the points that a camera saw",
    "covered_unseen": "the same, of the others",
    "covered_points": "mean share of the points of the surface of a found thing that are covered",
    "worst_mm_p95": "95th percentile over found things of the distance of the farthest point of the surface from the shapes",
    "kind": "share of matched things whose kind is right",
    "as_points": "share of matched things that are kept as points",
    "deviations": "median over things of the largest error of a coordinate of the centre over its standard deviation",
    "table_mm": "largest error of the table's height below the middle of the things",
    "table_deg": "largest error of its normal",
    "frame_s": "median time by the clock, whatever else the machine did, of mapping two mean images of 640 x 480 pixels, without taking and averaging them",
}
"""Row -> what it measures."""


def row(value: Any, unit: str = "1") -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def holds(name: str, value: float) -> bool | None:
    """Whether a row keeps its bar; None: it has none. What isn't a number keeps none."""
    if name not in BARS:
        return None
    sign, bar = BARS[name]
    return value < bar if sign == "<" else value >= bar


def together(cases: Sequence[Case], name: str) -> NDArray:
    """An array over the things of all tables."""
    return np.concatenate([case[name] for case in cases])


def share(of: NDArray) -> float:
    """Mean of shares, or share of true entries; NaN: there are none [%]."""
    return 100 * float(of.mean()) if len(of) else math.nan


def percentile(of: NDArray, at: float, factor: float = 1.0) -> float:
    """A percentile times a factor; NaN: there are no values."""
    return factor * float(np.percentile(of, at)) if len(of) else math.nan


def all_rows(cases: Sequence[Case]) -> Rows:
    """All rows, over the tables."""
    has = together(cases, "match") >= 0
    found = has | together(cases, "merged").astype(bool)
    seen = together(cases, "seen") >= LEAST_SEEN
    instances = sum(int(case["instances"]) for case in cases)
    kind, other = together(cases, "kind")[has], together(cases, "found_kind")[has]

    def whole(name: str) -> float:
        values = together(cases, name)[found]
        return share(values[np.isfinite(values)] >= 1)

    def over(name: str, at: float, factor: float = 1e3) -> float:
        return percentile(together(cases, name)[has], at, factor)

    middle = np.array([0.4, 0.5, 0.0])
    off = [abs(float(case["normal"] @ middle - case["offset"])) for case in cases]
    tilt = [float(np.rad2deg(np.arccos(min(1.0, case["normal"][2])))) for case in cases]
    return {
        "tables": row(len(cases)), "things": row(len(found)),
        "found": row(share(found), "%"), "found_seen": row(share(found[seen]), "%"),
        "merged": row(share(found & ~has), "%"),
        "false": row(100 * sum(int(case["false"]) for case in cases) / max(instances, 1), "%"),
        "centre_mm": row(over("centre_error", 50), "mm"), "centre_mm_p95": row(over("centre_error", 95), "mm"),
        "size_mm": row(over("size_error", 50), "mm"), "size_mm_p95": row(over("size_error", 95), "mm"),
        "covered": row(whole("covered"), "%"), "covered_seen": row(whole("covered_seen"), "%"),
        "covered_unseen": row(whole("covered_unseen"), "%"),
        "covered_points": row(share(together(cases, "covered")[found]), "%"),
        "worst_mm_p95": row(percentile(together(cases, "worst")[found], 95, 1e3), "mm"),
        "kind": row(share(kind == other), "%"), "as_points": row(share(other == -1), "%"),
        "deviations": row(over("normalised_error", 50, 1.0)),
        "table_mm": row(1e3 * max(off), "mm"), "table_deg": row(max(tilt), "deg"),
        "frame_s": row(np.median([float(case["seconds"]) for case in cases]), "s"),
    }  # fmt: skip
