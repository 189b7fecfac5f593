"""Paths of the joints by OMPL's BFMT*, with OMPL's shortcuts."""

# pyright: reportMissingImports=false, reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# ompl is compiled and an extra: it has no types where it is not installed

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .collision import CollisionScene
from .settings import BaselineSettings

try:
    from ompl import base, geometric, util
except ImportError:  # told once by the run
    base = geometric = util = None


class Planned(NamedTuple):
    """Outcome of a search."""

    path: NDArray | None
    """(waypoint joint) from start to goal; None: none was found [rad]"""
    checks: int
    """Configurations that were checked for collision."""
    direct: bool
    """Whether the straight motion was free, so that there was no search."""


def installed() -> bool:
    """Whether OMPL is there."""
    return base is not None


def plan(settings: BaselineSettings, scene: CollisionScene, start: NDArray, goal: NDArray, hull: NDArray, seed: int) -> Planned:  # fmt: skip
    """A free path from start to goal, or none within the limit of checks.

    Args:
        scene: what the paths avoid, as it is now.
        start: joints [rad].
        goal: joints [rad].
        hull: (configuration joint) the space that is sampled includes these [rad].
        seed: of the samples.
    """
    before, gap = scene.checks, settings.plan_gap

    def checks() -> int:
        return scene.checks - before

    if not scene.free(np.stack([start, goal]), gap).all():
        return Planned(None, checks(), False)
    if settings.direct and scene.motion_free(start, goal, gap, settings.step):
        return Planned(np.stack([start, goal]), checks(), True)
    _quiet()
    util.RNG.setSeed(seed + 1)
    simple, info = _setup(settings, scene, np.concatenate([hull, start[None], goal[None]]))
    simple.setStartAndGoalStates(_state(simple, start), _state(simple, goal))
    planner = geometric.BFMT(info)
    planner.setNumSamples(settings.samples)
    planner.setExtendedFMT(True)
    simple.setPlanner(planner)
    simple.setup()
    simple.solve(base.PlannerTerminationCondition(lambda: bool(checks() >= settings.most_checks)))
    if not simple.haveExactSolutionPath():
        return Planned(None, checks(), False)
    path = simple.getSolutionPath()
    if settings.shortcuts:
        short = geometric.PathSimplifier(info)
        short.reduceVertices(path)
        # of the whole way, until as many in a row have failed: by default it ends after as many as there are vertices
        short.partialShortcutPath(path, settings.shortcuts, settings.shortcuts, 1.0, 0.005)
        short.reduceVertices(path)
    return Planned(np.array([_joints(state, len(start)) for state in path.getStates()]), checks(), False)


@cache
def _quiet() -> None:
    util.setLogLevel(util.LogLevel.LOG_NONE)


def _joints(state: Any, count: int) -> list[float]:
    return [state[k] for k in range(count)]


def _state(simple: Any, q: NDArray) -> Any:
    state = simple.getStateSpace().allocState()
    for k, value in enumerate(q.tolist()):
        state[k] = value
    return state


def _setup(settings: BaselineSettings, scene: CollisionScene, hull: NDArray) -> tuple[Any, Any]:
    """The joints about a hull as OMPL's space, with one call of NumPy for each motion that it checks."""
    arm, size, gap = scene.spheres.arm, hull.shape[1], settings.plan_gap
    bounds = base.RealVectorBounds(size)
    for k in range(size):
        bounds.setLow(k, float(max(hull[:, k].min() - settings.window, arm.q_min[k])))
        bounds.setHigh(k, float(min(hull[:, k].max() + settings.window, arm.q_max[k])))
    space = base.RealVectorStateSpace(size)
    space.setBounds(bounds)
    simple = geometric.SimpleSetup(space)
    info = simple.getSpaceInformation()

    class Motions(base.MotionValidator):
        def checkMotion(self, a: Any, b: Any, *last: Any) -> bool:
            ends = np.array([_joints(a, size), _joints(b, size)])
            return scene.motion_free(ends[0], ends[1], gap, settings.step)

    def valid(state: Any) -> bool:
        return bool(scene.free(np.array([_joints(state, size)]), gap)[0])

    simple.setStateValidityChecker(valid)
    info.setMotionValidator(Motions(info))
    simple.setOptimizationObjective(base.PathLengthOptimizationObjective(info))  # before the setup
    return simple, info
