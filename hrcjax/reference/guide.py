"""What the arm is asked to do in a tick, and the speed governor; as `hrcjax.sim.guide` and `hrcjax.sim.govern`."""

from dataclasses import dataclass
from math import exp
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrcjax.plan import PotentialParams
from hrcjax.policy import JointLimits
from hrcjax.reference.clock import Clock, advance
from hrcjax.reference.motion import Limits, Motion
from hrcjax.reference.policy import Push, policy_acceleration
from hrcjax.reference.route import SerialRoute, law_speed
from hrcjax.reference.safety import Decision, between_factor, governed, path_speed, speed_scale, surface_limit
from hrcjax.robot import Arm
from hrcjax.safety import half_gaps
from hrcjax.safety.cone import FLATTEST
from hrcjax.sim import Cell, MotionParams, Params
from hrcjax.sim.default_parts import PERSON_FADE, PUSH_FADE
from hrcjax.sim.govern import IN_A_GAP, LOST, RETREAT_TURN


class Room(NamedTuple):
    """Distances of the control spheres, as `hrcjax.sim.Clearance`."""

    distance: NDArray
    gradient: NDArray
    person_distance: NDArray
    person_gradient: NDArray
    standing_distance: NDArray
    standing_gradient: NDArray


@dataclass(frozen=True)
class Approach:
    """Rows of the approach: the surfaces of a point follow one another."""

    distance: NDArray
    radius: NDArray
    share: NDArray
    A: NDArray
    lost: NDArray
    g: NDArray
    J: NDArray

    def speeds(self, qd: NDArray) -> NDArray:
        """Approach speed of every row [m/s]."""
        whole = np.repeat(np.linalg.norm(self.J @ qd, axis=-1), self.g.shape[1])
        return np.where(self.lost, whole, self.A @ qd)

    def worst(self, qd: NDArray, aside: float, widest: float) -> NDArray:
        """Approach speed of every row along the worst direction to a person who is up to `aside` [m] beside where they are seen [m/s]."""
        along, across, angle = self.speeds(qd), self.across(qd), self.angle(aside, widest)
        return np.hypot(along, across) * np.cos(np.maximum(np.arctan2(across, along) - angle, 0.0))

    def steep(self, limit: NDArray, qd: NDArray, aside: float, widest: float) -> NDArray:
        """The limits that make up for motion across [m/s]."""
        angle = self.angle(aside, widest)
        return limit - self.across(qd) * np.sin(angle) / np.maximum(np.cos(angle), FLATTEST)

    def angle(self, aside: float, widest: float) -> NDArray:
        """The angle by which the direction of every row may be off [rad]."""
        if aside <= 0:
            return np.zeros_like(self.distance)
        reach = self.distance + np.repeat(self.radius, self.g.shape[1])
        return np.arcsin(np.minimum(np.where(reach < aside, 1.0, aside / np.maximum(reach, aside)), widest))

    def across(self, qd: NDArray) -> NDArray:
        """Speed of every row's point across its direction; without direction 0 [m/s]."""
        v = np.repeat(self.J @ qd, self.g.shape[1], axis=0)
        directed = _directed(self.g).ravel()
        g = np.where(directed[:, None], self.g.reshape(-1, 3), 0.0)
        g = g / np.where(directed, np.sqrt((g * g).sum(axis=-1)), 1.0)[:, None]
        return np.where(directed, np.linalg.norm(np.cross(g, v), axis=-1), 0.0)

    def limits(self, limit: NDArray) -> NDArray:
        """The limits that control points get; infinite for what is far and has no direction, (point surface) [m/s]."""
        counts = self.lost | _directed(self.g).ravel()
        turn = RETREAT_TURN * np.sqrt((self.A * self.A).sum(axis=-1) + 1e-12)
        given = np.where(limit < 0, np.maximum(limit, -turn), limit * self.share)
        given = np.where(counts, given, np.inf).reshape(self.g.shape[:2])
        for one, g in zip(given, self.g, strict=True):
            if ((g @ g.T < -0.9) & (one < 0)[:, None] & (one < 0)).any():
                np.maximum(one, 0.0, out=one)
        return given


def _directed(g: NDArray) -> NDArray:
    return (g * g).sum(axis=-1) >= 0.25


def towards(arm: Arm, distance: NDArray, g: NDArray, J: NDArray) -> Approach:
    """Rows of points towards surfaces.

    Args:
        distance: (point surface) [m].
        g: (point surface 3) [1].
        J: (point 3 joint) [m].
    """
    directed = _directed(g)
    size = np.where(directed, np.sqrt((g * g).sum(axis=-1)), 1.0)[..., None]
    A = -np.einsum("psk,pkj->psj", np.where(directed[..., None], g / size, 0.0), J)
    gaps = half_gaps(arm.control_links, arm.control_offsets)
    share = between_factor(np.maximum(distance, 0.0) + arm.control_radii[:, None], gaps[:, None])
    lost = ~directed & (distance < LOST)
    return Approach(
        distance.ravel(), np.asarray(arm.control_radii), share.ravel(), A.reshape(-1, A.shape[-1]), lost.ravel(), g, J
    )


def govern(
    params: MotionParams, arm: Arm, qd: NDArray, people: Approach, limit: NDArray, room: Room, top: float
) -> NDArray:
    """The joint speeds nearest to those asked for with which every row keeps its limit [rad/s]."""
    standing = towards(arm, room.standing_distance[:, None], room.standing_gradient[:, None], people.J)
    stop = surface_limit(standing.distance, params.surface_brake, params.surface_margin)
    g = np.concatenate([people.g, standing.g], axis=1)
    stop = np.where(standing.lost, np.maximum(stop, IN_A_GAP), stop)
    kept = governed(qd, people.J, g, np.concatenate([people.limits(limit), standing.limits(stop)], axis=1))
    return slowed(people.J, kept, top)


def slowed(J: NDArray, qd: NDArray, top: float) -> NDArray:
    """The joint speeds with which no point is faster than `top` [rad/s]."""
    speed = np.linalg.norm(J @ qd, axis=-1)
    return speed_scale(speed, np.full_like(speed, top)) * qd


def repelling(potential: PotentialParams, tool: NDArray, end: NDArray, room: Room) -> tuple[Push, Push]:
    """What repels the control points, as `hrcjax.sim.default_parts.repelling`."""
    every = np.ones_like(room.standing_distance)
    fade = float(np.linalg.norm(tool - end)) ** potential.exponent
    return (
        Push(
            potential.k_rep, potential.zeta * potential.sensed_radius * every, fade * every, room.standing_distance,
            room.standing_gradient,
        ),
        Push(
            potential.k_rep, potential.zeta * potential.person_radius * every, PERSON_FADE**potential.exponent * every,
            room.person_distance, room.person_gradient,
        ),
    )  # fmt: skip


def guide(
    params: Params,
    cell: Cell,
    route: SerialRoute,
    clock: Clock,
    q: NDArray,
    qd: NDArray,
    tool: Motion,
    body: Motion,
    room: Room,
    people: Approach,
    decision: Decision,
    limits: JointLimits | Limits,
) -> tuple[NDArray, Clock, NDArray]:
    """Joint acceleration asked for [rad/s^2], the clock after the tick, and the reference of the tool [m]."""
    motion, hold = params.motion, decision.hold
    top = min(motion.speed, decision.any_limit)
    if cell.motion == "reactive":
        way = route.end[0] - tool.x[0]
        distance = float(np.linalg.norm(way))
        pace = min(law_speed(params.potential, distance, 0.0), 0.0 if hold else top)
        velocity = np.broadcast_to(pace * way / distance if distance > 0 else way, (3, 3))
        rest = np.zeros((3, 3))
        joints = route.curve.at(route.curve.length)[0][9:]
        asked = _policy(params, q, qd, tool, route.end - way, velocity, rest, body, room, limits, joints, route.end[0])
        return asked, clock, tool.x[0]

    place, tangent, bend = route.curve.at(clock.s)
    off = float(np.linalg.norm(place[:3] - tool.x[0]))
    pace = min(top, route.pace(params.potential, clock.s))
    if cell.motion == "path":
        pace = min(pace, path_speed(tangent[9:], people.A, people.share * decision.point_limit)) * exp(
            -((off / motion.lag) ** 2)
        )
    else:
        pace *= exp(-((off / motion.leash) ** 2))
    after = advance(motion.clock, clock, pace, route.curve.length - clock.s, cell.dt, hold)
    velocity, acceleration = tangent * clock.v, bend * clock.v**2 + tangent * after.a
    if cell.motion == "path":
        back = motion.track_kp * (place[9:] - q) + motion.track_kd * (velocity[9:] - qd)
        return acceleration[9:] + back, after, place[:3]
    x, xd, xdd = (part[:9].reshape(3, 3) for part in (place, velocity, acceleration))
    asked = _policy(params, q, qd, tool, x, xd, xdd, body, room, limits, place[9:], route.end[0])
    return asked, after, place[:3]


def _with(params: Any, **values: Any) -> Any:
    return SimpleNamespace(**{**vars(params), **values})


def _policy(
    params: Params, q: NDArray, qd: NDArray, tool: Motion, x: NDArray, xd: NDArray, xdd: NDArray, body: Motion, room: Room,
    limits: JointLimits | Limits, posture: NDArray, end: NDArray,
) -> NDArray:  # fmt: skip
    squared = float(((tool.x[0] - end) ** 2).sum())
    push = params.policy.collision.k_rep * squared / (squared + PUSH_FADE**2)
    policy = _with(params.policy, collision=_with(params.policy.collision, k_rep=push))
    return policy_acceleration(
        policy,
        q,
        qd,
        tool,
        x,
        xd,
        xdd,
        body,
        room.distance,
        room.gradient,
        limits,
        posture,
        repel=repelling(params.potential, tool.x[0], end, room),
    )
