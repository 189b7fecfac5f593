"""From compared scenes to rows: how far the planners' paths are above the least cost found, with the distance that each keeps."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .intervals import share
from .measures import row
from .optimum import COMPARED, kept

Case = Mapping[str, NDArray]
Rows = dict[str, dict[str, Any]]
BEGIN = "point_lagrange"
WITHIN = 0.01
"""Part of the cost above the least one that counts as reached [1]."""


def excess(cases: Sequence[Case], of: str, k: int) -> NDArray:
    """Planner k's cost over another one less 1, scene by scene [1]; infinite where its path is not claimed, or the dense check refuses it.

    Args:
        of: `best`, `equal` or `own`, as of `compared`.
    """
    mine = {key: np.array([float(case[key][k]) for case in cases]) for key in ("cost", "violation", "outside", "claimed")}  # fmt: skip
    theirs = np.array([float(case["best_cost"] if of == "best" else case[f"{of}_cost"][k]) for case in cases])
    good = (mine["claimed"] > 0) & kept(mine["violation"], mine["outside"])
    return np.where(good, mine["cost"] / theirs - 1, np.inf)


def optimum_rows(cases: Sequence[Case]) -> Rows:
    """All rows; a scene in which the augmented Lagrangian found nothing counts as not within, as a planner's failure does."""
    solved = [case for case in cases if bool(case["solved"])]
    rows: Rows = {
        f"{BEGIN}_scenes": {"value": float(len(cases)), "unit": "scenes"},
        f"{BEGIN}_unsolved": {"value": float(len(cases) - len(solved)), "unit": "scenes"},
    }
    if not solved:
        return rows

    def largest(name: str, values: Sequence[Any] | NDArray, unit: str) -> None:
        finite = np.array(values, float)
        finite = finite[np.isfinite(finite)]
        rows[f"{BEGIN}_{name}"] = {"value": float(finite.max()) if len(finite) else np.nan, "unit": unit}

    for k, name in enumerate(COMPARED):
        for of, begin in (("best", ""), ("equal", "equal_"), ("own", "own_")):
            over = excess(solved, of, k)
            largest(f"{begin}cost_max_{name}", over, "1")
            # a scene without a reference is not one in which it was reached
            rows[f"{BEGIN}_{begin}within_{name}"] = row(
                share(np.append(over <= WITHIN, np.zeros(len(cases) - len(solved), bool))), "1"
            )
        failed = ~np.isfinite(excess(solved, "best", k))
        rows[f"{BEGIN}_failed_{name}"] = {"value": float(failed.sum()), "unit": "scenes"}
        largest(f"violation_{name}", [1000 * case["violation"][k] for case in solved], "mm")
    largest("violation_best", [1000 * case["best_violation"] for case in solved], "mm")
    largest("residual", [1000 * case["residual"] for case in solved], "mm")
    lost = sum(not np.isfinite(case["equal_residual"]).all() for case in solved)
    rows[f"{BEGIN}_equal_lost"] = {"value": float(lost), "unit": "scenes"}
    return rows
