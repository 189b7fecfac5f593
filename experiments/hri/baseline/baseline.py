"""The baseline: octree, BFMT*, toppra, and a monitor that stops and plans anew. Images and time in, joint commands out."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrcjax.robot import Arm

from ..trace import Event
from .arm_spheres import ArmSpheres
from .brake import brake
from .collision import FAR, CollisionScene
from .frame import Frame
from .octree import Octree
from .planning import plan
from .settings import BaselineSettings
from .start_state import freed_start
from .timing import Motion, rounded, timed

WATCH_STEP = 0.02
"""Time between two configurations of a running motion that are checked; at most 1.3 cm of the tool's way [s]."""
THERE = 1e-3
"""Stopped so near to a waypoint, the arm has arrived [rad]."""
EASE = 0.005
"""A motion that leaves an obstacle may come nearer to it by this, which is for the distance transform's rounding [m]."""
SPACINGS = tuple(0.75**k for k in range(10))
"""Shares of the largest spacing of the rounding that are tried, until the rounded path is free [1]."""


def blocked_at(clearance: NDArray, gap: float, leaves: bool = False) -> int | None:
    """The first configuration of a motion that is too near to an obstacle; None: there is none.

    Args:
        clearance: (configuration) in their order [m].
        gap: that is asked for [m].
        leaves: the motion is one out of the padding: its first configurations may be too near, where they come no nearer and it
            gets out.
    """
    near = clearance <= gap
    first = int(np.argmin(near)) if leaves and not near.all() else 0  # where it is out
    if (clearance[:first] < clearance[:1] - EASE).any():
        return 0
    later = np.flatnonzero(near[first:])
    return first + int(later[0]) if len(later) else None


class Command(NamedTuple):
    """What the joints are to do now."""

    q: NDArray
    """(joint) [rad]"""
    qd: NDArray
    """(joint) [rad/s]"""
    qdd: NDArray
    """(joint) [rad/s^2]"""


class Search(NamedTuple):
    """A search whose result is due at a time."""

    due: float
    """When its result is there [s]."""
    motion: Motion | None
    """The result."""


class Baseline:
    """Cycles between waypoints.

    `step` is called once in a control period. It stands, moves along a motion, or brakes along it; where it stands without a
    motion it plans, again and again until there is one. The next leg is planned while the arm still moves. Its pace is at most `most`,
    1 unless somebody else lowers it; where that allows more, it follows.
    """  # fmt: skip

    def __init__(self, arm: Arm, waypoints: NDArray, settings: BaselineSettings, dt: float, seed: int = 0) -> None:
        """
        Args:
            arm: the arm.
            waypoints: (waypoint joint) cycled; the arm starts at the first [rad].
            settings: all numbers.
            dt: control period [s].
            seed: of the planner's samples.
        """
        self.settings, self.dt, self.waypoints = settings, dt, np.asarray(waypoints, float)
        self.arm, self.seed = arm, seed
        self.octree = Octree(settings)
        self.spheres = ArmSpheres(arm)
        self.scene = CollisionScene(self.spheres, self.octree)
        self.events: list[Event] = []
        self.goal = 1
        self._q = self.waypoints[0].copy()
        self._motion: Motion | None = None
        self._ahead: NDArray | None = None
        self._search: Search | None = None
        self._place, self._rate, self._braking, self._leaves = 0.0, 0.0, False, False
        self._searches = 0
        self.most = 1.0

    def see(self, frames: Sequence[Frame]) -> None:
        """Takes images in, without moving: for the set-up too."""
        for frame in frames:
            self.octree.insert(frame)
        if frames:
            self.scene.update()

    def known_distance(self, q: NDArray) -> NDArray:
        """(configuration) distance of the arm to the octree's obstacles, as it is now [m]"""
        return self.scene.clearance(self.spheres.centres(q))

    def step(self, t: float, frames: Sequence[Frame] = ()) -> Command:
        """The command of one control period.

        The baseline trusts its joint servo: it plans from where it told the arm to be.

        Args:
            t: now [s].
            frames: images that have arrived since the last call.
        """
        self.see(frames)
        if frames and self._motion is not None and not self._braking:
            self._check(t)
        if self._motion is None:
            self._wait(t)
        if self._motion is None:
            return Command(self._q, np.zeros_like(self._q), np.zeros_like(self._q))
        return self._move(t, self._motion)

    def along(self) -> tuple[NDArray, float]:
        """Speeds of the motion that is played, at pace 1; 0 where there is none [rad/s]. And its pace [1]."""
        if self._motion is None:
            return np.zeros_like(self._q), self._rate
        return self._motion.at(self._place)[1], self._rate

    def _move(self, t: float, motion: Motion) -> Command:
        q, qd, qdd = motion.at(self._place)
        limits = self.settings.brake_scale * self.arm.qdd_max
        slower = brake(qd, qdd, self._rate, limits, self.dt) if self._braking else 0.0
        goes_on = self._rate if self._braking else 1.0
        after = float(np.clip(goes_on + slower * self.dt, 0.0, self.most))
        command = Command(q, qd * self._rate, qdd * self._rate**2 + qd * (after - self._rate) / self.dt)
        self._place += (self._rate + after) / 2 * self.dt
        self._rate = after
        if self._braking and self._rate == 0.0:
            self._stand(t, "stopped", motion, self._place)
        elif self._place >= motion.duration:
            self._stand(t, "arrived", motion, motion.duration)
            self.goal = (self.goal + 1) % len(self.waypoints)
        elif not self._braking and self._idle(t) and motion.duration - self._place < 2 * self.settings.time_limit:
            self._begin(t, self.waypoints[self.goal], (self.goal + 1) % len(self.waypoints))
        return command

    def _idle(self, t: float) -> bool:
        """Whether a search may begin: there is none, or the last one has failed."""
        return self._search is None or (self._search.motion is None and t >= self._search.due)

    def _stand(self, t: float, what: str, motion: Motion, place: float) -> None:
        self.events.append(Event(t, what, float(self.goal)))
        self._q = motion.at(place)[0]
        if what == "stopped":
            self._search = None
            if np.abs(self._q - self.waypoints[self.goal]).max() < THERE:
                self.events.append(Event(t, "arrived", float(self.goal)))
                self.goal = (self.goal + 1) % len(self.waypoints)
        self._motion, self._ahead, self._braking = None, None, False

    def _check(self, t: float) -> None:
        """Stops if what remains of the motion is not free."""
        if self._ahead is None or self._motion is None:
            return
        first = int(self._place / WATCH_STEP)
        last = int(min((self._place + self.settings.horizon) / WATCH_STEP + 1, len(self._ahead)))
        clearance = self.scene.clearance(self._ahead[first:last])
        self._leaves = self._leaves and bool(clearance[0] <= self.settings.watch_gap)
        blocked = blocked_at(clearance, self.settings.watch_gap, self._leaves)
        if blocked is not None:
            self.events.append(Event(t, "stop", blocked * WATCH_STEP))
            self._braking = True

    def _wait(self, t: float) -> None:
        """Plans, or starts what has been planned."""
        if self._search is None:
            self._begin(t, self._q, self.goal)
        search = self._search
        if search is None or t < search.due:
            return
        self._search = None
        if search.motion is None:
            return
        ahead = self._configurations(search.motion)
        clearance = self.scene.clearance(ahead)
        if clearance[0] <= 0 or blocked_at(clearance, self.settings.watch_gap, leaves=True) is not None:
            self.events.append(Event(t, "outdated", 0.0))
            return
        self._leaves = bool(clearance[0] <= self.settings.watch_gap)
        self._motion, self._ahead, self._place, self._rate = search.motion, ahead, 0.0, self.most
        self.events.append(Event(t, "start", search.motion.duration))

    def _configurations(self, motion: Motion) -> NDArray:
        """(time sphere 3) where the arm's spheres will be [m]"""
        t = np.append(np.arange(0.0, motion.duration, WATCH_STEP), motion.duration)
        return self.spheres.centres(motion.at(t)[0])

    def _begin(self, t: float, start: NDArray, goal: int) -> None:
        """Searches with the octree as it is; the result is due after the planning time."""
        before = self.scene.checks
        self._searches += 1
        motion = self._found(start, self.waypoints[goal])
        checks = self.scene.checks - before
        took = self.settings.planning_time(checks)
        self.events.append(Event(t, "failed" if motion is None else "planned", float(checks)))
        self._search = Search(t + took, motion)

    def _found(self, start: NDArray, goal: NDArray) -> Motion | None:
        settings, scene = self.settings, self.scene
        first = freed_start(settings, scene, start, self.seed + self._searches)
        if first is None:
            return None
        found = plan(settings, scene, first, goal, self.waypoints, 1000 * self.seed + self._searches)
        if found.path is None:
            return None
        path = found.path if np.array_equal(first, start) else np.concatenate([start[None], found.path])
        for part in SPACINGS:
            spline = rounded(path, settings.blend * part)
            along = spline(np.linspace(0, spline.t[-1], 8 * len(spline.c)))
            gaps = scene.clearance(scene.spheres.centres(along))
            if blocked_at(gaps, settings.watch_gap, leaves=True) is None and scene.free(along, -FAR)[1:].all():
                return timed(settings, self.spheres, spline)
        return None
