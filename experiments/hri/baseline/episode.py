"""The baseline beside a person for the ticks of a cell: images, commands, the joint servo, and the exact truth."""

import time
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.robot import ArmState, arm_capsules
from hrcjax.sense.rig import Rig, cell_rig
from hrcjax.sim import Cell, Params
from hrcjax.sim.exact import moving_links, person_distances
from hrcjax.sim.prepare import posture_at
from hrcjax.sim.servo import servo
from hrcjax.typing import Array
from hrcjax.world import Person, Scene, capsules_obstacle_distances
from hrcjax.world.person import person_at

from .baseline import Baseline, Event
from .cameras import Cameras
from .settings import BaselineSettings

PROBES = 33
"""Configurations between the waypoints at which what the octree knows is compared with the truth."""
PROBE_TICKS = 25
"""Ticks between two such comparisons."""
BLOCK = 64
"""Ticks whose distances are computed together."""


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
    """(tick) largest error of a joint against its command [rad]"""
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


def baseline_episode(
    cell: Cell, scene: Scene, person: Person, settings: BaselineSettings, seed: int = 0, rig: Rig | None = None,
    waypoints: NDArray | None = None,
) -> Trace:  # fmt: skip
    """Runs the baseline beside a person for `cell.ticks`.

    Args:
        scene: obstacles, and the waypoints as its start and goal.
        person: everybody in the cell.
        seed: of the noise and the planner.
        rig: the cameras; None: those of the cell.
        waypoints: (waypoint joint), cycled; None: see `waypoints_of` [rad].
    """
    begin = time.perf_counter()
    waypoints = waypoints_of(cell, scene) if waypoints is None else waypoints
    cameras = Cameras(cell, scene, cell_rig(scene) if rig is None else rig, person, jax.random.key(seed))
    baseline = Baseline(cell.arm, waypoints, settings, cell.dt, seed)
    for frame in cameras.set_up(waypoints[0]):
        baseline.see([frame])
    dtype = scene.start.dtype
    follow = Params().motion  # the gains by which our own arm keeps on a path
    gain, stiffness, damping = jnp.asarray(follow.servo_gain, dtype), float(follow.track_kp), float(follow.track_kd)
    moved = jax.jit(lambda q, qd, qdd: servo(gain, cell, ArmState(q, qd), qdd)[0])
    probes = waypoints[0] + np.linspace(0, 1, PROBES)[:, None] * (waypoints[1] - waypoints[0])
    rows: dict[str, list[Any]] = {name: [] for name in ("q", "qd", "known", "lag", "probe_t", "probe_known")}
    spent = {"set-up": time.perf_counter() - begin, "images": 0.0, "baseline": 0.0}
    q, qd = waypoints[0].copy(), np.zeros_like(waypoints[0])
    top = cell.arm.qdd_max
    for tick, t in enumerate(cell.times):
        start = time.perf_counter()
        cameras.expose(tick, q)
        frames = cameras.arrived(t)
        middle = time.perf_counter()
        command = baseline.step(float(t), frames)
        spent["images"] += middle - start
        spent["baseline"] += time.perf_counter() - middle
        qdd = command.qdd + stiffness * (command.q - q) + damping * (command.qd - qd)
        rows["q"].append(q)
        rows["qd"].append(qd)
        rows["known"].append(baseline.known_distance(q[None])[0])
        rows["lag"].append(np.abs(command.q - q).max())
        if tick % PROBE_TICKS == 0:
            rows["probe_t"].append(t)
            rows["probe_known"].append(baseline.known_distance(probes))
        state = moved(*(jnp.asarray(x, dtype) for x in (q, qd, np.clip(qdd, -top, top))))
        q, qd = np.asarray(state.q, float), np.asarray(state.qd, float)
    found = {name: np.array(values) for name, values in rows.items()}
    truth = time.perf_counter()
    separation, clearance = true_distances(cell, scene, person, found["q"], np.asarray(cell.times))
    repeated = np.tile(probes, (len(found["probe_t"]), 1))
    probe_true, _ = true_distances(cell, scene, person, repeated, np.repeat(found["probe_t"], PROBES))
    spent["truth"] = time.perf_counter() - truth
    return Trace(
        dt=cell.dt, t=np.asarray(cell.times), tool=baseline.spheres.tool(found["q"]), separation=separation,
        clearance=clearance, probe_true=probe_true.reshape(-1, PROBES), events=baseline.events, seconds=spent, **found,
    )  # fmt: skip


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
