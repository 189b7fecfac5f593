"""OMPL's planners of a point: RRT*, Informed RRT* and BFMT*, each with OMPL's simplification."""

# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# ompl is compiled and an extra: it has no types where it is not installed

import math
import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.world.scene import COLUMN, SPHERE

from .found import Found
from .scenes import CLEARANCE, PointScene

try:
    from ompl import base, geometric, util
except ImportError:  # told once by the run
    base = geometric = util = None

RESOLUTION = 0.004
"""Spacing of the points that are checked on a motion [m]."""
SAMPLES = 1000
"""Samples of BFMT* at first; twice as many after every failure within the time."""
SHARE = 0.1
"""Part of the time that is kept for the simplification, where the planner itself stops only when it is over [1]."""
SAMPLING = {"rrt_star": "RRTstar", "informed_rrt_star": "InformedRRTstar", "bfmt_star": "BFMT"}
"""Our names of the planners, and OMPL's."""


def installed() -> bool:
    """Whether OMPL is there."""
    return base is not None


def keeps_clearance(scene: PointScene, clearance: float = CLEARANCE) -> Callable[[float, float, float], bool]:
    """Whether a point keeps the clearance to all obstacles, in plain floats: fast for single points."""
    tests = [
        _one(int(kind), center.tolist(), size.tolist(), float(yaw), clearance)
        for kind, center, size, yaw in zip(scene.kind, scene.center, scene.size, scene.yaw, strict=True)
    ]

    def kept(x: float, y: float, z: float) -> bool:
        return all(test(x, y, z) for test in tests)

    return kept


def _one(
    kind: int, center: list[float], size: list[float], yaw: float, clearance: float
) -> Callable[[float, float, float], bool]:
    cx, cy, cz = center
    a, b, c = size
    square = clearance * clearance
    if kind == SPHERE:
        reach = (a + clearance) ** 2
        return lambda x, y, z: (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2 >= reach
    if kind == COLUMN:

        def off_column(x: float, y: float, z: float) -> bool:
            u, w = math.hypot(x - cx, y - cy) - a, abs(z - cz) - c
            return (u if u > 0 else 0.0) ** 2 + (w if w > 0 else 0.0) ** 2 >= square

        return off_column
    cos, sin = math.cos(yaw), math.sin(yaw)

    def off_box(x: float, y: float, z: float) -> bool:
        dx, dy = x - cx, y - cy
        u, v, w = abs(cos * dx + sin * dy) - a, abs(cos * dy - sin * dx) - b, abs(z - cz) - c
        return ((u if u > 0 else 0.0) ** 2 + (v if v > 0 else 0.0) ** 2 + (w if w > 0 else 0.0) ** 2) >= square

    return off_box


@cache
def _quiet() -> None:
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(1)


def sampling_planner(name: str, budget: float) -> Callable[[PointScene], Found]:
    """One of OMPL's planners with a time budget for search and simplification together [s]."""
    return lambda scene: _planned(scene, SAMPLING[name], budget)


def _setup(scene: PointScene) -> Any:
    space = base.RealVectorStateSpace(3)
    bounds = base.RealVectorBounds(3)
    for k in range(3):
        bounds.setLow(k, float(scene.lower[k]))
        bounds.setHigh(k, float(scene.upper[k]))
    space.setBounds(bounds)
    simple = geometric.SimpleSetup(space)
    kept = keeps_clearance(scene)

    def valid(state: Any) -> bool:
        return kept(state[0], state[1], state[2])

    simple.setStateValidityChecker(valid)
    info = simple.getSpaceInformation()
    info.setStateValidityCheckingResolution(RESOLUTION / float(np.linalg.norm(scene.upper - scene.lower)))
    ends = []
    for x in (scene.start, scene.goal):
        state: Any = space.allocState()
        for k in range(3):
            state[k] = float(x[k])
        ends.append(state)
    simple.setStartAndGoalStates(*ends)
    simple.setOptimizationObjective(base.PathLengthOptimizationObjective(info))  # before the setup
    return simple


def _planned(scene: PointScene, planner: str, budget: float) -> Found:
    _quiet()
    begin = time.perf_counter()
    samples = SAMPLES
    while True:
        simple = _setup(scene)
        chosen = getattr(geometric, planner)(simple.getSpaceInformation())
        left = budget - (time.perf_counter() - begin)
        if planner == "BFMT":
            chosen.setNumSamples(samples)
        else:
            left -= SHARE * budget
        simple.setPlanner(chosen)
        simple.setup()
        simple.solve(max(left, 0.0))
        if simple.haveExactSolutionPath() or planner != "BFMT" or time.perf_counter() - begin >= budget:
            break
        samples *= 2
    if not simple.haveExactSolutionPath():
        return Found(np.stack([scene.start, scene.goal]), False, time.perf_counter() - begin)
    raw = _points(simple)
    simple.simplifySolution(max(budget - (time.perf_counter() - begin), 0.01))
    seconds = time.perf_counter() - begin
    simplified = _points(simple)
    return Found(simplified if _length(simplified) <= _length(raw) else raw, True, seconds)


def _points(simple: Any) -> NDArray:
    return np.array([[state[k] for k in range(3)] for state in simple.getSolutionPath().getStates()])


def _length(points: NDArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
