"""Rows of the program: errors of places, what they consist of, coverage, choices and refusals."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.sim import PLACE_REASONS, describe_place

from .trials import AGAIN

Case = dict[str, NDArray]
Rows = dict[str, dict[str, Any]]
NEAR_ONE = (0.8, 1.2)
"""Ways to a place that count as a metre [m]."""
QUICK = 0.2
"""A hand that passes is at least so fast; slower ones are rows of their own [m/s]."""
POINTS_AT = ("tip", "finger", "arm")
"""Kinds of trials with a place."""
BARS: dict[str, tuple[str, float]] = {
    "tip_p50": ("<", 1.5), "ray_p50_1m": ("<", 5.0), "found_share": (">=", 0.98), "away_found": ("<=", 0.02),
    "through_choice": ("<=", 0.02), "through_choice_slow": ("<=", 0.02), "coverage": (">=", 0.9), "held_share": (">=", 0.95),
}  # fmt: skip
"""Row -> what it should be."""
ERROR = "distance of the place found from the true one"
CHANGED = {
    "fresh": "with errors of the landmarks that are new in every image",
    "wide": "in images in which what is near is wider by a pixel to each side",
    "thick": "of fingers 20 % thicker than the method is told",
    "thin": "of fingers 20 % thinner than it is told",
    "noisy": "with errors of landmarks and depths 1.5 times as large as it is told",
}
"""Kind of `AGAIN` -> what is other than in `finger`."""
WORDS = {
    "trials": "trials of all kinds",
    "tip_p50": f"median {ERROR}, finger on a surface",
    "tip_p95": "95th percentile of the same",
    "tip_landmark_p50": "median distance of the tip itself from the true tip",
    "tip_exact_p50": "the tip as found, by the exact shapes",
    "tip_true_p50": "the true tip by the map: what the map costs",
    "tip_world_p50": "the tip of the detector's model in space",
    "ray_p50_1m": f"median {ERROR}, along the index finger, surfaces at 0.8 to 1.2 m",
    "ray_p95_1m": "95th percentile of the same",
    "ray_table_p50_1m": "the median for what lies on the table's top alone",
    "ray_same_p50_1m": "the median of trials whose place lies on the solid that was meant",
    "ray_across_p50_1m": "median distance of the true place from the line found: the angle's part, without the slope of the surface",
    "ray_angle_p50": "median angle between the line found and the true one, all ways",
    "ray_exact_p50_1m": "the line as found, by the exact shapes: what the landmarks cost",
    "ray_true_p50_1m": "the true line by the map: what the map costs",
    "ray_marks_p50_1m": "by the finger's four landmarks alone, without the pixels of the finger",
    "ray_marks_angle_p50": "median angle of these lines, all ways",
    "bound_marks_p50_1m": "least median that an unbiased estimate from the landmarks in both images can have (Cramer and Rao)",
    "bound_depths_p50_1m": "the same with the depths of all pixels between base and tip, as if nothing hid them; the outline, which has no such bound, left out",
    "arm_finger_angle_p50": "median angle between the finger and the line from shoulder to wrist, of the same people: what the arm could tell of the finger",
    "ray_world_p50_1m": "the line of the detector's model in space, from the wrist's depth",
    "ray_world_found_1m": "share of those lines that meet anything",
    "ray_p50_near": f"median {ERROR}, along the index finger, surfaces at 0.3 to 0.6 m",
    "ray_marks_share": "share of fingers held whose line is that of the landmarks alone, as their pixels contradict these",
    "ray_other_share": "share of fingers whose place lies on another solid than was meant, all ways",
    **{
        f"{kind}_{name}": words
        for kind, first in CHANGED.items()
        for name, words in (
            ("p50_1m", f"ray_p50_1m {first}"), ("across_p50_1m", "ray_across_p50_1m of these"), ("angle_p50", "ray_angle_p50 of these"),
            ("told_p50_1m", "told_p50_1m of these"), ("coverage", "coverage of these"), ("marks_share", "ray_marks_share of these"),
        )
    },
    "arm_p50_1m": f"median {ERROR}, along the arm, surfaces at 0.8 to 1.2 m from the wrist",
    "arm_p95_1m": "95th percentile of the same",
    "arm_angle_p50": "median angle between the line found and the true one, all ways",
    "arm_exact_p50_1m": "the line as found, by the exact shapes",
    "arm_true_p50_1m": "the true line by the map",
    "held_share": "share of hands held still that are held for the dwell within the images",
    "held_time": "median time to the choice",
    "found_share": "share of held lines that meet a surface; tip, finger, arm",
    "coverage": "share of true places within two standard deviations along the worst direction told; tip, finger, arm",
    "coverage_exact": "the same by the exact shapes: the covariance is the line's, and does not know how far the map is off",
    "coverage_same": "the same of places on the solid that was meant",
    "coverage_tip": "of tips", "coverage_finger": "of fingers", "coverage_arm": "of arms",
    "told_p50_1m": "median standard deviation along the worst direction, fingers at 0.8 to 1.2 m",
    "away_found": "share of fingers that point at nothing, for which a surface is found",
    "through_choice": f"share of hands that pass at {QUICK:g} m/s or more and choose a place",
    "through_choice_slow": f"share of hands that pass at 0.1 to {QUICK:g} m/s and choose a place",
    "refused_away": "share of fingers that point at nothing, refused for that reason",
    "refused_share": "share of held lines whose place is refused for any reason; tip, finger, arm",
    "refused_true": "share that would be refused by the true line and the exact shapes",
    "verdict_right": "share of held lines with the same verdict, uncertain ones left out; tip, finger, arm",
}  # fmt: skip
"""Row -> what it measures."""
REASON_ROWS = {bit: f"refused_{name}" for bit, name in zip(PLACE_REASONS, ("nothing", "unsure", "no_room", "out_of_reach"), strict=True)}  # fmt: skip
"""Reason -> its row."""


def row(value: Any, unit: str = "1") -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def holds(name: str, value: float) -> bool | None:
    """Whether a row keeps its bar; None: it has none. What isn't a number keeps none."""
    if name not in BARS:
        return None
    sign, bar = BARS[name]
    return {"<": value < bar, "<=": value <= bar, ">=": value >= bar}[sign]


def definition(name: str) -> str:
    """What a row measures."""
    for bit, own in REASON_ROWS.items():
        if own == name:
            return f"share of held lines refused: {describe_place(bit)}; tip, finger, arm"
    return WORDS.get(name, "")


def together(cases: Sequence[Case]) -> Case:
    """The trials of several cases, one after the other; without what belongs to a scene, or differs in shape between kinds."""
    alike = [name for name in cases[0] if len({case[name].shape[1:] for case in cases}) == 1]
    names = [name for name in alike if not name.startswith("scene_")]
    return {name: np.concatenate([case[name] for case in cases]) for name in names}


def errors(case: Case, of: str = "map") -> NDArray:
    """(trial) Distance of the places of a kind from the true ones; no number where nothing was held or found [m]."""
    e = np.linalg.norm(case[f"{of}_place"] - case["place"], axis=1)
    return np.where(case["chosen"] & case[f"{of}_found"], e, np.nan)


def angles(case: Case) -> NDArray:
    """(trial) Between the line found and the true one; no number where nothing was held [rad]."""
    return _between(case["direction"], case["direction_found"], case["chosen"])


def _between(u: NDArray, v: NDArray, held: NDArray) -> NDArray:
    angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.sum(u * v, axis=1))
    return np.where(held, angle, np.nan)


def across(case: Case) -> NDArray:
    """(trial) Distance of the true place from the line found [m]."""
    way = case["place"] - case["tip_found"]
    u = case["direction_found"]
    aside = way - np.sum(way * u, axis=1, keepdims=True) * u
    return np.where(case["chosen"], np.linalg.norm(aside, axis=1), np.nan)


def told(case: Case, of: str = "map") -> tuple[NDArray, NDArray]:
    """(trial) Standard deviation along the worst direction told, and the error along it [m]."""
    values, axes = np.linalg.eigh(np.asarray(case[f"{of}_covariance"], float))
    along = np.abs(np.sum((case[f"{of}_place"] - case["place"]) * axes[:, :, -1], axis=1))
    there = case["chosen"] & case[f"{of}_found"]
    return np.where(there, np.sqrt(np.maximum(values[:, -1], 0)), np.nan), np.where(there, along, np.nan)


def covered(case: Case, of: str = "map") -> NDArray:
    """(trial) 1 where the true place is within two standard deviations, 0 where not; no number where there is none."""
    deviation, along = told(case, of)
    return np.where(np.isfinite(along), along <= 2 * deviation, np.nan)


def speeds(case: Case) -> NDArray:
    """(trial) [m/s]"""
    return np.linalg.norm(case["velocity"], axis=1)


def _at(values: NDArray, part: float) -> float:
    values = values[np.isfinite(values)]
    return float(np.percentile(values, part)) if len(values) else math.nan


def _mean(values: NDArray) -> float:
    values = values[np.isfinite(values)]
    return float(np.mean(values)) if len(values) else math.nan


def _metre(case: Case) -> NDArray:
    return (case["way"] >= NEAR_ONE[0]) & (case["way"] <= NEAR_ONE[1])


def tip_rows(case: Case) -> Rows:
    """Of fingers on a surface."""
    lost = np.linalg.norm(case["tip_found"] - case["line"][:, -1], axis=1)
    return {
        "tip_p50": row(100 * _at(errors(case), 50), "cm"),
        "tip_p95": row(100 * _at(errors(case), 95), "cm"),
        "tip_landmark_p50": row(100 * _at(np.where(case["chosen"], lost, np.nan), 50), "cm"),
        **{f"tip_{of}_p50": row(100 * _at(errors(case, of), 50), "cm") for of in ("exact", "true", "world")},
    }


def ray_rows(case: Case) -> Rows:
    """Of index fingers."""
    metre, same, flat = _metre(case), case["solid"] == case["solid_found"], case["place"][:, 2] < 1e-3
    held = case["chosen"] & case["map_found"]
    near = case["way"] < 0.6
    return {
        "ray_p50_1m": row(100 * _at(errors(case)[metre], 50), "cm"),
        "ray_p95_1m": row(100 * _at(errors(case)[metre], 95), "cm"),
        "ray_table_p50_1m": row(100 * _at(errors(case)[metre & flat], 50), "cm"),
        "ray_same_p50_1m": row(100 * _at(errors(case)[metre & same], 50), "cm"),
        "ray_across_p50_1m": row(100 * _at(across(case)[metre], 50), "cm"),
        "ray_angle_p50": row(math.degrees(_at(angles(case), 50)), "deg"),
        **{f"ray_{of}_p50_1m": row(100 * _at(errors(case, of)[metre], 50), "cm") for of in ("exact", "true", "marks")},
        "ray_marks_angle_p50": row(
            math.degrees(_at(_between(case["direction"], case["direction_marks"], case["chosen"]), 50)), "deg"
        ),
        **{
            f"bound_{of}_p50_1m": row(100 * _at(case[f"bound_{of}"][metre].ravel(), 50), "cm")
            for of in ("marks", "depths")
        },
        "arm_finger_angle_p50": row(
            math.degrees(_at(_between(case["direction"], case["wrist"] - case["shoulder"], case["chosen"]), 50)), "deg"
        ),
        "ray_world_p50_1m": row(100 * _at(errors(case, "world")[metre], 50), "cm"),
        "ray_world_found_1m": row(_mean(case["world_found"][metre].astype(float))),
        "ray_p50_near": row(100 * _at(errors(case)[near], 50), "cm"),
        "ray_marks_share": row(_by_marks(case)),
        "ray_other_share": row(_mean((~same)[held].astype(float))),
        "told_p50_1m": row(100 * _at(told(case)[0][metre], 50), "cm"),
    }


def _by_marks(case: Case) -> float:
    same = np.all(case["direction_found"] == case["direction_marks"], axis=1)
    return _mean(same[case["chosen"]].astype(float))


def again_rows(case: Case, kind: str) -> Rows:
    """Of the same index fingers under other conditions, `CHANGED`."""
    metre = _metre(case)
    return {
        f"{kind}_p50_1m": row(100 * _at(errors(case)[metre], 50), "cm"),
        f"{kind}_across_p50_1m": row(100 * _at(across(case)[metre], 50), "cm"),
        f"{kind}_angle_p50": row(math.degrees(_at(angles(case), 50)), "deg"),
        f"{kind}_told_p50_1m": row(100 * _at(told(case)[0][metre], 50), "cm"),
        f"{kind}_coverage": row(_mean(covered(case))),
        f"{kind}_marks_share": row(_by_marks(case)),
    }


def arm_rows(case: Case) -> Rows:
    """Of arms."""
    metre = _metre(case)
    return {
        "arm_p50_1m": row(100 * _at(errors(case)[metre], 50), "cm"),
        "arm_p95_1m": row(100 * _at(errors(case)[metre], 95), "cm"),
        "arm_angle_p50": row(math.degrees(_at(angles(case), 50)), "deg"),
        **{f"arm_{of}_p50_1m": row(100 * _at(errors(case, of)[metre], 50), "cm") for of in ("exact", "true")},
    }


def shared_rows(by_kind: Mapping[str, Case]) -> Rows:
    """Of all trials with a place: held, found, covered, refused."""
    case = together([by_kind[kind] for kind in POINTS_AT if kind in by_kind])
    held, same = case["chosen"], case["solid"] == case["solid_found"]
    sure = held & ((case["verdict"] & 2) == 0)
    rows: Rows = {
        "held_share": row(_mean(held.astype(float))),
        "held_time": row(_at(np.where(held, case["time"], np.nan), 50), "s"),
        "found_share": row(_mean(case["map_found"][held].astype(float))),
        "coverage": row(_mean(covered(case))),
        "coverage_exact": row(_mean(covered(case, "exact"))),
        "coverage_same": row(_mean(covered(case)[same])),
        **{f"coverage_{kind}": row(_mean(covered(by_kind[kind]))) for kind in POINTS_AT if kind in by_kind},
        "refused_share": row(_mean((case["verdict"] > 0)[held].astype(float))),
        "refused_true": row(_mean((case["verdict_true"] > 0)[held].astype(float))),
        "verdict_right": row(_mean((case["verdict"] == case["verdict_true"])[sure].astype(float))),
    }
    return rows | {name: row(_mean(((case["verdict"] & bit) > 0)[held].astype(float))) for bit, name in REASON_ROWS.items()}  # fmt: skip


def all_rows(by_kind: Mapping[str, Case]) -> Rows:
    """All rows of the kinds that were played."""
    rows: Rows = {"trials": row(sum(len(case["way"]) for case in by_kind.values()))}
    for kind, make in (("tip", tip_rows), ("finger", ray_rows)):
        rows |= make(by_kind[kind]) if kind in by_kind else {}
    for kind in AGAIN:
        rows |= again_rows(by_kind[kind], kind) if kind in by_kind else {}
    rows |= arm_rows(by_kind["arm"]) if "arm" in by_kind else {}
    rows |= shared_rows(by_kind) if any(kind in by_kind for kind in POINTS_AT) else {}
    if "away" in by_kind:
        case = by_kind["away"]
        held = case["chosen"]
        rows["away_found"] = row(_mean(case["map_found"][held].astype(float)))
        rows["refused_away"] = row(_mean(((case["verdict"] & 1) > 0)[held].astype(float)))
    if "through" in by_kind:
        case = by_kind["through"]
        quick = speeds(case) >= QUICK
        rows["through_choice"] = row(_mean(case["chosen"][quick].astype(float)))
        rows["through_choice_slow"] = row(_mean(case["chosen"][~quick].astype(float)))
    return rows
