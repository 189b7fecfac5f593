"""The rows, from the stored cases: value, unit, definition and bar of each."""

import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .derived import derived_rows
from .episode import arrival, measures
from .fair import ARRIVAL, COMMON_SPEED, FairRow, fair_rows, median_search, printed_steps, time_at_one_speed
from .paths import SCENE
from .printed import LEADS, PATHS, RELATIVE_PRINTED, TIMES, TIMES_CAPTION, TimeRow
from .rrt_star import STAGES
from .scores import closest_scores, relative_of_table_ten, scores_of, table_ten

Case = Mapping[str, NDArray]
Cases = Mapping[str, Case]
Rows = dict[str, dict[str, Any]]
COMPARE: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}
FITTING = "spheres"
"""The reading that fits the printed times, whose rows have bars."""
BARS: dict[str, tuple[str, float]] = {
    **{f"{table}_iapf_worst_{FITTING}": ("<=", 2.0) for table in ("I", "II", "III", "VII")},
    **{f"{table}_iapf_worst_{FITTING}": ("<=", 1.0) for table in ("V", "VI")},
    "VIII_worst": ("<=", 0.005),
    "X_relative_difference": ("<=", 0.005),
}
TELLING = "columns"
"""The reading in which an obstacle is in the way; figures, the episode and long searches show it."""
PLANNERS = {"iapf": "improved field", "gda": "gradient descent", "rrt": "RRT*"}


def told(readings: Sequence[str]) -> str:
    """The reading that figures show: `TELLING`, or the first of the run."""
    return TELLING if TELLING in readings else readings[0]


def row(value: Any, unit: str) -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def holds(name: str, value: float) -> bool | None:
    """Whether a row holds its bar; None: it has none."""
    found = BARS.get(name)
    return None if found is None else COMPARE[found[0]](value, found[1])


def our_times(cases: Cases, reading: str, one: TimeRow) -> dict[str, float | None]:
    """Our time of every planner that the row has a printed one for; RRT* at the common speed; None: not measured [s]."""
    times, k = cases[f"times/{reading}"], TIMES.index(one)
    rrt = cases.get(f"rrt/{reading}-{one.key}")
    chosen = None if rrt is None else median_search(rrt)
    searched = None if rrt is None or chosen is None else float(time_at_one_speed(rrt["length"][chosen]))
    found = {"iapf": float(times["iapf"][k]), "gda": float(times["gda"][k]), "rrt": searched}
    return {name: found[name] for name in PLANNERS if getattr(one, name) is not None}


def worst(cases: Cases, reading: str, table: str) -> float:
    """Largest difference of the improved field's times from the printed ones in a table [%]."""
    rows = [one for one in TIMES if one.table == table]
    return max(abs(100 * ((our_times(cases, reading, one)["iapf"] or np.inf) / one.iapf - 1)) for one in rows)


def fair_of(cases: Cases, reading: str) -> Sequence[FairRow]:
    """The table at one speed."""
    return fair_rows(
        reading,
        cases[f"times/{reading}"],
        cases[f"paths/{reading}"],
        cases.get(f"rrt/{reading}-{SCENE.key}"),
        cases.get(f"rrt-equal/{reading}"),
    )


def time_rows(cases: Cases, reading: str) -> Rows:
    """Tables I to VII in one reading."""
    rows: Rows = {}
    errors = []
    for one in TIMES:
        ours = our_times(cases, reading, one)
        errors.append((ours["iapf"] or np.inf) - one.iapf)
        for name, value in ours.items():
            if value is not None:
                rows[f"{one.table}_{one.number}_{name}_{reading}"] = row(value, "s")
    for table in TIMES_CAPTION:
        rows[f"{table}_iapf_worst_{reading}"] = row(worst(cases, reading, table), "%")
    rows[f"iapf_rms_{reading}"] = row(np.sqrt(np.mean(np.square(errors))), "s")
    return rows


def score_rows() -> Rows:
    """Tables VIII and X, from their own rows."""
    plain = scores_of([path.length for path in PATHS], [path.bending for path in PATHS])
    close, printed = closest_scores(), np.array([path.score for path in PATHS])
    rows: Rows = {f"VIII_{k + 1}_score": row(value, "1") for k, value in enumerate(plain)}
    rows["VIII_worst_as_printed"] = row(np.abs(plain - printed).max(), "1")
    rows["VIII_worst"] = row(np.abs(close - printed).max(), "1")
    for run, found in table_ten().items():
        for name, value in zip(("safety", "efficiency", "overall"), found, strict=True):
            rows[f"X_{name}_{run}"] = row(value, "%")
    rows["X_relative"] = row(relative_of_table_ten(), "%")
    rows["X_relative_difference"] = row(abs(relative_of_table_ten() - RELATIVE_PRINTED), "%")
    return rows


def leads(table: str) -> tuple[float, float]:
    """Mean lead of the improved field's printed times over the printed gradient descent and RRT*, 1 - t / t_other [%]."""
    rows = [one for one in TIMES if one.table == table]
    iapf, gda, rrt = (np.mean([getattr(one, name) for one in rows]) for name in PLANNERS)
    return float(100 * (1 - iapf / gda)), float(100 * (1 - iapf / rrt))


def printed_rows() -> Rows:
    """What follows from the printed times alone."""
    rows: Rows = {}
    for table in LEADS:
        for name, value in zip(("gda", "rrt"), leads(table), strict=True):
            rows[f"{table}_lead_{name}"] = row(value, "%")
    for name, ends in printed_steps().items():
        for end, value in zip(("min", "max"), ends, strict=True):
            rows[f"printed_step_{name}_{end}"] = row(100 * value, "cm")
    searched = [one.rrt for one in TIMES if one.rrt is not None]
    for end, seconds in (("min", min(searched)), ("max", max(searched))):
        rows[f"printed_rrt_length_{end}"] = row(100 * (seconds * COMMON_SPEED + ARRIVAL), "cm")
    return rows


def search_rows(name: str, reading: str, case: Case) -> Rows:
    """Median length of searches after every number of iterations, and its time at one speed; none before half of them have
    found a path."""
    rows: Rows = {}
    for k, stage in enumerate(STAGES):
        length = float(np.median(case["best"][:, k]))
        if np.isfinite(length):
            rows[f"{name}_length_{stage}_{reading}"] = row(100 * length, "cm")
            rows[f"{name}_time_{stage}_{reading}"] = row(time_at_one_speed(length), "s")
    return rows


def all_rows(cases: Cases, readings: Sequence[str]) -> Rows:
    """All rows of a run."""
    rows: Rows = {}
    for reading in readings:
        rows |= time_rows(cases, reading)
        seconds = cases[f"paths/{reading}"]["seconds"]
        rows[f"plan_ms_{reading}"] = row(1e3 * np.median(seconds), "ms")
        rows[f"plan_ms_p95_{reading}"] = row(1e3 * np.percentile(seconds, 95), "ms")
        for one in fair_of(cases, reading):
            rows[f"fair_{one.key}_length_{reading}"] = row(100 * one.length, "cm")
            rows[f"fair_{one.key}_time_{reading}"] = row(one.time, "s")
            rows[f"fair_{one.key}_bending_{reading}"] = row(one.bending / 100, "1/cm")
            rows[f"fair_{one.key}_clearance_{reading}"] = row(100 * one.clearance, "cm")
        for name, case in (("rrt", f"rrt-long/{reading}"), ("rrt_equal", f"rrt-equal/{reading}")):
            if case in cases:
                rows |= search_rows(name, reading, cases[case])
    rows |= score_rows() | printed_rows()
    if "episode" in cases:
        episode = cases["episode"]
        for run, name in enumerate(("without", "with")):
            rows[f"episode_time_{name}"] = row(arrival(episode, run), "s")
            rows[f"episode_separation_{name}"] = row(100 * episode["separation"][run].min(), "cm")
        for name, pair in measures(episode).items():
            for run, value in zip(("without", "with"), pair, strict=True):
                rows[f"episode_{name}_{run}"] = row(value, "%")
    return rows | derived_rows(rows)
