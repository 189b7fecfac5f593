"""The rows, from the stored cases: value, unit, definition and bar of each."""

import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.table import aligned

from .gradients import FLOOR, RANGES, jumps, nonzero, right
from .hands import HINDERED
from .retreat import ABLE, AWAY

Case = Mapping[str, NDArray]
Cases = Mapping[str, Case]
Rows = dict[str, dict[str, Any]]
COMPARE: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}
ENOUGH = 0.03
"""Clearance that most episodes keep [m]."""
DREW_BACK = 0.01
"""Way by which the nearest point must have gone away in stop for a retreat [m]."""

BARS: dict[str, dict[str, tuple[str, float]]] = {
    "unknown_obstacle": {
        "contact_share": ("<=", 0.0),
        "clearance_3cm_share": (">=", 0.95),
        "arrived_share": (">=", 0.9),
        "contact_share_off": (">=", 0.5),
    },
    "hand_in_the_way": {"moving_contact_share_both": ("<=", 0.0), "retreat_or_round_share": (">=", 1.0), "time_ratio": ("<=", 0.75)},
    "stop_retreat": {"retreat_share": (">=", 0.95)},
    "knob_gradient": {"nonzero_share": (">=", 0.95), "equal_share": (">=", 0.9)},
}  # fmt: skip

VARIANTS = {
    "on": "",
    "leaf_off": ", with the policy's collision leaf and repulsion off",
    "off": ", with the governor's stop before surfaces off too",
}
DEFINITIONS: dict[str, dict[str, str]] = {
    "unknown_obstacle": {
        "scenes": "scenes; each has one or two obstacles",
        **{
            f"{row}{'' if name == 'on' else '_' + name}": text + off
            for name, off in VARIANTS.items()
            for row, text in {
                "contact_share": "share of episodes in which a link overlaps an obstacle at any tick until 1 s after the arrival",
                "clearance_p5": "5th percentile of the least exact distance of the moving links to obstacles",
                "clearance_3cm_share": "share of episodes in which it is 3 cm or more",
                "arrived_share": "share of episodes in which the tool comes to rest within 2 cm of the goal",
            }.items()
        },
    },
    "hand_in_the_way": {
        "episodes": "scenes x people x seeds; each is played in both ways to move",
        "hindered": f"of them, those in which the arm in `path` mode is stopped for {HINDERED} s or more before it arrives: somebody is in the way",
        "moving_contact_share_both": "share of episodes in which arm and person overlap at any tick in which a joint moves faster than 0.01 rad/s",
        "moving_contact_share_path": "the same in `path` mode",
        "standing_contact_share_both": "share of episodes in which the person runs into the standing arm",
        "standing_contact_share_path": "the same in `path` mode",
        "retreat_or_round_share": f"share of the hindered episodes in which the arm in `both` mode draws its nearest point back by {1e3 * DREW_BACK:.0f} mm or more while stopped, or is not stopped for {HINDERED} s, or arrives sooner than in `path` mode",
        "time_ratio": "median over the hindered episodes of the time to the goal in `both` mode over that in `path` mode; an episode that never arrives counts its whole duration",
        "time_ratio_all": "the same over all episodes",
        "closed": "of the hindered episodes, those in which the goal itself stays nearer to the person than S_p(0), from when they come up to the end, and which arrive in no mode: near it no posture is far enough",
        "time_ratio_open": "the same ratio over the other hindered episodes",
        "arrived_share_both": "share of episodes that arrive",
        "arrived_share_path": "the same in `path` mode",
        "separation_min_both": "least exact distance of the whole arm to the person over all episodes",
        "separation_min_path": "the same in `path` mode",
    },
    "stop_retreat": {
        "retreat_share": f"share of ticks in stop, not on hold, in which the nearest control point could retreat at {ABLE} m/s without any other approaching, and goes away by more than {1e3 * AWAY:g} mm/s",
        "retreat_share_close": "the same of the ticks in which the person is too close at that moment, without those that wait for the person to stay away",
        "still_share": "share of all these ticks in which it goes neither away nor nearer by more than that",
        "approach_share": "share of all these ticks in which it comes nearer by more than that",
        "ticks": "ticks that were looked at, one in five of those in stop, where a retreat is possible",
        "unable_share": "share of the ticks looked at in which no such retreat exists",
    },
    "knob_gradient": {
        "settings": "random settings of K_att, K_rep and zeta",
        "nonzero_share": f"share of settings in which the derivatives by all three are not 0: above {FLOOR:g} of the loss for a factor e",
        **{f"nonzero_{knob}": f"the same of {knob} alone" for knob in RANGES},
        "equal_share": "share of derivatives within 1 % of the central difference at one of two steps, 1e-4 or 1e-5 of the value",
        **{f"equal_{knob}": f"the same of {knob} alone" for knob in RANGES},
        "jumps": "derivatives whose two differences disagree: within the larger step the loss jumps or has a kink",
        "wrong_without_jump": "derivatives that are not equal though both differences agree",
    },
}


def definition(section: str, name: str) -> str:
    """What a row measures."""
    if name.startswith("wrong_at_"):
        return f"derivatives that are not equal, where within the smaller step these change: {name.removeprefix('wrong_at_')}"
    return DEFINITIONS[section].get(name, "")


def row(value: float | np.floating, unit: str = "1") -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def _of(cases: Cases, group: str) -> list[Case]:
    return [case for name, case in cases.items() if name.startswith(group + "/")]


def obstacle_rows(cases: Sequence[Case]) -> Rows:
    """Of the scenes with unknown obstacles."""
    rows: Rows = {"scenes": row(len(cases), "scenes")}
    for name in VARIANTS:
        tail = "" if name == "on" else "_" + name
        clearance = np.array([float(case[f"clearance_{name}"]) for case in cases])
        rows[f"contact_share{tail}"] = row((clearance < 0).mean())
        rows[f"clearance_p5{tail}"] = row(1e3 * np.percentile(clearance, 5), "mm")
        rows[f"clearance_3cm_share{tail}"] = row((clearance >= ENOUGH).mean())
        rows[f"arrived_share{tail}"] = row(np.mean([bool(case[f"arrived_{name}"]) for case in cases]))
    return rows


def drew_back(case: Case, dt: float) -> bool:
    """Whether the nearest point went away by some way while the arm was stopped; of every fifth tick."""
    return bool(5 * dt * np.maximum(case["away"], 0).sum() >= DREW_BACK)


def hand_rows(cases: Sequence[Case], dt: float) -> Rows:
    """Of the episodes beside people."""
    rows: Rows = {"episodes": row(len(cases), "episodes")}

    def of(name: str) -> NDArray:
        return np.array([float(case[name]) for case in cases])

    modes = [mode for mode in ("both", "path") if f"time_{mode}" in cases[0]]
    for mode in modes:
        rows[f"moving_contact_share_{mode}"] = row(of(f"moving_contact_{mode}").mean())
        rows[f"standing_contact_share_{mode}"] = row(of(f"standing_contact_{mode}").mean())
        rows[f"arrived_share_{mode}"] = row(of(f"arrived_{mode}").mean())
        rows[f"separation_min_{mode}"] = row(1e3 * of(f"separation_min_{mode}").min(), "mm")
    if "path" in modes:
        hindered, ratio = of("stopped_path") >= HINDERED, of("time_both") / of("time_path")
        rows["hindered"] = row(hindered.sum(), "episodes")
        rows["time_ratio_all"] = row(np.median(ratio))
        if hindered.any():
            rows["time_ratio"] = row(np.median(ratio[hindered]))
            shut = of("closed").astype(bool) & ~of("arrived_both").astype(bool) & ~of("arrived_path").astype(bool)
            rows["closed"] = row((hindered & shut).sum(), "episodes")
            if (hindered & ~shut).any():
                rows["time_ratio_open"] = row(np.median(ratio[hindered & ~shut]))
            back = np.array([drew_back(case, dt) for case in cases])
            free = (of("stopped_both") < HINDERED) | (ratio < 1)
            rows["retreat_or_round_share"] = row((back | free)[hindered].mean())
    return rows


def retreat_rows(cases: Sequence[Case]) -> Rows:
    """Of the ticks in stop."""
    able, away, close = (np.concatenate([case[name] for case in cases]) for name in ("able", "away", "close"))
    can = able >= ABLE
    rows: Rows = {"ticks": row(can.sum(), "ticks")}
    if can.any():
        rows["retreat_share"] = row((away[can] > AWAY).mean())
        rows["still_share"] = row((np.abs(away[can]) <= AWAY).mean())
        rows["approach_share"] = row((away[can] < -AWAY).mean())
    near = can & close.astype(bool)
    if near.any():
        rows["retreat_share_close"] = row((away[near] > AWAY).mean())
    if len(can):
        rows["unable_share"] = row(1 - can.mean())
    return rows


def gradient_rows(cases: Sequence[Case]) -> Rows:
    """Of the derivatives."""
    felt, equal, jumped = (np.concatenate([of(case) for case in cases]) for of in (nonzero, right, jumps))
    what = np.concatenate([case["what"] for case in cases])
    rows: Rows = {"settings": row(len(felt), "settings"), "nonzero_share": row(felt.all(axis=1).mean())}
    rows |= {f"nonzero_{knob}": row(felt[:, k].mean()) for k, knob in enumerate(RANGES)}
    rows["equal_share"] = row(equal.mean())
    rows |= {f"equal_{knob}": row(equal[:, k].mean()) for k, knob in enumerate(RANGES)}
    rows["jumps"] = row(jumped.sum(), "derivatives")
    rows["wrong_without_jump"] = row((~equal & ~jumped).sum(), "derivatives")
    for name in sorted(set(what[~equal].tolist())):
        rows[f"wrong_at_{name}"] = row((~equal & (what == name)).sum(), "derivatives")
    return rows


def all_rows(cases: Cases, sections: Sequence[str], dt: float) -> dict[str, Rows]:
    """The rows of every section that has cases."""
    obstacles, hands, gradients = (_of(cases, group) for group in ("obstacle", "hand", "gradient"))
    made: dict[str, Rows] = {}
    if obstacles and "unknown_obstacle" in sections:
        made["unknown_obstacle"] = obstacle_rows(obstacles)
    if hands and "hand_in_the_way" in sections:
        made["hand_in_the_way"] = hand_rows(hands, dt)
    if hands and "stop_retreat" in sections:
        made["stop_retreat"] = retreat_rows(hands)
    if gradients and "knob_gradient" in sections:
        made["knob_gradient"] = gradient_rows(gradients)
    return made


def bar(section: str, name: str) -> str:
    """The bar of a row as text; empty: none."""
    found = BARS[section].get(name)
    return f"{found[0]} {found[1]:g}" if found else ""


def holds(section: str, name: str, value: float) -> bool | None:
    """Whether a row holds its bar; None: it has none."""
    found = BARS[section].get(name)
    return None if found is None else COMPARE[found[0]](value, found[1])


def table(section: str, rows: Rows) -> str:
    """The rows of a section with their bars, aligned."""
    lines = [[section, "measured", "unit", "bar", "holds"]]
    for name, entry in rows.items():
        kept = holds(section, name, entry["value"])
        lines.append([name, f"{entry['value']:.3g}", entry["unit"], bar(section, name), "" if kept is None else "yes" if kept else "NO"])  # fmt: skip
    return aligned(lines, "<><<<")
