"""An episode: control tick after control tick, in the order of `hrcjax.sim.tick`."""

from bisect import bisect_right
from dataclasses import dataclass
from math import inf
from typing import cast

import numpy as np
from numpy.typing import NDArray

from hrcjax.field import FieldParams
from hrcjax.presence.cloud import COARSE_FROM
from hrcjax.reference.arm import SerialArm
from hrcjax.reference.clock import Clock
from hrcjax.reference.fields import Field, Scene, Spread, fit, read, scene_of, unit_where_long
from hrcjax.reference.guide import Room, govern, guide, slowed, towards
from hrcjax.reference.limits import limit_acceleration
from hrcjax.reference.motion import Limits, Motion
from hrcjax.reference.plain import plain
from hrcjax.reference.route import SerialRoute
from hrcjax.reference.safety import Monitor, Zone, speed_scale
from hrcjax.robot import COVER_MARGIN
from hrcjax.safety import APPROACH_TOLERANCE
from hrcjax.sim import Cell, Frames, Params
from hrcjax.sim.default_parts import COARSE_EDGE


@dataclass(frozen=True)
class Seen:
    """The camera's frames as fitted fields."""

    scene: Scene
    """What stands."""
    moving: list[Field]
    """Fields of the moving points, frame by frame."""
    beyond: list[float]
    """Frame by frame: who has no point in it is farther from the base than this [m]."""
    spread: Spread
    """How far people reach beyond their points."""
    taken: list[float]
    """Stamps of all frames, increasing [s]."""
    stamp: list[float]
    """Stamps of the valid frames, increasing [s]."""
    frame: list[int]
    """Indices of these frames."""
    guarded: list[bool]
    """Whether somebody may be where no camera looks, frame by frame."""
    reasons: list[list[int]]
    """What is wrong with the cameras, frame by frame."""
    known: bool
    """False where the map of the scene exceeded a capacity."""


@dataclass(frozen=True)
class SerialRecord:
    """Record of the ticks, time first; names and units of `hrcjax.sim.Record`."""

    q: NDArray
    qd: NDArray
    qdd: NDArray
    tau: NDArray
    tool: NDArray
    reference: NDArray
    travelled: NDArray
    separation: NDArray
    field_clearance: NDArray
    approach: NDArray
    speed_limit: NDArray
    zone: NDArray
    cameras: NDArray
    status: NDArray


def see(params: FieldParams, frames: Frames) -> Seen:
    """Fits the fields of all frames, once for all settings with the same field parameters.

    Args:
        params: with plain numbers as leaves.
        frames: the camera's frames, with increasing stamps.
    """
    if frames.hidden is not None:
        raise ValueError("frames with space where somebody may be unseen; accepted: frames without")
    number = {name: cast(float, value) for name, value in vars(plain(params)).items()}

    def field(points: NDArray, mask: NDArray) -> Field:
        there = np.asarray(points, np.float64)[np.asarray(mask)]
        return fit(there, number["length_scale"], number["noise"], len(mask))

    points, mask = np.asarray(frames.moving.points), np.asarray(frames.moving.mask)
    valid, stamp = np.asarray(frames.valid), np.asarray(frames.stamp, np.float64)
    return Seen(
        scene=scene_of(frames.scene),
        moving=[field(*frame) for frame in zip(points, mask, strict=True)],
        beyond=np.asarray(frames.beyond, np.float64).tolist(),
        spread=Spread(number["spread"], number["far_spread"], number["person_noise"], COARSE_FROM, COARSE_EDGE),
        taken=stamp.tolist(),
        stamp=stamp[valid].tolist(),
        frame=np.flatnonzero(valid).tolist(),
        guarded=np.asarray(frames.guarded).tolist(),
        reasons=np.asarray(frames.reasons).tolist(),
        known=not bool(frames.static_overflow),
    )


def newest(seen: Seen, exposed: float) -> tuple[int, float]:
    """The newest valid frame taken at `exposed` [s] or before, and its age then; none: 0, and infinite [s]."""
    place = bisect_right(seen.stamp, exposed) - 1
    return (seen.frame[place], exposed - seen.stamp[place]) if place >= 0 else (0, inf)


def latest(seen: Seen, exposed: float) -> int:
    """The newest frame taken by then, valid or not; none: 0."""
    return max(bisect_right(seen.taken, exposed) - 1, 0)


def episode(params: Params, cell: Cell, route: SerialRoute, seen: Seen, q_start: NDArray) -> SerialRecord:
    """Follows a route for `cell.ticks` control periods.

    Args:
        params: with plain numbers as leaves.
        route: reference motion of tool and joints.
        q_start: joint positions at the start [rad].
    """
    if cell.contact_mass != "standard":
        raise ValueError(f"contact_mass {cell.contact_mass!r}; the reference accepts: standard")
    if cell.body is not None:
        raise ValueError(
            "a cell that follows the body of a person (Cell.body); the reference accepts: one that does not"
        )
    params, robot, dt = plain(params), cell.arm, cell.dt
    arm = SerialArm(cell)
    arm.reset(q_start)
    limits = Limits(robot.q_min, robot.q_max, robot.qd_max, robot.qdd_max)
    monitor, motion = Monitor(params.safety, dt), params.motion
    count, radii = len(robot.control_links), robot.control_radii
    clock, zone = Clock(), Zone()
    rows = []
    for time in cell.times.tolist():
        q, qd = arm.data.qpos.copy(), arm.data.qvel.copy()
        points = arm.motion()
        body, tool = Motion(*(part[:count] for part in points)), Motion(*(part[count:] for part in points))

        frame, age = newest(seen, time - cell.latency)
        d_all, g_all, d_people, g_people, d_stands, g_stands = read(
            seen.scene, seen.moving[frame], seen.beyond[frame], seen.spread, body.x
        )
        clearance = d_all - radii
        separation = d_people - (radii + COVER_MARGIN)[:, None]
        people = towards(robot, separation, g_people, body.J)
        approach = people.speeds(qd)
        now = latest(seen, time - cell.latency)
        guarded = seen.guarded[frame] or seen.guarded[now]
        old = age + cell.latency
        since = np.clip(
            old + dt - params.safety.ssm.reaction_time, 0.0, params.safety.max_age
        )  # what S_p does not count on
        nearer = people.distance - params.safety.ssm.v_h_near * since
        zone, decision = monitor(zone, nearer, approach, old, seen.known, guarded, separation.shape[1])

        travelled = clock.s
        room = Room(clearance, g_all, separation[:, 0], g_people[:, 0], d_stands - radii, unit_where_long(g_stands))
        asked, clock, reference = guide(
            params, cell, route, clock, q, qd, tool, body, room, people, decision, limits
        )  # fmt: skip
        brake = -qd / dt
        brake = brake / max((np.abs(brake) / limits.qdd_max).max(), 1.0)
        bad = not np.isfinite(asked).all()
        ahead = qd + limit_acceleration(brake if bad else asked, q, qd, limits, dt) * dt
        limit = people.steep(decision.point_limit, qd, decision.aside, decision.widest)
        if cell.motion == "path":
            ahead = speed_scale(people.speeds(ahead), people.share * limit) * ahead
            ahead = slowed(people.J, ahead, decision.any_limit)
        else:
            fastest = float(np.linalg.norm(people.J @ qd, axis=-1).max())
            ahead = govern(motion, robot, ahead, people, limit, room, min(decision.any_limit, fastest + decision.gain))
        after = qd + limit_acceleration((ahead - qd) / dt, q, qd, limits, dt) * dt
        left = np.maximum(decision.point_limit, 0.0) * people.share + APPROACH_TOLERANCE
        after = speed_scale(people.worst(after, decision.aside, decision.widest), left) * after
        qdd = limit_acceleration(brake if decision.hold else (after - qd) / dt, q, qd, limits, dt)
        tau, clipped, broken = arm.servo(motion.servo_gain, qdd)
        rows.append(
            (
                q, qd, qdd, tau, tool.x[0], reference, travelled, separation[:, 0].min(), clearance.min(), approach.max(),
                max(float(decision.point_limit.min()), 0.0), zone.zone, sum(bits << 8 * k for k, bits in enumerate(seen.reasons[now][:3])),
                bad + 2 * clipped + 4 * broken,
            )
        )  # fmt: skip
    return SerialRecord(*(np.array(column) for column in zip(*rows, strict=True)))
