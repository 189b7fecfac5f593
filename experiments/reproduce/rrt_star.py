"""RRT* of OMPL among the obstacles of a row: the shortest path found by a fixed number of samples."""

import math
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.world.scene import COLUMN

from .printed import TimeRow
from .readings import LOWER, UPPER, row_scene

RANGE = 0.1
"""Longest edge of the tree [m]."""
STAGES = (200, 500, 1000, 1500, 2000, 5000, 10000)
"""Iterations after which a search's best length is noted."""
CHECK = 0.005
"""Distance between two places of an edge that are checked [m]."""


def missing_ompl() -> str:
    """Why RRT* cannot be run, in one line; empty: it can."""
    try:
        _ompl()
    except ImportError:
        return "OMPL is not installed, so rows of RRT* are left out; pip install 'hrcjax[baselines]'"
    return ""


def _ompl() -> tuple[ModuleType, ModuleType, ModuleType]:
    from ompl import base, geometric, util

    return base, geometric, util


def free_of(reading: str, row: TimeRow, margin: float = 0.0) -> Callable[[float, float, float], bool]:
    """Whether a point is outside all obstacles of a row, and `margin` from their surfaces [m]; plain Python, as it is called
    one point at a time."""
    scene = row_scene(reading, row)
    solids = [
        (int(kind), *map(float, center), float(size[0]), float(size[2]))
        for kind, center, size, there in zip(
            *map(np.asarray, (scene.kind, scene.center, scene.size, scene.mask)), strict=True
        )
        if there
    ]

    def free(x: float, y: float, z: float) -> bool:
        for kind, cx, cy, cz, radius, half in solids:
            across = (x - cx) ** 2 + (y - cy) ** 2
            if kind == COLUMN:
                if across < (radius + margin) ** 2 and abs(z - cz) < half + margin:  # else far enough
                    beside, above = math.sqrt(across) - radius, abs(z - cz) - half
                    if beside < 0 or above < 0 or beside * beside + above * above < margin * margin:
                        return False
            elif across + (z - cz) ** 2 < (radius + margin) ** 2:
                return False
        return True

    return free


def search(reading: str, row: TimeRow, seed: int, samples: int, margin: float = 0.0) -> tuple[NDArray, NDArray]:
    """One search, at least `margin` from all obstacles [m]: points of the path that it found, (point, 3), none if it found none [m]; and the least length after each
    number of iterations of `STAGES`, infinite before the first path [m]."""
    base, geometric, util = _ompl()
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(seed)
    scene, free = row_scene(reading, row), free_of(reading, row, margin)
    space = base.RealVectorStateSpace(3)
    bounds = base.RealVectorBounds(3)
    for axis in range(3):
        bounds.setLow(axis, LOWER[axis])
        bounds.setHigh(axis, UPPER[axis])
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    setup.setStateValidityChecker(lambda state: bool(free(state[0], state[1], state[2])))
    info = setup.getSpaceInformation()
    info.setStateValidityCheckingResolution(CHECK / math.dist(LOWER, UPPER))
    setup.setOptimizationObjective(base.PathLengthOptimizationObjective(info))  # before setup
    ends = []
    for spot in (scene.start, scene.goal):
        state = space.allocState()
        for axis, value in enumerate(np.asarray(spot).tolist()):
            state[axis] = value
        ends.append(state)
    setup.setStartAndGoalStates(*ends, 1e-3)
    planner = geometric.RRTstar(info)
    planner.setRange(RANGE)
    setup.setPlanner(planner)
    setup.setup()
    best = np.full(len(STAGES), np.inf)

    def enough() -> bool:
        done = planner.numIterations()
        for k, stage in enumerate(STAGES):
            if done == stage:
                best[k] = planner.bestCost().value()
        return bool(done >= samples)

    setup.solve(base.PlannerTerminationCondition(enough))
    if not setup.haveExactSolutionPath():
        return np.zeros((0, 3)), best
    return np.array([[state[0], state[1], state[2]] for state in setup.getSolutionPath().getStates()]), best


def rrt_case(reading: str, row: TimeRow, seeds: int, samples: int, margin: float = 0.0) -> Mapping[str, Any]:
    """Lengths and paths of several searches, at least `margin` from all obstacles [m]; paths are padded with their last point."""
    found = [search(reading, row, seed, samples, margin) for seed in range(1, seeds + 1)]
    paths = [path for path, _ in found]
    longest = max(2, *(len(path) for path in paths))
    padded = np.full((seeds, longest, 3), np.nan)
    for k, path in enumerate(paths):
        if len(path):
            padded[k] = path[np.minimum(np.arange(longest), len(path) - 1)]
    return {
        "length": np.linalg.norm(np.diff(padded, axis=1), axis=2).sum(axis=1),
        "path": padded,
        "best": np.stack([best for _, best in found]),
    }
