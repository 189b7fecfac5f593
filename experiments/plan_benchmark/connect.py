"""OMPL's RRTConnect with simplification for the arm, as the peer: validity in NumPy, one configuration at a time."""

# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# ompl is compiled and an extra: it has no types where it is not installed

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.plan.link_model import LinkModel, link_model
from hrcjax.robot import Arm

from .problems import TIGHT, Problems

try:
    from ompl import base, geometric, util
except ImportError:
    base = geometric = util = None

INFLATION = 0.001
"""Of the spheres that RRTConnect checks; of the arm's own links it checks the same spheres [m]."""


def installed() -> bool:
    """Whether OMPL is there."""
    return base is not None


def _frames(arm: Arm, q: NDArray) -> list[tuple[NDArray, NDArray]]:
    """Axes and origins of the joint frames."""
    R, o, found = np.eye(3), np.zeros(3), []
    chain = arm.chain
    for i in range(chain.size):
        o = o + R @ chain.pos[i]
        cos, sin = np.cos(q[i]), np.sin(q[i])
        R = R @ chain.rotation[i] @ np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        found.append((R, o))
    return found


class Validity:
    """Whether a configuration is free among the obstacles of a problem."""

    def __init__(self, model: LinkModel, problems: Problems, k: int) -> None:
        arm, n = model.arm, int(problems.boxes[k])
        chain = arm.chain
        self.arm = arm
        self.local = [
            (link, at @ chain.link_rotation[link].T + chain.link_pos[link], radii) for link, at, radii in model.spheres
        ]
        self.radii, self.links = model.radii, model.sphere_links
        self.center, self.half, self.grown = problems.center[k, :n], problems.half[k, :n], problems.radius[k, :n]
        self.rotation = np.tile(np.eye(3), (n, 1, 1)) if problems.rotation is None else problems.rotation[k, :n]
        self.base = [
            np.stack([arm.capsule_a[j], arm.capsule_b[j]]) for j, link in enumerate(arm.capsule_links) if link < 0
        ]
        self.checks = 0
        apart = self.radii[:, None] + self.radii[None]
        near = {(min(links), max(links)) for links in _checked_links(model)}
        mask = np.array([[(min(a, b), max(a, b)) in near for b in self.links] for a in self.links])
        self.apart = np.where(mask, apart - 2 * INFLATION, 0)

    def __call__(self, q: NDArray) -> bool:
        """True if free."""
        self.checks += 1
        frames = _frames(self.arm, q)
        x = np.concatenate([at @ frames[link][0].T + frames[link][1] for link, at, _ in self.local])
        if (x[self.links > 0, 2] < self.radii[self.links > 0]).any():
            return False
        away = np.einsum("bmk,sbm->sbk", self.rotation, x[:, None] - self.center)
        beyond = np.abs(away) - self.half
        distance = np.linalg.norm(np.maximum(beyond, 0), axis=2) + np.minimum(beyond.max(axis=2), 0) - self.grown
        if (distance < self.radii[:, None]).any():
            return False
        between = ((x[:, None] - x[None]) ** 2).sum(axis=2)
        return not (between < self.apart**2).any()


def _checked_links(model: LinkModel) -> list[tuple[int, int]]:
    """Pairs of links all of whose capsules are checked against each other; the base is left to the judge."""
    links = model.arm.capsule_links
    return [(links[i], links[j]) for i, j in model.pairs if links[i] >= 0 and (links[i], links[j]) != (2, 4)]


def rrt_connect(arm: Arm, problems: Problems, k: int, budget: float) -> tuple[NDArray | None, float]:
    """A path, and the time that it took [s]; None: none within the budget [s]."""
    model = link_model(arm, INFLATION, 0.0, TIGHT)
    valid = Validity(model, problems, k)
    util.setLogLevel(util.LOG_NONE)
    n = arm.chain.size
    begin = time.process_time()
    space = base.RealVectorStateSpace(n)
    bounds = base.RealVectorBounds(n)
    for j in range(n):
        bounds.setLow(j, float(arm.q_min[j]))
        bounds.setHigh(j, float(arm.q_max[j]))
    space.setBounds(bounds)
    simple = geometric.SimpleSetup(space)

    def is_valid(state: Any) -> bool:
        return valid(np.array([state[j] for j in range(n)]))

    simple.setStateValidityChecker(is_valid)
    info = simple.getSpaceInformation()
    info.setStateValidityCheckingResolution(np.deg2rad(2.0) / float(np.linalg.norm(arm.q_max - arm.q_min)))
    ends = []
    for q in (problems.start[k], problems.goal[k]):
        state: Any = space.allocState()
        for j in range(n):
            state[j] = float(q[j])
        ends.append(state)
    simple.setStartAndGoalStates(*ends)
    simple.setPlanner(geometric.RRTConnect(info))
    simple.setup()
    simple.solve(budget)
    if not simple.haveExactSolutionPath():
        return None, time.process_time() - begin
    simple.simplifySolution(budget)
    states = simple.getSolutionPath().getStates()
    return np.array([[state[j] for j in range(n)] for state in states]), time.process_time() - begin
