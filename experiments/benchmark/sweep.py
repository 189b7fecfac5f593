"""Ticks of the closed loop per second: a batch of settings in one program compared with one episode after another.

Both follow paths for 250 ticks of 8 ms beside a person who reaches in within these 2 s, in the cell of the sweep with its
sensing, rates, capacities and default parameters. The batch has 128 settings that share the fields and differ in their
paths, as those of the default sweep do: arcs from start to goal with different heights and sides. The scan of ticks is
timed, with its record; paths, fields and splines are computed before, for both. The batch is `hrcjax.sim.follow` in
float32 under jit and vmap, on as many cores as XLA uses. The peer is
`hrcjax.reference`: the same algorithm, parameters and rates in C MuJoCo, NumPy and SciPy, in float64, in
one thread, vectorised over the points of a tick; it runs some of the same settings. Rounds of the two alternate; the
best of each is reported. `tool_difference` is the largest distance between the tool points of the two loops.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.cells import build_world, make_cell
from hrcjax.numerics import unrolled_options
from hrcjax.plan import PlanSizes
from hrcjax.reference.episode import SerialRecord, see
from hrcjax.reference.episode import episode as serial_episode
from hrcjax.reference.route import SerialRoute
from hrcjax.sim import Cell, Fields, Params, Record, Task, World, fit_fields, follow, path_through
from hrcjax.sim.route import Route, make_route

TICKS = 250
HEIGHTS = np.linspace(0.05, 0.2, 16)
"""Heights of the arcs [m]."""
SIDES = np.linspace(-0.15, 0.15, 8)
"""Lateral deviation of the arcs over the distance from start to goal [1]."""
SERIAL = 4
"""Episodes per round of the serial loop."""


def _paths(world: World) -> np.ndarray:
    """Waypoints of every setting's path, (setting waypoint 3) [m]."""
    start, goal = np.asarray(world.scene.start), np.asarray(world.scene.goal)
    u = np.linspace(0.0, 1.0, PlanSizes().waypoints, dtype=np.float32)[:, None]
    side = np.cross(goal - start, [0.0, 0.0, 1.0])
    bows = [h * np.array([0.0, 0.0, 1.0]) + w * side for h in HEIGHTS for w in SIDES]
    return np.stack([start + u * (goal - start) + np.sin(np.pi * u) * bow for bow in bows]).astype(np.float32)


def _routes(cell: Cell, world: World, paths: np.ndarray) -> Route:
    """The route of every setting."""
    task = Task(world.scene, world.q_start, Params().potential, cell.arm)
    one = jax.vmap(lambda path: make_route(cell.arm, world.q_start, path_through(task, path)))
    return jax.jit(one)(jnp.asarray(paths))


def _batch(cell: Cell, world: World, paths: np.ndarray) -> tuple[Callable[[], Record], float]:
    """A call that runs all paths, and its compile time [s]."""

    def one(params: Params, route: Route, world: World, fields: Fields) -> Record:
        return follow(params, cell, route, world.frames, world.q_start, fields)[1]

    params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), Params())
    fields = jax.jit(fit_fields)(params.field, world.frames)
    routes = _routes(cell, world, paths)
    begin = time.perf_counter()
    lowered = jax.jit(jax.vmap(one, in_axes=(None, 0, None, None))).lower(params, routes, world, fields)
    program = lowered.compile(compiler_options=unrolled_options())  # as in the sweep
    seconds = time.perf_counter() - begin
    return lambda: jax.block_until_ready(program(params, routes, world, fields)), seconds


def _serial(cell: Cell, world: World, paths: np.ndarray) -> Callable[[], list[SerialRecord]]:
    """A call that runs some paths, one after another."""
    seen = see(Params().field, world.frames)
    q_start = np.asarray(world.q_start, np.float64)
    routes = _routes(cell, world, paths)
    # the waypoints of the routes again: tool points and joints at equal lengths
    ends = np.asarray(routes.curve.coefficients.sum(axis=2)[:, -1:])
    nodes = np.concatenate([np.asarray(routes.curve.coefficients[:, :, 0]), ends], axis=1).astype(np.float64)
    serial = [SerialRoute(cell, node[:, :3], node[:, 9:]) for node in nodes]
    return lambda: [serial_episode(Params(), cell, route, seen, q_start) for route in serial]


def run(repeat: int = 5) -> dict[str, dict[str, Any]]:
    """Rates and their ratio, by row.

    Args:
        repeat: rounds; each loop runs once per round.
    """
    cell = replace(make_cell(), ticks=TICKS)
    world = build_world(cell, "robotica", "reach_in", 0)
    paths = _paths(world)
    some = np.linspace(0, len(paths) - 1, SERIAL).round().astype(int)
    batch, compile_s = _batch(cell, world, paths)
    serial = _serial(cell, world, paths[some])
    apart = np.asarray(batch().tool)[some] - np.stack([record.tool for record in serial()])

    best = {"batch": 0.0, "serial": 0.0}
    for _ in range(repeat):
        for name, call, episodes in (("batch", batch, len(paths)), ("serial", serial, SERIAL)):
            begin = time.perf_counter()
            call()
            best[name] = max(best[name], episodes * TICKS / (time.perf_counter() - begin))
    return {
        "ratio_to_serial": {"value": best["batch"] / best["serial"], "unit": "1"},
        "ticks_per_s": {"value": best["batch"], "unit": "1/s"},
        "serial_ticks_per_s": {"value": best["serial"], "unit": "1/s"},
        "compile_s": {"value": compile_s, "unit": "s"},
        "tool_difference": {"value": float(np.linalg.norm(apart, axis=-1).max()), "unit": "m"},
    }
