"""A run of any system, tick by tick, and the exact truth beside it."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.robot import arm_capsules, tool_frame
from hrcjax.sim import Cell
from hrcjax.sim.exact import moving_links, person_distances
from hrcjax.sim.prepare import posture_at
from hrcjax.typing import Array
from hrcjax.world import Person, Scene, capsules_obstacle_distances
from hrcjax.world.person import person_at

PROBES = 33
"""Configurations between the waypoints at which what a system knows is compared with the truth."""
PROBE_TICKS = 25
"""Ticks between two such comparisons."""
BLOCK = 64
"""Ticks whose distances are computed together."""
REACHED, SLOW = 0.02, 0.05
"""Distance to a waypoint [m] and speed of the tool [m/s] that count as an arrival, as in `hrcjax.metrics`."""


class Event(NamedTuple):
    """Something that happened."""

    t: float
    """When [s]."""
    what: str
    """planned, failed, outdated, start, stop, stopped, arrived."""
    value: float
    """planned, failed: configurations checked; stop: time ahead of the collision [s]; arrived: index of the waypoint."""


@dataclass
class Trace:
    """An episode, tick by tick."""

    dt: float
    """Control period [s]."""
    t: NDArray
    """(tick) [s]"""
    q: NDArray
    """(tick joint) [rad]"""
    qd: NDArray
    """(tick joint) [rad/s]"""
    tool: NDArray
    """(tick 3) [m]"""
    separation: NDArray
    """(tick) exact distance of the arm, base included, to the person; 10: nobody is there [m]"""
    clearance: NDArray
    """(tick) exact distance of the moving links to the obstacles on the table [m]"""
    known: NDArray
    """(tick) distance of the moving links to what the system knows of, as it was then [m]"""
    lag: NDArray
    """(tick) largest error of a joint against its command, where a system has one [rad]"""
    zone: NDArray
    """(tick) zone of the safety layer: 0 green, 1 yellow, 2 red, 3 stop; 0 where there is none"""
    probe_t: NDArray
    """(probing) [s]"""
    probe_known: NDArray
    """(probing probe) distance of the arm in a configuration between the waypoints to what the system knows of [m]"""
    probe_true: NDArray
    """(probing probe) exact distance of the arm there to the person [m]"""
    events: list[Event] = field(default_factory=list)
    """Plans, failures, starts, stops, arrivals."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Time that this took, by part [s]."""


def waypoints_of(cell: Cell, scene: Scene) -> NDArray:
    """Joints at the scene's start and goal with the tool down: elbow up, found from the arm's home turned towards each [rad].

    Raises:
        ValueError: one is out of reach.
    """
    return np.stack([np.asarray(posture_at(cell, x), float) for x in (scene.start, scene.goal)])


def probes_between(waypoints: NDArray) -> NDArray:
    """(probe joint) configurations on the straight motion of the joints between the waypoints [rad]"""
    return waypoints[0] + np.linspace(0, 1, PROBES)[:, None] * (waypoints[1] - waypoints[0])


def arrivals(tool: NDArray, ends: NDArray, dt: float) -> list[float]:
    """Times at which a tool comes to rest at the waypoints in turn, the second one first [s].

    Args:
        tool: (tick 3) [m].
        ends: (2 3) the waypoints [m].
        dt: time between ticks [s].
    """
    speed = np.linalg.norm(np.gradient(tool, dt, axis=0), axis=1)
    at = (np.linalg.norm(tool[:, None] - ends, axis=2) <= REACHED) & (speed <= SLOW)[:, None]
    times: list[float] = []
    tick, goal = 0, 1
    while at[tick:, goal].any():
        tick += int(at[tick:, goal].argmax())
        times.append(tick * dt)
        goal = 1 - goal
    return times


def tilts(cell: Cell, q: NDArray) -> NDArray:
    """(tick) angle of the tool's axis to straight down [rad]"""
    R, _ = jax.jit(jax.vmap(lambda one: tool_frame(cell.arm, one)))(jnp.asarray(q, jnp.float32))
    return np.arccos(np.clip(-np.asarray(R, float)[:, 2, 2], -1, 1))


def true_distances(cell: Cell, scene: Scene, person: Person, q: NDArray, t: NDArray) -> tuple[NDArray, NDArray]:
    """Exact distances at moments, of the arm to the person and of its moving links to obstacles [m].

    Args:
        q: (moment joint) [rad].
        t: (moment) [s].
    """
    dtype = scene.start.dtype
    pad = -len(q) % BLOCK
    q, padded = np.concatenate([q, np.repeat(q[-1:], pad, 0)]), np.concatenate([t, np.repeat(t[-1:], pad)])
    parts = [
        _distances(cell, scene, person, jnp.asarray(q[k : k + BLOCK], dtype), jnp.asarray(padded[k : k + BLOCK], dtype))
        for k in range(0, len(q), BLOCK)
    ]
    separation, clearance = (np.concatenate([np.asarray(part[i], float) for part in parts]) for i in (0, 1))
    return separation[: len(t)], clearance[: len(t)]


def _distances(cell: Cell, scene: Scene, person: Person, q: Array, t: Array) -> tuple[Array, Array]:
    return _compiled(cell)(scene, person, q, t)


_PROGRAMS: dict[int, Any] = {}


def _compiled(cell: Cell) -> Any:
    """One program for each arm."""

    def one(scene: Scene, person: Person, q: Array, t: Array) -> tuple[Array, Array]:
        arm = arm_capsules(cell.arm, q)
        links = jax.tree.map(lambda a: a[0], moving_links(cell, jax.tree.map(lambda a: a[None], arm)))
        return jnp.min(person_distances(arm, person_at(person, t))), jnp.min(capsules_obstacle_distances(scene, links))

    key = id(cell.arm)
    if key not in _PROGRAMS:
        _PROGRAMS[key] = jax.jit(jax.vmap(one, (None, None, 0, 0)))
    return _PROGRAMS[key]
