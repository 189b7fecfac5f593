"""The rows: value, unit, definition and bar of each."""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .problems import Problems, drawn_evenly, joint_length
from .solve import GUIDED, Solved

Rows = dict[str, dict[str, Any]]
TUNED = 300
"""Problems, drawn evenly, on which the numbers of the solver were chosen."""
POINT = "point_"
"""Begin of the names of rows of the comparison in point space."""
COMPARE: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}
BARS: dict[str, tuple[str, float]] = {
    "success": (">=", 0.995),
    "success_guided": (">=", 1.0),
    "length_hard": ("<=", 0.45),
    "longer_share": ("<=", 0.0),
    "ms_amortised": ("<=", 10.0),
    "ms_alone_optimised": ("<=", 30.0),
    "robotica_ms_alone": ("<=", 30.0),
    "solve_compile_s": ("<", 10.0),
    "compile_s": ("<", 10.0),
    "length_ratio_median": ("<=", 0.6),
    "length_ratio_p95": ("<=", 1.0),
    "settings_per_s": (">=", 100.0),
    "point_success_multi_start": (">=", 0.99),
    "point_success_multi_start_slack": (">=", 0.99),
    "point_best_share_multi_start": (">=", 0.9),
    "point_best_share_multi_start_slack": (">=", 0.9),
    "point_lagrange_cost_max_multi_start": ("<=", 0.01),
    "point_lagrange_within_multi_start": (">=", 1.0),
    "point_lagrange_equal_cost_max_multi_start": ("<=", 0.01),
    "point_lagrange_equal_within_multi_start": (">=", 1.0),
    "point_paper_length_touching": ("<=", 74.0),
    "point_paper_bending_touching": ("<=", 0.03),
}
DEFINITIONS = {
    "taken": "problems taken from the file",
    "problems": "problems whose reference path is free by the exact check; the others do not count",
    "success": "share of these with a path that is free by the exact check at steps of 2 degrees, by optimisation of drawn guesses alone",
    "success_guided": "the same, with guesses by a lazy roadmap for what is left",
    "success_rest": "`success` without the problems that the numbers were chosen on, 300 drawn evenly",
    "success_guided_rest": "`success_guided` without these",
    "straight_share": "share of these whose straight joint line is free",
    "stage1_share": "share of these solved by optimising the straight line",
    "length_ratio_median": "length in the joints over that of the reference path, median over solved problems",
    "length_ratio_p95": "95th percentile of the same",
    "length_hard": "median of the same over problems whose straight line collides",
    "longer_share": "share of solved problems whose path is longer than the reference",
    "ms_amortised": "time per problem of optimisation and exact checks, without compiling and without roadmaps, by the clock of the slowest of `processes`; all problems count",
    "processes": "processes that solved the problems side by side",
    "ms_amortised_cpu": "the same in time of all cores, which other programs lengthen less",
    "ms_guided": "`ms_amortised` with the roadmaps",
    "solve_compile_s": "time to compile the program that takes longest to",
    "clearance": "least distance of the path from the obstacles, exact, median over solved problems",
    "clearance_reference": "the same of their reference paths",
    "peer_problems": "problems, drawn evenly, that OMPL's planners are given too",
    "family_ms_few": "time per problem of the other families together but `points`, without compiling and roadmaps",
    "family_ms_many": "the same of the family `points`, whose problems have more than a hundred obstacles",
    "ms_alone": "time of one problem by itself until its path is accepted or it is given up, roadmaps included, the optimiser compiled for one guess at a time; median of 100 possible ones drawn evenly",
    "ms_alone_optimised": "the same of those whose straight joint line is not free",
    "alone_unsolved": "how many of these are given up",
    "ms_alone_p95": "95th percentile of `ms_alone`",
    "robotica_ms_alone": "Robotica paper's scene: time of one plan by itself, all guesses",
    "settings_per_s": "the same scene: settings of K_att, K_rep and zeta planned per second in one batch",
    "compile_s": "time to trace and compile that batch",
    "robotica_kept": "share of these settings whose plan keeps all distances, bounds, and is free of self-collision",
}
"""What each row measures."""


PARTS = {
    "_success": "share of problems solved, judged by the exact check", "_guided": "the same, with the roadmaps' guesses",
    "_straight": "share of problems whose straight joint line is free", "_ms": "processor time per problem, validity in C, calls from Python",
    "_length_hard": "length over the reference, median where the straight line collides", "_clearance": "least distance from obstacles, median",
    "_ours_over": "our length over that of OMPL's path, median where both solve and the straight line collides",
    "_rrt_connect": "share of problems solved by OMPL's RRTConnect",
}  # fmt: skip
"""What the ends of names of rows of families and peers mean."""


def of_others(name: str) -> str | None:
    """What a row of a family or a peer measures; None: it is no such row."""
    return next((words for end, words in PARTS.items() if name.endswith(end)), None)


def row(value: float | np.floating, unit: str) -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def problem_rows(problems: Problems, reference_free: NDArray, solved: Solved) -> Rows:
    """Rows of the problems."""
    counted = np.flatnonzero(reference_free)
    if not len(counted):
        return {"taken": row(len(problems), "1"), "problems": row(0, "1")}
    stage = solved.stage[counted]
    alone, rest = (stage >= 0) & (stage < GUIDED), ~np.isin(counted, drawn_evenly(len(problems), TUNED))
    ratios, hard = [], []
    for k in counted:
        path = solved.paths[k]
        if path is not None:
            ratios.append(joint_length(path) / joint_length(problems.reference[k]))
            hard.append(solved.stage[k] > 0)
    ratio, is_hard = np.array(ratios), np.array(hard, bool)
    rows = {
        "taken": row(len(problems), "1"),
        "problems": row(len(counted), "1"),
        "success": row(alone.mean(), "1"),
        "success_guided": row((stage >= 0).mean(), "1"),
        "straight_share": row((stage == 0).mean(), "1"),
        "stage1_share": row((stage == 1).mean(), "1"),
        "ms_amortised": row(1e3 * solved.seconds / len(problems), "ms"),
        "ms_amortised_cpu": row(1e3 * solved.cpu_seconds / len(problems), "ms"),
        "ms_guided": row(1e3 * solved.guided_seconds / len(problems), "ms"),
        "solve_compile_s": row(solved.compile_seconds, "s"),
    }
    if len(ratio):
        rows |= {
            "length_ratio_median": row(np.median(ratio), "1"),
            "length_ratio_p95": row(np.percentile(ratio, 95), "1"),
            "longer_share": row((ratio > 1 + 1e-6).mean(), "1"),
        }
    if len(problems) > TUNED and rest.any():
        rows["success_rest"] = row(alone[rest].mean(), "1")
        rows["success_guided_rest"] = row((stage >= 0)[rest].mean(), "1")
    if is_hard.any():
        rows["length_hard"] = row(np.median(ratio[is_hard]), "1")
    return rows


def holds(name: str, value: float) -> bool | None:
    """Whether a row keeps its bar; None: it has none."""
    if name not in BARS:
        return None
    how, bar = BARS[name]
    return COMPARE[how](value, bar)
