"""Episodes beside people, in both ways to move, against the exact geometry."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hrcjax.reference.truth import person_distance
from hrcjax.safety import STOP
from hrcjax.sim import World
from hrcjax.sim.outcome import MOVING
from hrcjax.world import scene_named

from .bench import Bench, Played, on_host, single
from .retreat import retreat

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
    return case


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
