"""From stored cases to rows: shares and medians with intervals, planners in pairs, and the bars."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .intervals import Estimate, median, share

Case = Mapping[str, NDArray]
Rows = dict[str, dict[str, Any]]

LONGER, BENT = 1.01, 0.5
"""Length and bending energy over those of the best baseline that the bar allows [1]."""
UNSEEN = 5000
"""First seed of the scenes that were not looked at when the planners were chosen."""
BASELINES = ("gradient_descent", "plain_apf", "iapf", "rrt_star", "informed_rrt_star", "bfmt_star")
"""Planners that the bar compares with; the others are the library's optimiser."""
MINE = "multi_start"
MANY = (MINE, "multi_start_slack")
"""Planners that are held against the best baseline."""
UNITS = {
    "success": "1", "length": "m", "bending": "1/m", "clearance": "m", "travel": "s", "travel_jerk": "s", "planning": "s",
}  # fmt: skip
KEYS = {"length": "length", "bending": "bending", "clearance": "clearance", "travel": "optimal", "travel_jerk": "smooth", "planning": "seconds"}  # fmt: skip
"""Measure -> name in a stored case."""


def row(found: Estimate, unit: str) -> dict[str, Any]:
    """One row with its interval."""
    return {"value": found.value, "unit": unit, "low": found.low, "high": found.high, "scenes": found.scenes}


def columns(cases: Sequence[Case]) -> dict[str, NDArray]:
    """The numbers of one planner over the scenes, by name."""
    names = ("success", "claimed", "kept", "broken", "compile", *KEYS.values())
    return {name: np.array([float(case[name]) for case in cases]) for name in names}


def planner_rows(name: str, of: Mapping[str, NDArray]) -> Rows:
    """Success, and medians over the scenes in which the planner succeeds; planning time over all."""
    good = of["success"] > 0
    rows: Rows = {f"point_success_{name}": row(share(good), "1")}
    for measure, key in KEYS.items():
        x = of[key] if measure == "planning" else of[key][good]
        if not np.isnan(x).all():
            rows[f"point_{measure}_{name}"] = row(median(x[~np.isnan(x)]), UNITS[measure])
    rows[f"point_wrong_claim_{name}"] = {"value": float(np.mean((of["claimed"] > 0) & (of["kept"] == 0))), "unit": "1"}
    rows[f"point_stops_{name}"] = {"value": float(np.mean(of["broken"][good])) if good.any() else np.nan, "unit": "1"}
    if np.isfinite(of["compile"]).any():
        rows[f"point_compile_{name}"] = {"value": float(np.nanmax(of["compile"])), "unit": "s"}
    return rows


def pair_rows(name: str, mine: Mapping[str, NDArray], other: Mapping[str, NDArray]) -> Rows:
    """Ratios of `multi_start` to another planner, over the scenes in which both succeed."""
    both = (mine["success"] > 0) & (other["success"] > 0)
    rows: Rows = {}
    for measure in ("length", "bending", "travel", "travel_jerk"):
        a, b = mine[KEYS[measure]][both], other[KEYS[measure]][both]
        known = ~np.isnan(a) & ~np.isnan(b) & (b > 0)
        if known.any():
            rows[f"point_ratio_{measure}_{name}"] = row(median(a[known] / b[known]), "1")
    return rows


def best_rows(name: str, found: Mapping[str, Mapping[str, NDArray]], begin: str = "point_best") -> Rows:
    """A planner against the best baseline of every scene in which any succeeds; its own failure counts as a miss.

    The shortest baseline is often the tautest line. So there are two shares: with the bending energy of the shortest one, and,
    strictly, with the least of the baselines that are hardly longer than that, as the planner itself may be.
    """
    others = [found[other] for other in BASELINES if other in found]
    mine = found[name]
    lengths = np.stack([np.where(of["success"] > 0, of["length"], np.inf) for of in others])
    any_one = np.isfinite(lengths).any(axis=0)
    if not any_one.any():
        return {}
    shortest = lengths.min(axis=0)
    bends = np.stack([of["bending"] for of in others])
    of_shortest = bends[lengths.argmin(axis=0), np.arange(len(shortest))]
    least = np.where((lengths <= LONGER * shortest) & np.isfinite(lengths), bends, np.inf).min(axis=0)
    ok = mine["success"] > 0
    short = (ok & (mine["length"] <= LONGER * shortest))[any_one]
    straight, straighter = ((ok & (mine["bending"] <= BENT * bend))[any_one] for bend in (of_shortest, least))
    return {
        f"{begin}_share_{name}": row(share(short & straight), "1"),
        f"{begin}_share_strict_{name}": row(share(short & straighter), "1"),
        f"{begin}_length_share_{name}": row(share(short), "1"),
        f"{begin}_bending_share_{name}": row(share(straight), "1"),
    }


def unseen_rows(cases: Mapping[str, Sequence[Case]]) -> Rows:
    """Shares in the scenes of other seeds."""
    found = {name: columns(some) for name, some in cases.items()}
    rows: Rows = {"point_unseen_scenes": {"value": float(len(next(iter(found.values()))["success"])), "unit": "scenes"}}
    for name in MANY:
        if name in found:
            rows[f"point_unseen_success_{name}"] = row(share(found[name]["success"] > 0), "1")
            rows |= best_rows(name, found, "point_unseen")
    return rows


def point_rows(cases: Mapping[str, Sequence[Case]], rejected: Mapping[str, int]) -> Rows:
    """All rows; cases by planner, in the same order of scenes."""
    found = {name: columns(some) for name, some in cases.items()}
    rows: Rows = {"point_scenes": {"value": float(len(next(iter(found.values()))["success"])), "unit": "scenes"}}
    for reason, count in rejected.items():
        rows[f"point_rejected_{'_'.join(reason.split())}"] = {"value": float(count), "unit": "scenes"}
    for name, of in found.items():
        rows |= planner_rows(name, of)
    if MINE in found:
        for name, of in found.items():
            if name != MINE:
                rows |= pair_rows(name, found[MINE], of)
    if any(name in found for name in BASELINES):
        for name in MANY:
            if name in found:
                rows |= best_rows(name, found)
    return rows
