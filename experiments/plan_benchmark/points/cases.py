"""One planner in one scene, measured: what is stored."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .curve import executed
from .found import Found
from .ours import OURS, compiled_planner
from .sampling import SAMPLING, sampling_planner
from .scenes import PointScene
from .timing import times

PLANNERS = (*OURS, *SAMPLING)
"""All by name."""
DRAWN = 0.005
"""Spacing of the points of a curve that are kept for figures [m]."""


def measured(scene: PointScene, found: Found) -> dict[str, Any]:
    """All measures of a planner's path, once the curve that is executed of it is chosen.

    `success`: the planner claims it, and the check agrees.
    """
    curve, verdict = executed(scene, found.points)
    success = found.claimed and verdict.kept
    optimal, smooth = times(curve) if success else (np.nan, np.nan)
    return {
        "success": success, "claimed": found.claimed, "kept": verdict.kept, "clearance": verdict.clearance, "broken": curve.broken,
        "length": curve.length(), "bending": curve.bending_energy(), "optimal": optimal, "smooth": smooth, "seconds": found.seconds,
        "curve": curve.sampled(DRAWN) if success else found.points,
    }  # fmt: skip


class Bench:
    """The planners by name; the library's are compiled when first asked for."""

    def __init__(self, budget: float) -> None:
        self.budget = budget
        self.compile_seconds: dict[str, float] = {}
        self._planners: dict[str, Callable[[PointScene], Found]] = {}

    def planner(self, name: str, example: PointScene) -> Callable[[PointScene], Found]:
        """One planner, warm."""
        if name not in self._planners:
            if name in OURS:
                self._planners[name], self.compile_seconds[name] = compiled_planner(name, example)
                self._planners[name](example)
            else:
                self._planners[name] = sampling_planner(name, self.budget)
        return self._planners[name]

    def case(self, name: str, scene: PointScene) -> Mapping[str, Any]:
        """A planner in a scene."""
        found = self.planner(name, scene)(scene)
        return {**measured(scene, found), "compile": self.compile_seconds.get(name, np.nan)}


def stored_scenes(scenes: Mapping[int, PointScene], rejected: Mapping[str, int]) -> dict[str, Any]:
    """Seeds of the feasible scenes, and how many seeds were rejected for which reason."""
    return {"seed": np.array(list(scenes)), "reason": np.array(list(rejected)), "count": np.array(list(rejected.values()), int)}  # fmt: skip


def names_of(planners: Sequence[str]) -> tuple[str, ...]:
    """Planners in the order of all."""
    return tuple(name for name in PLANNERS if not planners or name in planners)
