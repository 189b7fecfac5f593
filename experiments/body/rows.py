"""The rows: value, unit, definition and bar of each."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.body import BodyParams
from hrcjax.body.state import settled
from hrcjax.lab.case_store import Case

from .truth import ASSUMED

Rows = dict[str, dict[str, Any]]
Cases = Mapping[str, Mapping[str, Case]]
"""Tracker -> person -> what is measured."""

BARS = {
    "visible_error_p50": ("<", 25.0), "visible_error_p95": ("<", 60.0), "region_right": (">=", 0.95), "exchanges": ("<=", 0.0), "exchanges_sure": ("<=", 0.0),
    "unnoticed_frames_max": ("<=", 3.0), "frame_ms_p50": ("<", 8.0), "frame_ms_p95": ("<", 8.0), "speed_over_share": ("<=", 0.001),
    "speed_within_2_sigma": (">=", 0.95),
}  # fmt: skip
"""Relation and bound of a row of the part track."""
ALL_BARS = BARS | dict.fromkeys(
    ("stopped_time_ratio", "stopped_time_ratio_speed", "stopped_time_ratio_body_head"), ("<=", 0.7)
)
"""The same of all parts."""
DEFINITIONS = {
    "people": "episodes, each of one person in images of two cameras in turn; all other rows but one are of those without jumps of over 8 m/s",
    "tracked_share": "images with points of at least 20 voxels in which there is a track",
    "visible_error": "distance to the fitted part's surface of places on the exact arms and hands that a camera sees in this image or the last",
    "whole_error": "the same of all places on their outside, seen or not, inside the box that is looked at",
    "sure_error": "the visible ones where the track is older than 1 s and explains 85 % of the points",
    "exchanged_share": "tracked images in which left and right are exchanged",
    "exchanges": "times that left and right are exchanged, or back, within a track, the first second in which it is still looked for included: both shoulders together are 1.5 times as near to those of the other side as to their own, or back; a body that is turned by 67 to 113 degrees is neither, and what a new track changes is not counted",
    "exchanges_sure": "times that the shoulders become nearer to those of the other side, by anything, or back, within a track while it is sure, which is what counts in the loop",
    "exchanges_nearer": "the same of all tracks: of a body a quarter turn off it is chance to which side it is nearer",
    "exchanges_anew": "as `exchanges`, with those at which a track, or its age, begins anew: while a body is looked for both facings are tried",
    "unnoticed_frames_max": "images in a row in which half of the visible places are over 10 cm off and the track counts as sure; every image is looked at",
    "region_right": "body region of the part nearest to the arm is the exact one, where there is a track",
    "region_right_sure": "the same where the track is sure",
    "sure_share": "images in which speed and region are sure, of those with a track",
    "speed_error": "error of the measured speed towards the arm, where sure",
    "point_speed_error": "the same of the nearest point's distance two images before and now",
    "speed_over_share": "images in which the person comes faster than the bound v_h within the reaction time and the image after; of those where the track is sure and the bound is less than what is assumed anyway",
    "speed_over_share_all": "the same of all sure images: people faster than the 1.6 m/s that are assumed count too, of whom no bound says more",
    "speed_bound": "the bound v_h where sure; assumed is 1.6 m/s",
    "speed_sigma_ratio": "error of the speed towards the arm over the standard deviation that is told of it, of all parts that are known in sure tracks; root mean square: 1 where it is honest",
    "speed_within_2_sigma": "share of them within 2 standard deviations; 0.954 of a normal distribution",
    "speed_within_bound": "share of them within the 2.5 that the bound counts with; 0.988 of a normal distribution",
    "speed_deviation": "the standard deviation that is told of these speeds",
    "place_within_2_sigma": "share of the errors of these parts' distances from the arm within 2 standard deviations that are told of them",
    "frame_ms": "processor time of one frame, compiled, of all threads together, on the machine of this run; its caches are shared with whatever else it does",
}
WAYS = {
    "_jumps": "; of recordings that jump",
    "_thick": "; told radii of 1.1 times the exact ones, of the first people",
    "_cold": "; every frame begins anew, of the first people",
    "_fixed": "; lengths and radii are not learnt, of the first people",
    "_same": "; the tracker itself, of the same first people",
}


def row(value: Any, unit: str = "1") -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def holds(name: str, value: float) -> bool | None:
    """Whether a row is within its bar; None: it has none."""
    if name not in ALL_BARS:
        return None
    relation, bound = ALL_BARS[name]
    return {">=": value >= bound, "<=": value <= bound, "<": value < bound}[relation]


def definition(name: str) -> str:
    """What a row measures."""
    base, words = name, ""
    for end, more in WAYS.items():
        if base.endswith(end):
            base, words = base.removesuffix(end), more
    for end, more in (("_p50", "; median"), ("_p95", "; 95th percentile")):
        if base not in DEFINITIONS and base.endswith(end):
            base, words = base.removesuffix(end), more + words
    return DEFINITIONS.get(base, base) + words


def _quantiles(name: str, values: NDArray, unit: str, factor: float) -> Rows:
    if not len(values):
        return {}
    return {f"{name}_p{p}": row(factor * np.percentile(values, p), unit) for p in (50, 95)}


def sure_images(case: Mapping[str, NDArray]) -> NDArray:
    """Images in which the track is sure."""
    tracked, age, explained = (jnp.asarray(case[name]) for name in ("tracked", "age", "explained"))
    return np.asarray(settled(BodyParams(), tracked.astype(bool), age, explained))


def sure_frames(case: Case) -> NDArray:
    """Compared images in which the whole track is old enough and explains enough."""
    return sure_images(case)[case["frames"]]


def errors(case: Case, where: str) -> NDArray:
    """Errors of the places that are "visible", "outside", or visible in a "sure" track [m]."""
    chosen = case["visible" if where == "sure" else where] & case["tracked"][case["frames"]][:, None, None]
    if where == "sure":
        chosen = chosen & sure_frames(case)[:, None, None]
    return case["error"][chosen]


def unnoticed(case: Case) -> int:
    """Longest time in which the arms are wrong and the track is sure [frames]."""
    longest = run = 0
    for one in case["wrong"]:
        run = run + 1 if one else 0
        longest = max(longest, run)
    return longest


def exchanges(case: Case, of: NDArray | None = None, clear: bool = True, anew: bool = False) -> int:
    """Times that left and right change within a track, from one of the images to the next of them.

    Args:
        of: images that count; None: those with a track.
        clear: whether images in which the shoulders are nearly as near to those of either side, as a quarter turn off, are passed over.
        anew: whether a change counts with which a track or its age begins anew, if no image between is without a track.
    """
    some = case["tracked"].astype(bool) if of is None else of & case["tracked"].astype(bool)
    some = np.flatnonzero(some & case["clear"] if clear else some)
    begins = ~case["tracked"].astype(bool)
    begun = np.cumsum(begins if anew else begins | (np.diff(case["age"], prepend=-1.0) <= 0))  # number of the track
    same = begun[some[1:]] == begun[some[:-1]]
    return int((same & (case["exchanged"][some[1:]] != case["exchanged"][some[:-1]])).sum())


def track_rows(cases: Mapping[str, Case], end: str = "") -> Rows:
    """Rows of one tracker."""
    each = list(cases.values())

    def joined(of: list[NDArray]) -> NDArray:
        return np.concatenate([np.ravel(a) for a in of]) if of else np.zeros(0)

    enough = joined([c["count"] >= 20 for c in each]).astype(bool)
    tracked = joined([c["tracked"] for c in each]).astype(bool)
    exchanged = joined([c["exchanged"] for c in each]).astype(bool)
    rows: Rows = {"tracked_share": row(tracked[enough].mean() if enough.any() else 0.0)}
    for name, where in (("visible_error", "visible"), ("whole_error", "outside"), ("sure_error", "sure")):
        rows |= _quantiles(name, joined([errors(c, where) for c in each]), "mm", 1e3)
    rows["exchanged_share"] = row(exchanged[tracked].mean() if tracked.any() else 0.0)
    rows["exchanges"] = row(sum(exchanges(c) for c in each), "times")
    rows["exchanges_sure"] = row(sum(exchanges(c, sure_images(c), clear=False) for c in each), "times")
    rows["exchanges_nearer"] = row(sum(exchanges(c, clear=False) for c in each), "times")
    rows["exchanges_anew"] = row(sum(exchanges(c, anew=True) for c in each), "times")
    rows["unnoticed_frames_max"] = row(max(unnoticed(c) for c in each), "frames")
    rows |= _quantiles("frame_ms", joined([c["seconds"] for c in each]), "ms", 1e3)
    return {name + end: entry for name, entry in rows.items()}


def speed_rows(cases: Mapping[str, Case]) -> Rows:
    """Regions and speeds at the place of the arm nearest to the person."""
    found: dict[str, NDArray] = {}
    names = ("region", "true_region", "sure", "speed", "bound", "true_speed", "true_most", "point_speed")
    for name in names:
        found[name] = np.concatenate([c[name][c["tracked"][c["looked"]]] for c in cases.values()])
    right, sure = found["region"] == found["true_region"], found["sure"] > 0
    if not len(right):
        return {}
    rows = {"region_right": row(right.mean()), "sure_share": row(sure.mean())}
    over = found["true_most"] > found["bound"] + 1e-6
    if sure.any():
        rows["region_right_sure"] = row(right[sure].mean())
        rows |= _quantiles("speed_error", np.abs(found["speed"] - found["true_speed"])[sure], "m/s", 1.0)
        rows |= _quantiles("point_speed_error", np.abs(found["point_speed"] - found["true_speed"])[sure], "m/s", 1.0)
        less = sure & (found["bound"] < ASSUMED)
        rows["speed_over_share"] = row(over[less].mean() if less.any() else 0.0)
        rows["speed_over_share_all"] = row(over[sure].mean())
        rows |= _quantiles("speed_bound", found["bound"][sure], "m/s", 1.0)
    return rows | deviation_rows(cases)


def deviation_rows(cases: Mapping[str, Case]) -> Rows:
    """Errors of all parts that are known, of sure tracks, over the standard deviations that are told of them."""

    def ratios(of: str, true: str, told: str) -> NDArray:
        chosen = [c["known"].astype(bool) & sure_images(c)[c["looked"], None] for c in cases.values()]
        each = [np.abs(c[of] - c[true])[k] / c[told][k] for c, k in zip(cases.values(), chosen, strict=True)]
        return np.concatenate(each)

    of_speed = ratios("speeds", "true_speeds", "deviations")
    if not len(of_speed):
        return {}
    of_place = ratios("distances", "true_distances", "place_deviations")
    told = np.concatenate(
        [c["deviations"][c["known"].astype(bool) & sure_images(c)[c["looked"], None]] for c in cases.values()]
    )
    return {
        "speed_sigma_ratio": row(np.sqrt(np.mean(of_speed**2))),
        "speed_within_2_sigma": row((of_speed < 2).mean()),
        "speed_within_bound": row((of_speed < 2.5).mean()),
        "speed_deviation_p50": row(np.median(told), "m/s"),
        "place_within_2_sigma": row((of_place < 2).mean()),
    }


def all_rows(cases: Cases) -> Rows:
    """Every row, in the order of the page."""
    rows: Rows = {"people": row(len(cases["full"]) if "full" in cases else 0, "episodes")}
    for variant, everybody in cases.items():
        some = {name: case for name, case in everybody.items() if case["clean"]}
        wild = [unnoticed(case) for case in everybody.values() if not case["clean"]]
        if wild and variant == "full":
            rows["unnoticed_frames_max_jumps"] = row(max(wild), "frames")
        if not some:
            continue
        rows |= track_rows(some, "" if variant == "full" else f"_{variant}")
        if variant == "full":
            rows |= speed_rows(some)
            compared = {
                name: some[name] for name in some if any(name in other for v, other in cases.items() if v != "full")
            }
            rows |= track_rows(compared, "_same") if compared else {}
    return rows
