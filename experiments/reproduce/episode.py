"""The tool on its optimised path beside a person who reaches in, with and without zones: what figures 15 to 17 show.

As the paper does it: the distance is that of the tool alone, the path's geometry stays, only its clock reacts. The whole arm is the
business of the closed loop.
"""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.segment import point_segment_distance
from hrcjax.metrics.score import ScoreParams, collision_risk, obstacle_proximity, safe_navigation, task_time_score
from hrcjax.plan import PathCurve, PotentialParams, law_speed, path_curve
from hrcjax.safety import (  # fmt: skip
    ClockParams,
    ClockState,
    SafetyParams,
    ZoneState,
    advance,
    initial_clock,
    initial_zone,
    update_zone,
    zone_speed,
    zone_thresholds,
)
from hrcjax.typing import Array, Bool, Float, Int
from hrcjax.world import Person, motion_named, obstacle_distances, person_at, robotica

from .paths import SCENE
from .readings import row_scene

DT, DURATION = 0.008, 12.0
"""Control period and length of the episode [s]."""
PERSON, REACH = "reach_in", 5.0
"""Motion of the person, and how long it takes [s]."""
ARRIVED = 0.01
"""Way that remains at the arrival [m]."""


class Tick(eqx.Module):
    """What is recorded."""

    tool: Float[Array, "3"]
    """Position [m]."""
    speed: Float[Array, ""]
    """Along the path [m/s]."""
    acceleration: Float[Array, ""]
    """[m/s^2]."""
    remaining: Float[Array, ""]
    """Way to the goal [m]."""
    person: Float[Array, "3"]
    """The person's nearest point on the capsule's axis [m]."""
    separation: Float[Array, ""]
    """Tool to the person's surface [m]."""
    zone: Int[Array, ""]


def nearest(person: Person, t: Array, x: Float[Array, "3"]) -> tuple[Array, Array]:
    """Distance of a point to the person's surface [m], and the nearest point of the axes of the capsules [m]."""
    capsules = person_at(person, t)
    gap = jax.vmap(point_segment_distance, in_axes=(None, 0, 0))(x, capsules.a, capsules.b) - capsules.radius
    gap = jnp.where(capsules.radius >= 0, gap, 1e3)
    k = jnp.argmin(gap)
    a, along = capsules.a[k], capsules.b[k] - capsules.a[k]
    part = jnp.clip(jnp.sum((x - a) * along) / jnp.maximum(jnp.sum(along * along), 1e-12), 0, 1)
    return gap[k], a + part * along


def played(curve: PathCurve, person: Person, zones: Bool[Array, ""]) -> Tick:
    """The episode; without zones the clock knows no limit but the law of motion."""
    dtype = curve.length.dtype
    safety, clock, potential = jax.tree.map(
        lambda x: jnp.asarray(x, dtype), (SafetyParams(), ClockParams(), PotentialParams())
    )

    def tick(carry: tuple[ClockState, ZoneState], t: Array) -> tuple[tuple[ClockState, ZoneState], Tick]:
        at, state = carry
        x, remaining = curve.point(at.s), curve.length - at.s
        gap, spot = nearest(person, t, x)
        state = update_zone(safety, state, gap, True, DT)
        limit = jnp.where(zones, zone_speed(safety, state.zone, gap), jnp.inf)
        law = law_speed(potential, remaining, jnp.zeros((), dtype))
        now = Tick(x, at.v, at.a, remaining, spot, gap, state.zone)
        return (advance(clock, at, jnp.minimum(law, limit), remaining, DT), state), now

    times = DT * jnp.arange(round(DURATION / DT), dtype=dtype)
    return jax.lax.scan(tick, (initial_clock(dtype), initial_zone(dtype)), times)[1]


def episode_case(reading: str, waypoints: Any) -> Mapping[str, Any]:
    """Arrays with a leading axis: without zones, with zones; along a path in a reading [m]."""
    with jax.enable_x64(True):
        curve = path_curve(jnp.asarray(waypoints, jnp.float64))
        scene = robotica(reading, jnp.float64)
        person = motion_named(PERSON, scene, 0, REACH)
        run = jax.jit(jax.vmap(played, in_axes=(None, None, 0)))(curve, person, jnp.asarray([False, True]))
        limits = zone_thresholds(SafetyParams())
        return {
            "reading": np.array(reading),
            "time": DT * np.arange(round(DURATION / DT)),
            "thresholds": np.array([float(limits.stop), float(limits.yellow), float(limits.green)]),
            **{name: np.asarray(getattr(run, name)) for name in run.__dataclass_fields__},
        }


def arrival(case: Mapping[str, Any], run: int) -> float:
    """Time at which 1 cm of the path remains; infinite: never [s]."""
    there = np.flatnonzero(case["remaining"][run] < ARRIVED)
    return float(case["time"][there[0]]) if len(there) else float("inf")


NAMES = ("task_time", "safe_navigation", "obstacle_proximity", "collision_risk")
"""The measures of table IX that a path of the tool has."""


def measures(case: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Table IX's measures that a path of the tool has, in percent, without and with zones, until the arrival."""
    scene, ends = row_scene(str(case["reading"]), SCENE), [arrival(case, run) for run in (0, 1)]

    def one(end: Array, tool: Float[Array, "time 3"], gap: Float[Array, "time"]) -> tuple[Array, ...]:
        mask = jnp.asarray(case["time"]) <= end
        solids = jax.vmap(lambda x: obstacle_distances(scene, x))(tool)
        return (
            task_time_score(ends[0], end),
            safe_navigation(gap, float(case["thresholds"][0]), mask),
            obstacle_proximity(gap, solids, mask),
            collision_risk(gap, -jnp.gradient(gap, DT), ScoreParams().horizon, mask),
        )

    with jax.enable_x64(True):
        found = jax.jit(jax.vmap(one))(*(jnp.asarray(x) for x in (ends, case["tool"], case["separation"])))
        return {name: (float(pair[0]), float(pair[1])) for name, pair in zip(NAMES, found, strict=True)}
