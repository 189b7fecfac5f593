"""The rows: value, unit, definition and bar of each."""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .problems import Problems, joint_length
from .solve import Solved

Rows = dict[str, dict[str, Any]]
POINT = "point_"
"""Begin of the names of rows of the comparison in point space."""
COMPARE: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}
BARS: dict[str, tuple[str, float]] = {
    "success": (">=", 0.95),
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
    "success": "share of these with a path that is free by the exact check at steps of 2 degrees",
    "straight_share": "share of these whose straight joint line is free",
    "stage1_share": "share of these solved by optimising the straight line",
    "length_ratio_median": "length in the joints over that of the reference path, median over solved problems",
    "length_ratio_p95": "95th percentile of the same",
    "length_hard_median": "median of the same over problems whose straight line collides",
    "longer_share": "share of solved problems whose path is longer than the reference",
    "ms_amortised": "time per problem of optimisation and exact checks, without compiling; all problems count",
    "solve_compile_s": "time to compile the programs of all stages",
    "ms_alone": "Robotica paper's scene: time of one plan by itself, all guesses",
    "settings_per_s": "the same scene: settings of K_att, K_rep and zeta planned per second in one batch",
    "compile_s": "time to trace and compile that batch",
    "robotica_kept": "share of these settings whose plan keeps all distances, bounds, and is free of self-collision",
}
"""What each row measures."""


def row(value: float | np.floating, unit: str) -> dict[str, Any]:
    """One row."""
    return {"value": float(value), "unit": unit}


def problem_rows(problems: Problems, reference_free: NDArray, solved: Solved) -> Rows:
    """Rows of the problems."""
    counted = np.flatnonzero(reference_free)
    if not len(counted):
        return {"taken": row(len(problems), "1"), "problems": row(0, "1")}
    stage = solved.stage[counted]
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
        "success": row((stage >= 0).mean(), "1"),
        "straight_share": row((stage == 0).mean(), "1"),
        "stage1_share": row((stage == 1).mean(), "1"),
        "ms_amortised": row(1e3 * solved.seconds / len(problems), "ms"),
        "solve_compile_s": row(solved.compile_seconds, "s"),
    }
    if len(ratio):
        rows |= {
            "length_ratio_median": row(np.median(ratio), "1"),
            "length_ratio_p95": row(np.percentile(ratio, 95), "1"),
            "longer_share": row((ratio > 1 + 1e-6).mean(), "1"),
        }
    if is_hard.any():
        rows["length_hard_median"] = row(np.median(ratio[is_hard]), "1")
    return rows


def holds(name: str, value: float) -> bool | None:
    """Whether a row keeps its bar; None: it has none."""
    if name not in BARS:
        return None
    how, bar = BARS[name]
    return COMPARE[how](value, bar)
