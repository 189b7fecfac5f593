"""The rows: value, unit, definition and bar of each."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.interact import KeepDistanceParams

from .bench import VARIANTS
from .measures import (
    JERK,
    LIMIT,
    Case,
    contacts,
    follow_measures,
    give_way_measures,
    hand_over_measures,
    keep_away_measures,
)

Rows = dict[str, dict[str, Any]]
BARS: dict[str, tuple[str, float]] = {
    "follow_error_fast_p50": ("<", 3.0), "follow_error_p50": ("<", 3.0), "follow_error_p95": ("<", 3.0), "handover_error": ("<=", 2.0),
    "handover_held": (">=", 0.95), "handover_error_contact": ("<=", 2.0), "handover_held_contact": (">=", 0.95),
    "yield_contacts": ("<=", 0.0), "resume_jump": ("<=", 1.0), "resume_acceleration_jump": ("<=", 1.0), "yield_done": (">=", 1.0),
}  # fmt: skip
"""Row -> what it should be."""
ENDS = {
    "": "", "_off": "; the function is off", "_close": "; at 0.45 m, in the red zone", "_near": "; at 0.05 m under speed and separation",
    "_contact": "; under power and force limiting, nearer",
}  # fmt: skip
"""End of a row -> what its variant is, in words."""
WORDS = {
    "runs": "runs with all variants of their function",
    "follow_error_p50": "median over all ticks after 4 s of the distance of the tool from its place beside the true hand",
    "follow_error_p95": "95th percentile of the same",
    "follow_error_fast_p50": "median over the ticks with a hand of 0.25 to 0.36 m/s",
    "follow_error_fast_p95": "95th percentile of the same",
    "follow_distance_p95": "95th percentile of the error of the distance alone",
    "follow_beyond": "share of these ticks in which the place beside the hand is beyond the reach that the function allows, 0.8 m from the base",
    "follow_separation": "least exact distance of the arm to the person",
    "handover_error": "largest of all hands: mean distance of the tool from its place beside the true hand, over the last 1.5 s of the offer",
    "handover_error_p50": "median of the same over hands",
    "handover_angle": "largest of all hands: mean angle of the tool's axis to the direction of the hand, over the same time",
    "handover_held": "least of all hands: share of the time within 2 cm, from when it is first reached to the hand's leaving; 0: never reached",
    "handover_reached": "median time at which the place is reached; the hand rests from 1.5 s on",
    "handover_withdrawn": "median time from the hand's first move to the arm's withdrawal",
    "handover_separation": "least exact distance of the arm to the person",
    "yield_contacts": "touches of the moving arm and the person",
    "yield_contacts_standing": "touches by a person who came to a standing arm",
    "yield_separation": "least exact distance of the arm to the person",
    "yield_separation_p50": "median over runs of the least distance in a run",
    "resume_jump": f"largest step of the tool's velocity in a tick on ways back from the refuge, but where the safety layer has the say, over that of the path clock's acceleration, {LIMIT:g} m/s^2",
    "resume_acceleration_jump": f"largest step of its acceleration in a tick there, over that of the path clock's jerk, {JERK:g} m/s^3",
    "resume_limited_jump": "as resume_jump, where the safety layer has the say: it brakes at an image, or a limit of speed is reached",
    "resume_limited": "share of the ways back in which it has",
    "released_jump": "as resume_jump, within 1 s after the end of a stop of the safety layer, whatever the function does",
    "resumes": "resumes: ways back from the refuge",
    "yield_done": "share of the runs with a way back and nobody in the way for the last 8 s in which the task came to an end after it",
    "yield_turns": "mean number of ends of the task that were reached in a run",
    "yield_stopped": "mean time that the safety layer stopped the arm",
    "keep_away_least": "least exact distance of the last link to the person, of all runs",
    "keep_away_short_p95": "median over runs of the 95th percentile of what the distance falls short of the set one",
    "keep_away_share": "mean share of the time nearer than the set distance",
    "keep_away_back": "largest distance of the tool from its pose at the end of runs whose person is gone by then",
    "keep_away_contacts": "touches of arm and person",
    "keep_away_step": "largest change of the tool's velocity in a tick",
}  # fmt: skip
"""Row without its end -> what it measures."""


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
    for end in sorted(ENDS, key=len, reverse=True):
        if end and name.endswith(end) and name.removesuffix(end) in WORDS:
            return WORDS[name.removesuffix(end)] + ENDS[end]
    return WORDS.get(name, "")


def _over(found: Sequence[Mapping[str, float]], name: str, by: Callable[..., Any]) -> float:
    values = np.array([one[name] for one in found], float)
    values = values[np.isfinite(values)]
    return float(by(values)) if len(values) else math.nan


def follow_rows(name: str, cases: Sequence[Case], direction: NDArray, dt: float) -> Rows:
    """Of one variant of follow."""
    end = name.removeprefix("follow")
    found = [follow_measures(name, case, direction, dt) for case in cases]
    rows: Rows = {}
    for part, stem in (("error", "follow_error"), ("fast", "follow_error_fast")):
        values = 100 * np.concatenate([one[part] for one in found])
        for at in (50, 95):
            rows[f"{stem}_p{at}{end}"] = row(np.percentile(values, at) if len(values) else math.nan, "cm")
    rows[f"follow_distance_p95{end}"] = row(100 * np.percentile(np.concatenate([one["distance"] for one in found]), 95), "cm")  # fmt: skip
    rows[f"follow_beyond{end}"] = row(np.concatenate([one["beyond"] for one in found]).mean())
    rows[f"follow_separation{end}"] = row(min(case["separation_true"].min() for case in cases), "m")
    return rows


def hand_over_rows(name: str, cases: Sequence[Case], direction: NDArray, dt: float) -> Rows:
    """Of one variant of hand_over."""
    end = name.removeprefix("hand_over")
    found = [hand_over_measures(name, case, direction, dt) for case in cases]
    return {
        f"handover_error{end}": row(100 * _over(found, "error", np.max), "cm"),
        f"handover_error_p50{end}": row(100 * _over(found, "error", np.median), "cm"),
        f"handover_angle{end}": row(_over(found, "angle", np.max), "deg"),
        f"handover_held{end}": row(_over(found, "held", np.min)),
        f"handover_reached{end}": row(_over(found, "reached", np.median), "s"),
        f"handover_withdrawn{end}": row(_over(found, "withdrawn", np.median), "s"),
        f"handover_separation{end}": row(min(case["separation_true"].min() for case in cases), "m"),
    }


def give_way_rows(name: str, cases: Sequence[Case], ends: NDArray, dt: float) -> Rows:
    """Of one variant of give_way."""
    end = name.removeprefix("give_way")
    found = [give_way_measures(case, ends, dt) for case in cases]
    return {
        f"yield_contacts{end}": row(_over(found, "contacts", np.sum)),
        f"yield_contacts_standing{end}": row(_over(found, "contacts_standing", np.sum)),
        f"yield_separation{end}": row(_over(found, "separation", np.min), "m"),
        f"yield_separation_p50{end}": row(_over(found, "separation", np.median), "m"),
        f"resume_jump{end}": row(_over(found, "step", np.max) / (LIMIT * dt)),
        f"resume_acceleration_jump{end}": row(_over(found, "jump", np.max) / (JERK * dt)),
        f"resume_limited_jump{end}": row(_over(found, "limited_step", np.max) / (LIMIT * dt)),
        f"resume_limited{end}": row(_over(found, "limited", np.mean)),
        f"released_jump{end}": row(_over(found, "released_step", np.max) / (LIMIT * dt)),
        f"resumes{end}": row(_over(found, "resumes", np.sum)),
        f"yield_turns{end}": row(_over(found, "turns", np.mean)),
        f"yield_done{end}": row(_over(found, "done", np.mean)),
        f"yield_stopped{end}": row(_over(found, "stopped", np.mean), "s"),
    }


def keep_away_rows(name: str, cases: Sequence[Case], dt: float) -> Rows:
    """Of one variant of keep_away."""
    end = name.removeprefix("keep_away")
    found = [keep_away_measures(case, KeepDistanceParams().distance, dt) for case in cases]
    gone = [one for one in found if one["gone"]]
    return {
        f"keep_away_least{end}": row(_over(found, "least", np.min), "m"),
        f"keep_away_short_p95{end}": row(100 * _over(found, "short", np.median), "cm"),
        f"keep_away_share{end}": row(_over(found, "share", np.mean)),
        f"keep_away_back{end}": row(100 * _over(gone, "back", np.max), "cm"),
        f"keep_away_contacts{end}": row(_over(found, "contacts", np.sum)),
        f"keep_away_step{end}": row(_over(found, "step", np.max), "m/s"),
    }


def all_rows(
    cases: Mapping[str, Mapping[str, Case]], directions: Mapping[str, NDArray], ends: NDArray, dt: float
) -> Rows:
    """All rows.

    Args:
        cases: by variant, then by run.
        directions: from the hand to the tool, by variant [1].
        ends: (2 3) of the task [m].
    """
    rows: Rows = {"runs": row(sum(len(runs) for runs in cases.values()))}
    for name, runs in cases.items():
        some, function = list(runs.values()), VARIANTS[name].function
        if not some:
            continue
        if function == "follow":
            rows |= follow_rows(name, some, directions[name], dt)
        elif function == "hand_over":
            rows |= hand_over_rows(name, some, directions[name], dt)
        elif function == "give_way":
            rows |= give_way_rows(name, some, ends, dt)
        else:
            rows |= keep_away_rows(name, some, dt)
    return rows


def touched(case: Case) -> int:
    """Touches of arm and person in a run."""
    return sum(contacts(case))
