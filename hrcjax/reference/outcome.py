"""The outcome of an episode against the ground truth; as `hrcjax.sim.outcome`, in NumPy and C MuJoCo."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.reference import measures
from hrcjax.reference.plain import plain
from hrcjax.reference.safety import safe_distance
from hrcjax.reference.sound_score import sound_scores
from hrcjax.reference.truth import approach_speeds, obstacle_distances, person_distance
from hrcjax.safety import SsmParams
from hrcjax.sim import Cell, Params, World

REACHED = 0.02
"""Distance of the tool to the goal that counts as reached [m]."""
MOVING = 0.01
"""Speed of any joint above which the arm counts as moving [rad/s]."""
AFTER = 1.0
"""Time after the arrival at which the episode ends [s]."""


@dataclass(frozen=True)
class SerialOutcome:
    """Metrics by name, traces at every `cell.metric_stride` ticks, and status."""

    metrics: dict[str, float]
    separation: NDArray
    """Exact distance of the arm to the person [m]."""
    clearance: NDArray
    """Exact distance of the arm to the nearest obstacle [m]."""
    speed: NDArray
    """Speed of the tool [m/s]."""
    run_status: int
    """Bits of the tick status, combined over all ticks."""
    hit: bool
    """Whether arm and person touched at a tick in which the arm moved."""
    run_into: bool
    """Whether they touched at a tick in which it stood."""


def protective_distances(params: SsmParams, approach: NDArray, separation: NDArray) -> NDArray:
    """S_p = v_h (T_r + T_s) + v_r T_r + S_s + C + Z_d + Z_r (ISO/TS 15066, 5.5.4) [m].

    Args:
        approach: speed of the arm towards the person; a retreat counts as 0 [m/s].
        separation: decides the person's assumed speed (ISO 13855) [m].
    """
    v_r = np.maximum(approach, 0.0)
    v_h = np.where(separation < params.near, params.v_h_near, params.v_h)
    T_s, S_s = v_r / params.brake, v_r**2 / (2 * params.brake)
    moving = v_h * (params.reaction_time + T_s) + v_r * params.reaction_time + S_s
    return moving + params.intrusion + params.Z_d + params.Z_r


def outcome(params: Params, cell: Cell, world: World, waypoints: NDArray, record: Any) -> SerialOutcome:
    """The metrics of an episode.

    Args:
        params: with plain numbers as leaves.
        waypoints: the planned path, (waypoint 3) [m].
        record: every tick, with the names and units of `hrcjax.sim.Record`.
    """
    params, k, dt = plain(params), cell.metric_stride, cell.dt
    ssm, goal = params.safety.ssm, np.asarray(world.scene.goal)
    q, qd, qdd, tau, tool = (np.asarray(getattr(record, name)) for name in ("q", "qd", "qdd", "tau", "tool"))
    zone, every = np.asarray(record.zone), obstacle_distances(cell.arm, world.scene, q)
    apart = person_distance(cell.arm, world.person, q, cell.times)
    approach = approach_speeds(cell.arm, world.person, q[::k], qd[::k], cell.times[::k])
    separation, obstacles = apart[::k], every[::k]
    clearance = obstacles.min(axis=1)
    closing = -np.gradient(separation, k * dt)
    protective = protective_distances(ssm, approach, separation)
    below = separation < protective

    at = measures.arrival(tool, goal, REACHED, dt)
    counts = np.arange(len(tool)) <= (at.index + round(AFTER / dt) if at.success else len(tool))
    touch, moving = counts & (apart < 0), np.abs(qd).max(axis=1) > MOVING
    until, some = slice(0, at.index + 1), slice(0, at.index // k + 1)
    way, seldom = tool[until], tool[::k][some]
    evenly = measures.evenly(np.concatenate([way, way[-1:]]), measures.TOOL_WAYPOINTS)
    rate = 1 / (k * dt)
    jerk, dimensionless = measures.jerk_measures(seldom, rate)
    speed = np.zeros(len(tool[::k]) - 1)
    speed[: len(seldom) - 1] = measures.size(np.diff(seldom, axis=0)) * rate
    planned = measures.path_length(waypoints)
    ideal = planned / params.motion.speed + params.motion.speed / params.motion.clock.acceleration
    safety = measures.safety_score(
        separation[some], closing[some], obstacles[some][:, np.asarray(world.scene.mask)], safe_distance(ssm, 0.0)
    )
    efficiency = measures.efficiency_score(q[until], qd[until], qdd[until], tau[until], dt, ideal, at.time)
    metrics = {
        "time_to_goal": at.time,
        "success": float(at.success),
        "goal_error": float(measures.size(tool[at.index] - goal)),
        "plan_length": planned,
        "plan_bending_energy": measures.path_bending(waypoints),
        "tool_length": measures.path_length(way),
        "tool_bending_energy": measures.path_bending(evenly),
        "clearance": float(every[counts].min()),
        "separation": float(apart[counts].min()),
        "jerk_rms": jerk,
        "log_dimensionless_jerk": dimensionless,
        "sparc": measures.spectral_arc_length(speed, rate),
        **{
            f"time_{name}": float((zone[until] == number).sum()) * dt
            for number, name in enumerate(("green", "yellow", "red", "stop"))
        },
        "time_below_sp": float(below[some].sum()) * k * dt,
        "energy": float(np.abs(tau[until] * qd[until]).sum()) * dt,
        "score_safety": safety,
        "score_efficiency": efficiency,
        "score_overall": 0.8 * safety + 0.2 * efficiency,
    }
    straight = ideal * min(float(measures.size(goal - tool[0])) / planned, 1.0)
    metrics |= sound_scores(
        metrics["clearance"],
        separation,
        protective,
        at.index // k + 1,
        at.success,
        bool(touch.any()) or metrics["clearance"] < 0,
        (straight, at.time),
        dimensionless,
        metrics["energy"],
    )
    return SerialOutcome(
        metrics=metrics,
        separation=separation,
        clearance=clearance,
        speed=measures.size(np.gradient(tool, dt, axis=0))[::k],
        run_status=int(np.bitwise_or.reduce(np.asarray(record.status))),
        hit=bool((touch & moving).any()),
        run_into=bool((touch & ~moving).any()),
    )
