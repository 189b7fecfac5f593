"""What else the arm's planner is tried on and held against: OMPL's planners on the same problems, and problems of other families."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.plan.link_model import LinkModel
from hrcjax.robot import Arm

from .checker import Checker
from .families import FAMILIES, family
from .peers import PLANNERS, Found, peer
from .problems import TIGHT, Problems, drawn_evenly, joined, joint_length
from .rows import Rows, row
from .solve import GUIDED, Solved, solve_all

BUDGET = 5.0
"""Time of each of OMPL's planners for a problem [s]."""
SEED = 2000
"""Of the families' problems. Those of 1000 showed that roadmaps needed more configurations: what is measured is others."""
Say = Callable[[str], None]


def _ratio(ours: Sequence[NDArray | None], theirs: Sequence[NDArray | None], counted: NDArray) -> dict[str, Any] | None:
    """Median of our length over theirs, of the counted problems that both solve."""
    ratios = [
        joint_length(a) / joint_length(b)
        for a, b, counts in zip(ours, theirs, counted, strict=True)
        if counts and a is not None and b is not None
    ]
    return row(np.median(ratios), "1") if ratios else None


def _judged(checker: Checker, problems: Problems, which: NDArray, found: Sequence[Found]) -> list[NDArray | None]:
    """The paths that the exact check accepts."""
    there = [i for i, one in enumerate(found) if one.path is not None]
    paths: list[NDArray | None] = [None] * len(found)
    candidates = [one.path for one in found if one.path is not None]
    for i, path, ok in zip(there, candidates, checker.free(problems, which[there], candidates), strict=True):
        paths[i] = path if ok else None
    return paths


def peer_rows(
    arm: Arm, checker: Checker, problems: Problems, reference_free: NDArray, solved: Solved, count: int, say: Say
) -> Rows:
    """Rows of OMPL's planners on problems drawn evenly."""
    which = drawn_evenly(len(problems), min(count, len(problems)))
    which = which[reference_free[which]]
    hard = solved.stage[which] != 0
    ours = [solved.paths[k] for k in which]
    rows: Rows = {"peer_problems": row(len(which), "1")}
    for name in PLANNERS:
        say(f"{name}: {len(which)} problems")
        found = [peer(name, arm, TIGHT, problems, int(k), BUDGET) for k in which]
        paths = _judged(checker, problems, which, found)
        solves = np.array([path is not None for path in paths])
        rows[f"{name}_success"] = row(solves.mean(), "1")
        rows[f"{name}_ms"] = row(1e3 * np.mean([one.seconds for one in found]), "ms")
        if length := _ratio(paths, [problems.reference[k] for k in which], hard):
            rows[f"{name}_length_hard"] = length
        if length := _ratio(ours, paths, hard):
            rows[f"{name}_ours_over"] = length
        if solves.any():
            kept = [path for path in paths if path is not None]
            rows[f"{name}_clearance"] = row(1e3 * np.median(checker.clearances(problems, which[solves], kept)), "mm")
    return rows


def family_rows(model: LinkModel, checker: Checker, count: int, peers: bool, say: Say) -> Rows:
    """Rows of some problems of every family."""
    rows: Rows = {}
    made = {name: family(name, count, SEED, model.arm, checker) for name in FAMILIES}
    crowd = {name for name, problems in made.items() if problems.center.shape[1] > MANY}
    for names in ([name for name in made if name not in crowd], sorted(crowd)):
        if not names:
            continue
        problems = joined([made[name] for name in names])
        solved = solve_all(model, checker, problems, say)
        for place, name in enumerate(names):
            which = np.arange(place * count, (place + 1) * count)
            stage = solved.stage[which]
            rows[f"family_{name}_success"] = row(((stage >= 0) & (stage < GUIDED)).mean(), "1")
            rows[f"family_{name}_guided"] = row((stage >= 0).mean(), "1")
            rows[f"family_{name}_straight"] = row((stage == 0).mean(), "1")
            if not peers:
                continue
            say(f"rrt_connect: {name}")
            found = [peer("rrt_connect", model.arm, TIGHT, problems, int(k), BUDGET) for k in which]
            paths = _judged(checker, problems, which, found)
            rows[f"family_{name}_rrt_connect"] = row(np.mean([path is not None for path in paths]), "1")
            if length := _ratio([solved.paths[k] for k in which], paths, stage != 0):
                rows[f"family_{name}_ours_over"] = length
        rows[f"family_ms_{'many' if set(names) & crowd else 'few'}"] = row(1e3 * solved.seconds / len(problems), "ms")
    return rows


MANY = 32
"""Families whose problems have more obstacles are solved by a program of their own."""
