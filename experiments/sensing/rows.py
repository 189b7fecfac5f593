"""The rows, from the stored cases: value, unit, definition and bar of each."""

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.table import aligned
from hrcjax.sim import Params

from .appear import brake_tick
from .episodes import arrives
from .fault_cases import KINDS, green_ticks, named_after, ticks_of
from .hands import KINDS as HAND_KINDS
from .hands import LEAST_PIXELS
from .static import LEAST_SEEN, THINNEST

Case = Mapping[str, NDArray]
Cases = Mapping[str, Case]
"""Cases by name."""
Rows = dict[str, dict[str, Any]]

CLEAR = 14
"""Bits of the status of a plan without a complaint: distances kept, within the bounds, no link against another."""
HORIZON = 2.0
"""Sensed distances are compared while the person is nearer than this [m]."""
RANGE = (0.1, 1.5)
"""True distances over which pessimism is averaged [m]."""
COMPARE: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}

BARS: dict[str, tuple[str, float]] = {
    "ghost_stop_share": ("<", 0.001),
    "ghost_arrivals": (">=", 1.0),
    "static_error_p50": ("<", 10.0),
    "static_error_p95": ("<", 25.0),
    "obstacles_missed": ("<=", 0.0),
    "separation_over_p999": ("<", 0.0),
    "pessimism_mean": ("<", 50.0),
    "excess_speed_max": ("<=", 0.005),
    "brake_delay_ticks": ("<=", 1.0),
    "fault_one_camera_arrives": (">=", 1.0),
    "hand_first_frame": (">=", 0.99),
    "image_ms_p95": ("<", 33.0),
    **{f"fault_{kind}_green": ("<=", 0.0) for kind in KINDS},
    **{f"fault_{kind}_named": ("<=", 0.1) for kind in KINDS},
}

DEFINITIONS = {
    "ghost_stop_share": "nobody in the cell: share of ticks whose zone is not green, or whose speed limit is below the nominal speed",
    "ghost_arrivals": "share of empty-cell episodes with a clear plan in which the tool comes within 2 cm of the goal",
    "static_error_p50": "median of |sensed - exact| distance to obstacles, at control points and random places 4 to 10 cm from surfaces that a camera saw",
    "static_error_p95": "95th percentile of the same",
    "static_over_p95": "95th percentile of sensed - exact there: too far is positive",
    "obstacles_missed": "obstacles of 3 cm radius and more, at least 5 % of whose surface a camera saw, without a map point within 2 cm",
    "obstacle_clearance_min": "least exact distance of the moving links to obstacles, over episodes with a clear plan",
    "separation_over_p999": "99.9th percentile of sensed - true distance of the arm to people, with the person at the exposure of the image in use, while nearer than 2 m",
    "separation_over_max": "the largest of the same",
    "separation_over_share": "share of those ticks in which the sensed distance is larger than the true one",
    "separation_over_near_max": "the largest of the same while the person is nearer than the distance at which full speed begins, the sensed distance cut there",
    "pessimism_mean": "mean of true - sensed distance, at true distances of 0.1 to 1.5 m",
    "pessimism_p50": "median of the same",
    "pessimism_p90": "90th percentile",
    "pessimism_p99": "99th percentile",
    "excess_speed_max": "largest speed of any point of the arm's surface towards the person, less the speed allowed at the largest true distance of that point within the reaction time; motions without jumps",
    "excess_speed_max_jumps": "the same for recorded motions that jump",
    "brake_delay_ticks": "somebody appears 0.3 m from the moving arm: ticks from when the first image may be used until a command slows the arm, in red or stop; the most",
    "brake_delay_ms": "the same from the moment of appearing, wait for the next exposure included; the most",
    "fault_excess_speed_max": "as excess_speed_max, in the episodes with faults",
    "fault_one_camera_arrives": "nobody there, one camera lost for good at 1 s: share of episodes that arrive",
    "fault_one_camera_green": "share of ticks in which that arm may move at full speed, from 0.2 s after the loss on",
    "hand_first_frame": f"hands that appear in free watched space, shown by at least {LEAST_PIXELS} pixels: share with a point of the cloud within 6 cm after that image",
    "image_ms_p50": "median time of one image in the loop, without rendering: judge, track, cloud, fit",
    "image_ms_p95": "95th percentile of the same",
    "unseen_share": "voxels within 1 m of the base that no camera saw in the set-up",
    "unseen_free_share": "the same of voxels whose middle is not inside an obstacle",
    "setup_rounds": "rounds of images of the set-up, the most; one takes 1 s of the arm's motion",
    "setup_seconds": "least time to compute the images of a set-up, once compiled",
    "setup_settled": "share of set-ups that ended because the map had settled",
    "episodes": "episodes of the matrix",
}
"""What each row measures. Rows of faults are explained by `definition`."""
FAULT_PARTS = {
    "green": "ticks that are green though the person is nearer than S_p(0), over all faults of this kind",
    "named": "longest time from a camera's first faulty exposure until the tick knows that something is wrong; never: the fault's length",
    "over_max": "largest sensed - true distance, the person where it is at the tick, while faulty and not stopped",
    "moments": "faults of this kind",
}


def definition(row: str) -> str:
    """What a row measures."""
    if row in DEFINITIONS:
        return DEFINITIONS[row]
    for kind in KINDS:
        part = row.removeprefix(f"fault_{kind}_")
        if part != row and part in FAULT_PARTS:
            return FAULT_PARTS[part]
    for kind in HAND_KINDS:
        if row == f"hand_{kind}_first_frame":
            return {"thin": "the same for hands of 2 cm thickness, 8 to 18 cm long", "body": "the same for the hand of the person model"}[kind]  # fmt: skip
    return ""


def _of(cases: Cases, group: str) -> dict[str, Case]:
    return {name: case for name, case in cases.items() if name.startswith(group + "/")}


def _joined(parts: Iterable[NDArray]) -> NDArray:
    listed = [np.atleast_1d(part) for part in parts]
    return np.concatenate(listed) if listed else np.zeros(0)


def row(value: float | np.floating, unit: str) -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def ghost_rows(empty: Sequence[Case], nominal: float) -> Rows:
    """False stops, from episodes with nobody there."""
    if not empty:
        return {}
    slow = _joined((case["zone"] != 0) | (case["speed_limit"] < nominal * (1 - 1e-6)) for case in empty)
    rows = {"ghost_stop_share": row(slow.mean(), "1")}
    clear = [case for case in empty if int(case["plan_status"]) & CLEAR == CLEAR]
    if clear:
        rows["ghost_arrivals"] = row(np.mean([arrives(dict(case)) for case in clear]), "1")
    return rows


def static_rows(set_ups: Sequence[Case], errors: Sequence[NDArray]) -> Rows:
    """The map of what stands."""
    rows: Rows = {}
    error = 1e3 * _joined([*(case["error"] for case in set_ups), *errors])
    if len(error):
        rows["static_error_p50"] = row(np.percentile(np.abs(error), 50), "mm")
        rows["static_error_p95"] = row(np.percentile(np.abs(error), 95), "mm")
        rows["static_over_p95"] = row(np.percentile(error, 95), "mm")
    if set_ups:
        missed = [
            (case["radius"] >= THINNEST - 1e-6) & (case["share_seen"] >= LEAST_SEEN) & ~case["in_map"].astype(bool)
            for case in set_ups
        ]
        rows["obstacles_missed"] = row(sum(int(m.sum()) for m in missed), "obstacles")
        rows["unseen_share"] = row(np.mean([case["unseen_share"] for case in set_ups]), "1")
        rows["unseen_free_share"] = row(np.mean([case["unseen_free_share"] for case in set_ups]), "1")
        rows["setup_rounds"] = row(max(int(case["rounds"]) for case in set_ups), "rounds")
        rows["setup_settled"] = row(np.mean([bool(case["settled"]) for case in set_ups]), "1")
        rows["setup_seconds"] = row(min(float(case["seconds"]) for case in set_ups), "s")
    return rows


def separation_rows(episodes: Sequence[Case], full_speed: float) -> Rows:
    """The sensed distance to people against the true one.

    Args:
        full_speed: distance at which full speed begins [m].
    """
    sensed, true = (_joined(case[name] for case in episodes) for name in ("separation", "true_exposed"))
    some = (true < HORIZON) & np.isfinite(_joined(case["age"] for case in episodes))
    if not some.any():
        return {}
    over = 1e3 * (sensed - true)[some]
    rows = {
        "separation_over_p999": row(np.percentile(over, 99.9), "mm"),
        "separation_over_max": row(over.max(), "mm"),
        "separation_over_share": row((over > 0).mean(), "1"),
    }
    near = true < full_speed
    if near.any():
        cut = np.minimum(sensed, full_speed) - true
        rows["separation_over_near_max"] = row(1e3 * cut[near].max(), "mm")
    within = (true >= RANGE[0]) & (true <= RANGE[1]) & some
    if within.any():
        short = 1e3 * (true - sensed)[within]
        rows["pessimism_mean"] = row(short.mean(), "mm")
        for p in (50, 90, 99):
            rows[f"pessimism_p{p}"] = row(np.percentile(short, p), "mm")
    return rows


def speed_rows(episodes: Sequence[Case]) -> Rows:
    """Speed beside people."""
    rows: Rows = {}
    for name, clean in (("excess_speed_max", True), ("excess_speed_max_jumps", False)):
        chosen = [case["excess"] for case in episodes if bool(case["clean"]) == clean]
        if chosen:
            rows[name] = row(max(float(e.max()) for e in chosen), "m/s")
    return rows


def brake_rows(appearances: Sequence[Case], latency: float) -> Rows:
    """Somebody who is there at once."""
    ticks, times = [], []
    for case in appearances:
        t = case["t"]
        due = int(np.searchsorted(t, float(case["first"]) + latency - 1e-6))
        braked = brake_tick(case["zone"], case["qd"], int(np.searchsorted(t, float(case["begin"]))))
        ticks.append(braked - due)
        times.append((t[min(braked, len(t) - 1)] - float(case["begin"])) * 1e3)
    if not ticks:
        return {}
    return {"brake_delay_ticks": row(max(ticks), "ticks"), "brake_delay_ms": row(max(times), "ms")}


def fault_rows(faults: Mapping[str, Sequence[Case]], closest: float) -> Rows:
    """Faults of the cameras, by kind.

    Args:
        closest: S_p(0) [m].
    """
    rows: Rows = {}
    for kind, cases in faults.items():
        each = [(case, k) for case in cases for k in range(len(case["begin"]))]
        if not each:
            continue
        rows[f"fault_{kind}_green"] = row(sum(green_ticks(dict(case), k, closest) for case, k in each), "ticks")
        named = np.asarray([named_after(dict(case), k, kind == "person_lost") for case, k in each])
        if np.isfinite(named).any():
            rows[f"fault_{kind}_named"] = row(np.nanmax(named), "s")
        over = [_over_while_faulty(case, k) for case, k in each]
        rows[f"fault_{kind}_over_max"] = row(1e3 * max(over), "mm")
        rows[f"fault_{kind}_moments"] = row(len(each), "faults")
    return rows


def _over_while_faulty(case: Case, k: int) -> float:
    counted = ticks_of(dict(case), k) & (case["zone"] < 3) & (case["true_now"] < 1.0)
    over = np.minimum(case["separation"], 1.0) - case["true_now"]
    return float(over[counted].max()) if counted.any() else -np.inf


def hand_rows(hands: Sequence[Case]) -> Rows:
    """Hands that appear."""
    kind, pixels, found = (_joined(case[name] for case in hands) for name in ("kind", "pixels", "found"))
    shown = pixels >= LEAST_PIXELS
    if not shown.any():
        return {}
    rows = {"hand_first_frame": row(found[shown].mean(), "1")}
    for k, name in enumerate(HAND_KINDS):
        if (shown & (kind == k)).any():
            rows[f"hand_{name}_first_frame"] = row(found[shown & (kind == k)].mean(), "1")
    return rows


def all_rows(cases: Cases, params: Params, latency: float, full_speed: float, closest: float) -> Rows:
    """Every row that the cases allow, in the order of the page."""
    episodes = _of(cases, "episode")
    empty = [case for name, case in episodes.items() if name.endswith("-nobody")]
    beside = [case for name, case in episodes.items() if not name.endswith("-nobody")]
    set_ups = list(_of(cases, "setup").values())
    rows = ghost_rows(empty, float(params.safety.zone.nominal_speed))
    rows |= static_rows(set_ups, [case["static_error"] for case in episodes.values()])
    clear = [case["clearance"].min() for case in episodes.values() if int(case["plan_status"]) & CLEAR == CLEAR]
    if clear and min(clear) < 9.0:
        rows["obstacle_clearance_min"] = row(1e3 * min(clear), "mm")
    rows |= separation_rows(beside, full_speed)
    rows |= speed_rows(beside)
    rows |= brake_rows(list(_of(cases, "appear").values()), latency)
    rows |= fault_rows({kind: list(_of(cases, f"fault/{kind}").values()) for kind in KINDS}, closest)
    faulty = [float(case["excess"].max()) for case in _of(cases, "fault").values()]
    if faulty:
        rows["fault_excess_speed_max"] = row(max(faulty), "m/s")
    gone = list(_of(cases, "camera-lost").values())
    if gone:
        rows["fault_one_camera_arrives"] = row(np.mean([arrives(dict(case)) for case in gone]), "1")
        late = _joined((case["zone"] == 0)[case["t"] > 1.2] for case in gone)
        if len(late):
            rows["fault_one_camera_green"] = row(late.mean(), "1")
    rows |= hand_rows(list(_of(cases, "hands").values()))
    times = _joined(case["seconds"] for case in _of(cases, "images").values())
    if len(times):
        rows["image_ms_p50"] = row(1e3 * np.percentile(times, 50), "ms")
        rows["image_ms_p95"] = row(1e3 * np.percentile(times, 95), "ms")
    rows["episodes"] = row(len(episodes), "episodes")
    return rows


def holds(name: str, value: float) -> bool | None:
    """Whether a row holds its bar; None: it has none."""
    if name not in BARS:
        return None
    sign, bar = BARS[name]
    return COMPARE[sign](value, bar)


def number(value: float) -> str:
    """A number of a row."""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def table(rows: Rows) -> str:
    """The rows with bars, aligned."""
    lines = [["sensing", "measured", "unit", "bar", "holds"]]
    for name, entry in rows.items():
        kept = holds(name, entry["value"])
        bar = f"{BARS[name][0]} {BARS[name][1]:g}" if name in BARS else ""
        lines.append(
            [name, number(entry["value"]), entry["unit"], bar, "" if kept is None else "yes" if kept else "NO"]
        )
    return aligned(lines, "<><<<")
