"""OMPL's planners of the arm, with its simplification: validity by C MuJoCo's collisions of the same capsules and obstacles."""

# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# ompl is compiled and an extra: it has no types where it is not installed; nor has mujoco

import time
from functools import cache
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hrcjax.plan.body import self_pairs
from hrcjax.robot import Arm

from .problems import Problems

try:
    from ompl import base, geometric, util
except ImportError:  # told once by the run
    base = geometric = util = None

STEP = np.deg2rad(1.0)
"""Distance of the configurations that are checked on a motion: half the judge's, whose own lie between them [rad]."""
WINDOW = 2.0
"""The space that is sampled is the box of both ends grown by this, within the joints' ranges [rad]."""
SAMPLES = 1000
"""Samples of BFMT* at first; twice as many after every failure within the time."""
PLANNERS = {"rrt_connect": "RRTConnect", "bfmt_star": "BFMT"}
"""Our names of the planners, and OMPL's."""


class Found(NamedTuple):
    """What a planner found."""

    path: NDArray | None
    """(waypoint joint) from start to goal; None: none was found [rad]"""
    seconds: float
    """Time of this process, simplification included [s]."""


def installed() -> bool:
    """Whether OMPL is there."""
    return base is not None


class Validity:
    """Whether a configuration is free among the obstacles of a problem, one at a time."""

    def __init__(self, arm: Arm, tight: tuple[tuple[str, str], ...], problems: Problems, k: int) -> None:
        spec = mujoco.MjSpec()
        body = spec.worldbody
        bodies = [body]
        for pos, rotation in zip(arm.chain.pos, arm.chain.rotation, strict=True):
            body = body.add_body(pos=pos, quat=_quaternion(rotation))
            body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
            bodies.append(body)
        for c, link in enumerate(arm.capsule_links):
            a, b = arm.capsule_a[c], arm.capsule_b[c]
            if link >= 0:
                R, p = arm.chain.link_rotation[link], arm.chain.link_pos[link]
                a, b = p + R @ a, p + R @ b
            _capsule(bodies[link + 1], f"arm {c}", a, b, float(arm.capsule_radii[c]))
        spec.worldbody.add_geom(
            name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], contype=0, conaffinity=0
        )
        for i, j in self_pairs(arm, tight):
            spec.add_pair(geomname1=f"arm {i}", geomname2=f"arm {j}")
        radius = problems.radius[k]
        for box in np.flatnonzero(radius >= 0):
            grown = _obstacle(spec.worldbody, problems, k, int(box))
            for c, link in enumerate(arm.capsule_links):
                if link >= 0:
                    spec.add_pair(geomname1=f"arm {c}", geomname2=f"box {box}", margin=grown)
        for c, link in enumerate(arm.capsule_links):
            if link >= 1:
                spec.add_pair(geomname1=f"arm {c}", geomname2="floor")
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)

    def __call__(self, q: Any) -> bool:
        """True if free."""
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_collision(self.model, self.data)
        return self.data.ncon == 0


def _quaternion(rotation: NDArray) -> NDArray:
    return Rotation.from_matrix(rotation).as_quat(scalar_first=True)


def _capsule(body: Any, name: str, a: NDArray, b: NDArray, radius: float) -> None:
    if np.linalg.norm(b - a) < 1e-9:
        body.add_geom(
            name=name, type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=a, size=[radius, 0, 0], contype=0, conaffinity=0
        )
        return
    ends = np.concatenate([a, b])
    body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=[radius, 0, 0], contype=0, conaffinity=0
    )


def _obstacle(body: Any, problems: Problems, k: int, box: int) -> float:
    """Adds an obstacle; returns by how much its geom is to be grown in contacts [m]."""
    center, half, radius = problems.center[k, box], problems.half[k, box], float(problems.radius[k, box])
    R = np.eye(3) if problems.rotation is None else problems.rotation[k, box]
    flat = np.flatnonzero(half > 0)
    if len(flat) <= 1:
        reach = R[:, flat[0]] * half[flat[0]] if len(flat) else np.zeros(3)
        _capsule(body, f"box {box}", center - reach, center + reach, radius)
        return 0.0
    body.add_geom(
        name=f"box {box}", type=mujoco.mjtGeom.mjGEOM_BOX, pos=center, size=np.maximum(half, 1e-6), quat=_quaternion(R),
        contype=0, conaffinity=0,
    )  # fmt: skip
    return radius


@cache
def _quiet() -> None:
    util.setLogLevel(util.LogLevel.LOG_NONE)


def _setup(arm: Arm, valid: Validity, start: NDArray, goal: NDArray) -> Any:
    n = len(start)
    space = base.RealVectorStateSpace(n)
    bounds = base.RealVectorBounds(n)
    low = np.maximum(np.minimum(start, goal) - WINDOW, arm.q_min)
    high = np.minimum(np.maximum(start, goal) + WINDOW, arm.q_max)
    for j in range(n):
        bounds.setLow(j, float(low[j]))
        bounds.setHigh(j, float(high[j]))
    space.setBounds(bounds)
    simple = geometric.SimpleSetup(space)
    joints = range(n)
    simple.setStateValidityChecker(lambda state: valid([state[j] for j in joints]))  # pyright: ignore[reportIndexIssue]
    info = simple.getSpaceInformation()
    info.setStateValidityCheckingResolution(STEP / float(np.linalg.norm(high - low)))
    ends = []
    for q in (start, goal):
        state: Any = space.allocState()
        for j, value in enumerate(q.tolist()):
            state[j] = value
        ends.append(state)
    simple.setStartAndGoalStates(*ends)
    simple.setOptimizationObjective(base.PathLengthOptimizationObjective(info))  # before the setup
    return simple


def peer(name: str, arm: Arm, tight: tuple[tuple[str, str], ...], problems: Problems, k: int, budget: float) -> Found:
    """What one of OMPL's planners finds for a problem within a time [s]."""
    _quiet()
    util.RNG.setSeed(k + 1)
    valid = Validity(arm, tight, problems, k)
    begin, samples = time.process_time(), SAMPLES
    while True:
        simple = _setup(arm, valid, problems.start[k], problems.goal[k])
        chosen = getattr(geometric, PLANNERS[name])(simple.getSpaceInformation())
        if name == "bfmt_star":
            chosen.setNumSamples(samples)
        simple.setPlanner(chosen)
        simple.setup()
        simple.solve(max(budget - (time.process_time() - begin), 0.0))
        done = simple.haveExactSolutionPath()
        if done or name != "bfmt_star" or time.process_time() - begin >= budget:
            break
        samples *= 2
    if not done:
        return Found(None, time.process_time() - begin)
    simple.simplifySolution(budget)
    states = simple.getSolutionPath().getStates()
    path = np.array([[state[j] for j in range(len(problems.start[k]))] for state in states])
    return Found(path, time.process_time() - begin)
