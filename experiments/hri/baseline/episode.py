"""The baseline beside a person for the ticks of a cell: images, commands, the joint servo, and the exact truth."""

import time
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.robot import ArmState
from hrcjax.sense.rig import Rig, cell_rig
from hrcjax.sim import Cell, Params
from hrcjax.sim.servo import servo
from hrcjax.world import Person, Scene

from ..trace import PROBE_TICKS, PROBES, Trace, probes_between, true_distances, waypoints_of
from .baseline import Baseline
from .cameras import Cameras
from .guard import Guard
from .settings import BaselineSettings


def baseline_episode(
    cell: Cell, scene: Scene, person: Person, settings: BaselineSettings, seed: int = 0, rig: Rig | None = None,
    waypoints: NDArray | None = None, guard: Guard | None = None,
) -> Trace:  # fmt: skip
    """Runs the baseline beside a person for `cell.ticks`.

    Args:
        scene: obstacles, and the waypoints as its start and goal.
        person: everybody in the cell.
        seed: of the noise and the planner.
        rig: the cameras; None: those of the cell.
        waypoints: (waypoint joint), cycled; None: see `waypoints_of` [rad].
        guard: what slows the motions; None: nothing does.
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
    probes = probes_between(waypoints)
    rows: dict[str, list[Any]] = {name: [] for name in ("q", "qd", "known", "lag", "probe_t", "probe_known")}
    spent = {"set-up": time.perf_counter() - begin, "images": 0.0, "baseline": 0.0}
    zones: list[int] = []
    q, qd = waypoints[0].copy(), np.zeros_like(waypoints[0])
    top = cell.arm.qdd_max
    for tick, t in enumerate(cell.times):
        start = time.perf_counter()
        cameras.expose(tick, q)
        frames = cameras.arrived(t)
        middle = time.perf_counter()
        if guard is not None:
            baseline.most = guard.most(tick, q, qd, *baseline.along())
            zones.append(guard.zone)
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
        clearance=clearance, probe_true=probe_true.reshape(-1, PROBES), events=baseline.events, seconds=spent,
        zone=np.array(zones) if zones else np.zeros(len(found["q"]), int), **found,
    )  # fmt: skip
