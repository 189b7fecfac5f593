"""One episode against the truth, tick by tick."""

from typing import Any

import numpy as np

from hrcjax.cells.people import FASTEST, recording_notes
from hrcjax.sim.outcome import REACHED
from hrcjax.world import MOTIONS, Person

from .excess import approach, excess_speed
from .static import ALONG, control_points, error_at
from .truth import arm_obstacles, arm_person
from .worlds import Bench, Played, SetUp

SELDOM = 5
"""Ticks between two of the distances to obstacles."""


def is_clean(name: str, duration: float) -> bool:
    """Whether a motion is without jumps."""
    if name in MOTIONS:
        return True
    return not any(f"over {FASTEST:g} m/s" in note for note in recording_notes(name, duration))


def measured(bench: Bench, made: SetUp, person: Person, played: Played) -> dict[str, Any]:
    """What is stored of an episode: what was sensed, and the truth beside it."""
    arm, t, q = bench.cell.arm, played.t, played.q.astype(float)
    distance, speed = approach(arm, person, q, played.qd.astype(float), t)
    goal = np.asarray(made.scene.goal, float)
    return {
        "t": t,
        "q": played.q,
        "qd": played.qd,
        "zone": played.zone,
        "speed_limit": played.speed_limit,
        "separation": played.separation,
        "age": played.age,
        "guarded": played.guarded,
        "cameras": played.cameras,
        "plan_status": played.plan_status,
        "goal_distance": np.linalg.norm(played.tool - goal, axis=1),
        "true_exposed": arm_person(arm, person, q, np.where(np.isfinite(played.age), played.stamp[played.image], t)),
        "true_now": arm_person(arm, person, q, t),
        "excess": excess_speed(distance, speed, bench.params.safety.ssm, bench.cell.dt),
        "clearance": arm_obstacles(arm, made.scene, q[::SELDOM]),
    }


def arrives(case: dict[str, Any]) -> bool:
    """Whether the tool came to the goal."""
    return bool((case["goal_distance"] < REACHED).any())


def episode_case(bench: Bench, made: SetUp, name: str) -> dict[str, Any]:
    """An episode beside the people of a name."""
    person = bench.person(made, name)
    played = bench.play(made, person)
    found = measured(bench, made, person, played)
    found["static_error"] = error_at(bench, made, control_points(bench.cell.arm, played.q[::ALONG].astype(float)))
    found["clean"] = is_clean(name, bench.cell.ticks * bench.cell.dt)
    return found
