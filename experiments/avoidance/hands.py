"""Episodes beside people, in both ways to move, against the exact geometry."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.reference.truth import person_axes, person_distance
from hrcjax.safety import STOP, SafetyParams, zone_thresholds
from hrcjax.sim import Params, World
from hrcjax.sim.outcome import MOVING
from hrcjax.world import scene_named

from .bench import Bench, Played, on_host, single
from .retreat import from_person, retreat

OPEN = 0.5
"""A goal is closed when the person is beside it for this time, and open again when they stay away as long [s]."""
HINDERED = 0.5
"""Time stopped before the arrival from which on somebody is in the way [s]."""


def hand_case(bench: Bench, scene_name: str, name: str, seed: int) -> Mapping[str, Any]:
    """The episodes of a scene and its people, one for each way to move."""
    scene = scene_named(scene_name, seed)
    world = bench.world(scene, name, seed)
    case: dict[str, Any] = {"scene": scene_name, "person": name, "seed": seed}
    for mode in bench.modes:
        played = bench.play([single(bench.params)], world, mode)[0]
        case |= {f"{key}_{mode}": value for key, value in measured(bench, world, played).items()}
        if mode == bench.modes[0]:
            case |= retreat(bench.cell, scene, world.person, played)
    from_goal = goal_distance(world, np.asarray(bench.cell.times, float))
    return case | {"closed": closed(from_goal, stop_distance(bench.params), bench.cell.dt)}


def goal_distance(world: World, t: NDArray) -> NDArray:
    """Exact distance of the goal to the person, at every tick; infinite without one [m]."""
    host, goal = on_host(world.person), np.asarray(world.scene.goal, float)[None]
    a, b, there = person_axes(host, t)
    apart = np.full(len(t), np.inf)
    for k in np.flatnonzero(there):
        apart[k] = from_person(goal, a[k], b[k], np.asarray(host.radius))[0][0]
    return apart


def stop_distance(params: Params) -> float:
    """The distance at which the arm must stand, S_p(0); 0 with a monitor of one's own [m]."""
    return float(zone_thresholds(params.safety).stop) if isinstance(params.safety, SafetyParams) else 0.0


def closed(from_goal: NDArray, stop: float, dt: float) -> bool:
    """Whether the person, once nearer to the goal than the distance of a stop, never leaves it for `OPEN` before the end: with
    the tool at the goal the arm would be too close in any posture.

    Args:
        from_goal: distance of the goal to the person at every tick [m].
        stop: distance at which the arm must stand [m].
        dt: time between ticks [s].
    """
    near = from_goal < stop
    if near.sum() * dt < OPEN:
        return False
    apart = ~near[near.argmax() :]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], apart, [False]]).astype(int)))
    return bool((edges[1::2] - edges[::2]).max(initial=0) * dt < OPEN)


def measured(bench: Bench, world: World, played: Played) -> dict[str, Any]:
    """What is stored of an episode; it counts until some time after the arrival."""
    goal, person = np.asarray(world.scene.goal, float), world.person
    end = played.end(goal) + 1
    apart = person_distance(bench.cell.arm, on_host(person), played.q[:end].astype(float), played.t[:end])
    moving = np.abs(played.qd[:end]).max(axis=1) > MOVING
    at = played.arrival(goal)
    stopped = (played.zone == STOP)[: len(played.t) if at is None else at + 1]
    return {
        "arrived": at is not None,
        "time": played.time(goal),
        "stopped": stopped.sum() * bench.cell.dt,
        "moving_contact": bool((moving & (apart < 0)).any()),
        "standing_contact": bool((~moving & (apart < 0)).any()),
        "separation_min": apart.min(),
        "separation_t": apart.astype(np.float32),
        "zone_t": played.zone[:end].astype(np.int8),
        "tool": played.tool[:end:5],
        "plan_status": played.plan_status,
    }
