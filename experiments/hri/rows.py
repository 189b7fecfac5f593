"""The rows: value, unit, definition and bar of each. Runs with the same person and seed are pairs."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .measures import Measured

Rows = dict[str, dict[str, Any]]
DRAWS = 2000
"""Samples of the bootstrap."""


class Pair(NamedTuple):
    """All systems beside one person with one seed."""

    person: str
    """Name."""
    clean: bool
    """Whether the motion is without jumps."""
    by: Mapping[str, Measured]
    """Measures by system."""


class Bar(NamedTuple):
    """What a row should be."""

    least: float = -math.inf
    """Least value."""
    most: float = math.inf
    """Largest value."""

    def __str__(self) -> str:
        return f">= {self.least:g}" if math.isfinite(self.least) else f"<= {self.most:g}"


BARS = {
    "msj_ratio": Bar(least=5.0), "curvature_ratio": Bar(least=5.0), "contacts": Bar(most=0.0),
    "clearance_difference": Bar(least=0.0), "cycle_time_ratio": Bar(most=1.0),
}  # fmt: skip
RATIOS = {
    "msj_ratio": "msj", "curvature_ratio": "curvature", "total_jerk_ratio": "total_jerk", "msj_si_ratio": "msj_si",
    "curvature_si_ratio": "curvature_si", "variance_si_ratio": "variance_si",
}  # fmt: skip
"""Row of a pair's ratio -> measure; above 1 the system beside the baseline is the smoother one."""
UNITS = {
    "variance_x": "m^2/sample^4", "variance_y": "m^2/sample^4", "variance_z": "m^2/sample^4", "total_jerk": "m/sample^3",
    "msj": "m^2/sample^6", "curvature": "1/m", "variance_si": "m^2/s^4", "jerk_si": "m/s^3", "msj_si": "m^2/s^6",
    "curvature_si": "1/(m s)", "sparc": "1", "cycle_time": "s", "leg_length": "m", "min_separation": "m", "legs": "1",
}  # fmt: skip
"""Unit of every measure whose median is a row."""
WORDS = {
    "variance_x": "variance of the second difference of the tool along x, 4 samples a second", "variance_y": "the same along y",
    "variance_z": "the same along z", "total_jerk": "sum of the norms of the third differences",
    "msj": "mean over samples and axes of the squared third difference",
    "curvature": "mean of |curvature(k + 1) - curvature(k)| over samples faster than 0.1 m/s",
    "variance_si": "variance of the acceleration, summed over the axes, at 50 Hz", "jerk_si": "mean norm of the jerk",
    "msj_si": "mean squared norm of the jerk", "curvature_si": "mean of |d curvature / dt| over samples faster than 0.1 m/s",
    "sparc": "spectral arc length of the tool's speed; nearer 0 is smoother", "cycle_time": "time there and back",
    "leg_length": "way of the tool from one waypoint to the next", "min_separation": "least exact distance of the arm to the person",
    "legs": "arrivals at a waypoint in a run",
}  # fmt: skip
COUNTED = {
    "contacts": "touches of the moving arm and the person, in all runs with clean motions",
    "contacts_jumping": "the same in runs beside recordings that jump",
    "contacts_standing": "touches by a person who came to a standing arm, in all runs",
    "success": "share of runs without a contact of the moving arm and with at least one cycle",
    "recall": "share of configurations truly in collision that were known to be within 3 cm, mean over runs that had any",
    "false_alarms": "share of configurations truly over 15 cm away held to be within 3 cm, mean over runs",
    "least_separation": "least of all runs of min_separation",
}
PAIRED = {
    "_guarded": ("ours", "baseline_guarded", "both with our safety layer: the baseline under it and ours"),
    "_free": ("ours_free", "baseline", "neither with a safety layer: baseline and ours without speed and separation"),
    "_equal": ("ours", "baseline_slow", "at equal cycle time: the slowed baseline and ours"),
    "_nearest": ("nearest", "baseline", "baseline and our policies on the nearest point"),
    "_path": ("path", "baseline", "baseline and our path"),
}
"""End of a row -> the systems of its pairs: of ours, of the baseline, in words."""
FIRST = "baseline, which has no safety layer, and ours with it"
"""The pairs of rows without an end."""
BARRED = ("", "_free", "_guarded")
"""Ends of the rows that have bars: ours with a safety layer beside a baseline without, neither with one, both with one."""


def row(value: Any, unit: str = "1") -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def stem_of(name: str) -> str:
    """A row's name without the end that says whose pairs it is of, where rows with this end have bars."""
    for end in BARRED[1:]:
        name = name.removesuffix(end)
    return name


def holds(name: str, value: float) -> bool | None:
    """Whether a row keeps its bar; None: it has none. What isn't a number keeps none."""
    bar = BARS.get(stem_of(name))
    return None if bar is None else bool(bar.least <= value <= bar.most)


def interval(values: NDArray) -> tuple[float, float, float]:
    """Median and its 95 % interval by the bootstrap over pairs; NaN where there are none."""
    values = values[np.isfinite(values)]
    if not len(values):
        return math.nan, math.nan, math.nan
    draw = np.random.default_rng(0).integers(len(values), size=(DRAWS, len(values)))
    low, high = np.percentile(np.median(values[draw], axis=1), [2.5, 97.5])
    return float(np.median(values)), float(low), float(high)


def paired(pairs: Sequence[Pair], one: str, other: str, value: Callable[[Measured, Measured], float]) -> NDArray:
    """A value of every pair of two systems."""
    return np.array([value(pair.by[one], pair.by[other]) for pair in pairs])


def ratio(a: float, b: float) -> float:
    """a / b; NaN where b is 0."""
    return a / b if b else math.nan


def pair_rows(pairs: Sequence[Pair], one: str, other: str, end: str = "") -> Rows:
    """Rows of the pairs of one of our systems and one of the baseline's."""
    found: dict[str, tuple[NDArray, str]] = {
        name: (paired(pairs, one, other, lambda a, b, m=measure: ratio(getattr(b, m), getattr(a, m))), "1")
        for name, measure in RATIOS.items()
    }
    found["clearance_difference"] = (paired(pairs, one, other, lambda a, b: a.min_separation - b.min_separation), "m")
    found["cycle_time_ratio"] = (paired(pairs, one, other, lambda a, b: a.cycle_time / b.cycle_time), "1")
    rows: Rows = {}
    for name, (values, unit) in found.items():
        for part, number in zip(("", "_low", "_high"), interval(values), strict=True):
            rows[f"{name}{end}{part}"] = row(number, unit)
    return rows


def system_rows(pairs: Sequence[Pair], system: str) -> Rows:
    """Counts and medians of one system."""
    runs = [pair.by[system] for pair in pairs]
    clean = [pair.clean for pair in pairs]

    def mean(name: str) -> float:
        values = np.array([getattr(one, name) for one in runs], float)
        return float(values[np.isfinite(values)].mean()) if np.isfinite(values).any() else math.nan

    rows = {
        f"contacts_{system}": row(sum(one.contacts for one, ok in zip(runs, clean, strict=True) if ok)),
        f"contacts_jumping_{system}": row(sum(one.contacts for one, ok in zip(runs, clean, strict=True) if not ok)),
        f"contacts_standing_{system}": row(sum(one.contacts_standing for one in runs)),
        f"success_{system}": row(np.mean([one.success for one in runs])),
        f"recall_{system}": row(mean("recall")),
        f"false_alarms_{system}": row(mean("false_alarms")),
        f"least_separation_{system}": row(min(one.min_separation for one in runs), "m"),
    }
    for name, unit in UNITS.items():
        values = np.array([getattr(one, name) for one in runs], float)
        rows[f"{name}_{system}"] = row(np.median(values[np.isfinite(values)]) if np.isfinite(values).any() else math.nan, unit)  # fmt: skip
    return rows


def all_rows(pairs: Sequence[Pair], systems: Sequence[str]) -> Rows:
    """All rows of a run: the bars first, as far as their systems were run."""
    rows: Rows = {"pairs": row(len(pairs))}
    if not pairs:
        return rows
    if {"ours", "baseline"} <= set(systems):
        found = pair_rows(pairs, "ours", "baseline")
        contacts = row(sum(pair.by["ours"].contacts for pair in pairs if pair.clean))
        first = {name: contacts if name == "contacts" else found[name] for name in BARS}
        rows |= first | found
    for end, (one, other, _) in PAIRED.items():
        if {one, other} <= set(systems):
            rows |= pair_rows(pairs, one, other, end)
            if end in BARRED:
                rows[f"contacts{end}"] = row(sum(pair.by[one].contacts for pair in pairs if pair.clean))
    for system in systems:
        rows |= system_rows(pairs, system)
    return rows


def definition(name: str, systems: Sequence[str]) -> str:
    """What a row measures."""
    if name == "pairs":
        return "people times seeds: runs of every system"
    if stem_of(name) == "contacts":
        one = "ours" if name == "contacts" else PAIRED[name.removeprefix("contacts")][0]
        return f"touches of the moving arm and the person in all runs of {one} with clean motions"
    for system in sorted(systems, key=len, reverse=True):
        if name.endswith(f"_{system}") and name not in BARS:
            stem = name.removesuffix(f"_{system}")
            if stem in COUNTED:
                return f"{system}: {COUNTED[stem]}"
            if stem in WORDS:
                return f"{system}: {WORDS[stem]}, median"
    stem, part = name, "median over pairs"
    for end, words in (("_low", "lower end of its 95 % interval (bootstrap)"), ("_high", "upper end of it")):
        if stem.endswith(end):
            stem, part = stem.removesuffix(end), words
    who = FIRST
    for end, (_, _, words) in PAIRED.items():
        if stem.endswith(end):
            stem, who = stem.removesuffix(end), words
    if stem == "clearance_difference":
        return f"least distance to the person, of ours less that of the baseline, {part}; {who}"
    if stem == "cycle_time_ratio":
        return f"cycle time of ours over that of the baseline, {part}; {who}"
    return f"`{RATIOS.get(stem, stem)}` of the baseline over that of ours, {part}; {who}"
