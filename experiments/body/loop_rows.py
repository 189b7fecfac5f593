"""Rows of whole episodes with and without the body."""

from collections.abc import Mapping, Sequence

import numpy as np

from hrcjax.lab.case_store import Case
from hrcjax.safety import HEAD_NEAR, RED, STOP, TOO_CLOSE, WAITING

from .loop import EXPLAINED, VARIANTS
from .rows import Rows, row, sure_images

TOWARDS, SHORT = 0.005, 1e-3
"""A violation: a point faster than allowed by more [m/s], or a way to stop that misses more of the intrusion distance [m]."""
WHYS = {"close": TOO_CLOSE, "head": HEAD_NEAR, "waiting": WAITING}
PER_VARIANT = {
    "stopped_time": "time in the zone stop",
    "stopped_close": "part of it with somebody too near",
    "stopped_head": "part of it with a head near",
    "stopped_waiting": "part of it in which the zone waits for them to stay away",
    "red_time": "time in the red zone",
    "stops": "entries into a stop",
    "arrived": "episodes that arrive",
    "time_to_goal": "time to the goal, of an episode that does not arrive its length",
    "contacts": "episodes in which arm and person touch while the arm moves",
    "contacts_standing": "episodes in which they touch while it stands: the person runs into it",
    "separation_min": "least exact distance of arm and person",
    "excess_speed": "largest speed of any point of the arm towards the person beyond v(d), with the person's real speed as v_h: the greatest at which their exact surface comes to the point from the reaction time before until the point has stopped; d the largest exact distance within the reaction time",
    "violations": "episodes with an excess of more than 5 mm/s, or in which a point that brakes would come nearer than C to the person as they really go on",
    "excess_assumed": "the same excess with the speed that is assumed of a person who is not measured",
    "stop_short": "the most by which a point that brakes at some tick would come nearer than C as the person really goes on; negative: spare",
}
"""What a row measures, of each variant."""
DEFINITIONS = {
    "loop_people": "episodes, each beside one person, in every variant; other rows of the loop are of those without jumps",
    "stopped_time_ratio": "time in a stop with all of the body over that without, where no head is watched",
    "stopped_time_ratio_speed": "the same with measured speeds and regions over assumed ones, the head watched in neither: what measured speeds bring",
    "stopped_time_ratio_speed_low": "lower end of its 95 % interval, people drawn anew with all their seeds",
    "stopped_time_ratio_speed_high": "upper end",
    "stopped_time_ratio_head": "the same of the stop near the head alone",
    "stopped_time_ratio_still": "the same as if everybody stood still, which is not safe: the most that measured speeds could bring",
    "stopped_time_ratio_body_head": "the same, the head watched in both",
    "stopped_time_ratio_alike": "time in a stop with measured speeds and regions over that of `alike`, where zones are relaxed as near to their thresholds: what speeds bring without the smaller hysteresis",
    "stopped_close_ratio": "time in a stop with somebody too near, with all of the body over that without: without the wait for them to stay away, which the hysteresis asks for, and without heads",
    "stopped_close_ratio_speed": "the same with measured speeds and regions alone",
    "excess_speed_with": "largest excess of speed with all of the body, by the person's real speed",
    "excess_speed_without": "the same without the body",
    "loop_sure_share": "images with a sure track, of those with a track",
}


def definition(name: str) -> str:
    """What a row measures; "" for a name of another part."""
    if name in DEFINITIONS:
        return DEFINITIONS[name]
    for variant in VARIANTS:
        base = name.removesuffix("_" + variant)
        if base != name and base in PER_VARIANT:
            return f"{PER_VARIANT[base]}; {EXPLAINED[variant]}"
    return ""


def _stopped(cases: Sequence[Case], k: int, bits: int | None = None) -> float:
    """Time in a stop, all people together, or the part of it with a reason [s]."""
    total = 0.0
    for case in cases:
        stop = case["counts"][k] & (case["zone"][k] == STOP)
        if bits is not None:
            stop = stop & ((case["reasons"][k] & bits) > 0)
        total += float(stop.sum() * case["dt"])
    return total


def _worst(cases: Sequence[Case], name: str, k: int) -> float:
    return max(float(case[name][k][case["counts"][k]].max()) for case in cases)


def broken(case: Case, k: int) -> bool:
    """Whether an episode has a violation."""
    return _worst([case], "excess", k) > TOWARDS or _worst([case], "short", k) > SHORT


def variant_rows(cases: Sequence[Case], variant: str) -> Rows:
    """Rows of a variant."""
    k, many = VARIANTS.index(variant), len(cases)
    entries = sum(int(((z := c["zone"][k][c["counts"][k]])[1:] == STOP)[z[:-1] != STOP].sum()) for c in cases)
    rows = {
        "stopped_time": row(_stopped(cases, k) / many, "s an episode"),
        **{f"stopped_{word}": row(_stopped(cases, k, bits) / many, "s an episode") for word, bits in WHYS.items()},
        "red_time": row(np.mean([(c["zone"][k][c["counts"][k]] == RED).sum() * c["dt"] for c in cases]), "s an episode"),
        "stops": row(entries / many, "an episode"),
        "arrived": row(sum(bool(c["arrived"][k]) for c in cases), f"of {many} episodes"),
        "time_to_goal": row(np.mean([c["time_to_goal"][k] for c in cases]), "s"),
        "contacts": row(sum(bool(c["hit"][k]) for c in cases), "episodes"),
        "contacts_standing": row(sum(bool(c["run_into"][k]) for c in cases), "episodes"),
        "separation_min": row(1e3 * min(float(c["separation"][k][c["counts"][k]].min()) for c in cases), "mm"),
        "excess_speed": row(_worst(cases, "excess", k), "m/s"),
        "violations": row(sum(broken(c, k) for c in cases), f"of {many} episodes"),
        "excess_assumed": row(_worst(cases, "excess_assumed", k), "m/s"),
        "stop_short": row(1e3 * _worst(cases, "short", k), "mm"),
    }  # fmt: skip
    return {f"{name}_{variant}": entry for name, entry in rows.items()}


def _interval(cases: Mapping[str, Case], one: str, other: str) -> tuple[float, float]:
    """95 % interval of a ratio of times in a stop, by drawing people anew, each with all seeds (bootstrap, Efron 1979)."""
    people: dict[str, list[Case]] = {}
    for name, case in cases.items():
        if case["clean"]:
            people.setdefault(name.split(", seed ")[0], []).append(case)
    each = np.asarray(
        [[_stopped(some, VARIANTS.index(variant)) for variant in (one, other)] for some in people.values()]
    )
    drawn = np.random.default_rng(0).integers(0, len(each), (4000, len(each)))
    above, below = each[drawn].sum(axis=1).T
    low, high = np.percentile(above[below > 0] / below[below > 0], [2.5, 97.5])
    return float(low), float(high)


def loop_rows(cases: Mapping[str, Case]) -> Rows:
    """All rows of the loop."""
    some = [case for case in cases.values() if case["clean"]]
    rows: Rows = {"loop_people": row(len(cases), "episodes")}
    if not some:
        return rows
    stopped = {variant: _stopped(some, k) for k, variant in enumerate(VARIANTS)}
    pairs = {
        "": ("body", "off"),
        "_speed": ("speed", "off"),
        "_head": ("head", "off"),
        "_still": ("still", "off"),
        "_body_head": ("body", "head"),
        "_alike": ("speed", "alike"),
    }
    for end, (one, other) in pairs.items():
        if stopped[other] > 0:
            rows["stopped_time_ratio" + end] = row(stopped[one] / stopped[other])
    if stopped["off"] > 0:
        for word, bound in zip(("low", "high"), _interval(cases, "speed", "off"), strict=True):
            rows[f"stopped_time_ratio_speed_{word}"] = row(bound)
    close = {variant: _stopped(some, VARIANTS.index(variant), TOO_CLOSE) for variant in ("off", "speed", "body")}
    if close["off"] > 0:
        rows["stopped_close_ratio"] = row(close["body"] / close["off"])
        rows["stopped_close_ratio_speed"] = row(close["speed"] / close["off"])
    rows["excess_speed_with"] = row(_worst(some, "excess", VARIANTS.index("body")), "m/s")
    rows["excess_speed_without"] = row(_worst(some, "excess", VARIANTS.index("off")), "m/s")
    tracked = np.concatenate([case["tracked"] for case in some])
    sure = np.concatenate([sure_images(case) for case in some])
    if tracked.any():
        rows["loop_sure_share"] = row(sure.sum() / tracked.sum())
    for variant in VARIANTS:
        rows |= variant_rows(some, variant)
    return rows
