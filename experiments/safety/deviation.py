"""Whether scaled speed keeps the path, and how motion resumes: in mode `path`, in double precision, against an independent route."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.numerics import unrolled_options
from hrcjax.reference.route import SerialRoute
from hrcjax.sim import Cell, Params
from hrcjax.sim.episode import plan_route
from hrcjax.sim.parts import Task
from hrcjax.world import first_obstacles, scene_named

from .draws import Drawer
from .exact_field import standing
from .monte_carlo import Chance, Told, follow_told, told

BESIDE = ("reach_in", "pass_by", "stand_and_work")
"""People beside whom the arm is scaled."""
PLACES = 4000
"""Places on the route between which the nearest one to the arm is looked for."""


def from_curve(points: NDArray, curve: NDArray) -> NDArray:
    """Least distance of points (time n) to a line through places (place n)."""
    best = np.full(len(points), np.inf)
    a, way = curve[:-1], np.diff(curve, axis=0)
    square = np.maximum((way * way).sum(-1), 1e-300)
    for k, x in enumerate(points):
        part = np.clip(((x - a) * way).sum(-1) / square, 0, 1)
        best[k] = np.sqrt((((x - a) - part[:, None] * way) ** 2).sum(-1).min())
    return best


def deviation_case(cell: Cell, params: Params, scene_name: str, episodes: int) -> Mapping[str, Any]:
    """Episodes beside people, and one beside nobody, in mode `path`."""
    cell = replace(cell, motion="path")
    with jax.enable_x64(True):
        chance = Chance(cell, params, BESIDE)
        short, numbers = chance.short_cell, chance.params_of(jnp.float64)
        scene = jax.tree.map(
            lambda x: x.astype(jnp.float64) if jnp.issubdtype(x.dtype, jnp.floating) else x, scene_named(scene_name, 0)
        )
        _, q_start = chance.scene(scene_name, 0)
        q_start = q_start.astype(jnp.float64)
        task = Task(first_obstacles(scene, cell.obstacles), q_start, numbers.potential, cell.arm)
        path, route = jax.jit(lambda p, t: plan_route(p, short, t))(numbers, task)
        drawer = Drawer(scene, BESIDE, short.ticks, short.dt)
        draws = [replace(drawer(seed), age=np.minimum(drawer(seed).age, 0.09)) for seed in range(episodes)]
        given = told(draws, jnp.float64)
        nobody = eqx.tree_at(lambda t: t.radius, given, given.radius.at[-1].set(-1.0))
        nobody = eqx.tree_at(lambda t: t.guarded, nobody, nobody.guarded.at[-1].set(False))
        static = jax.jit(lambda s: standing(short, s))(scene)

        def play(one: Told) -> tuple:
            record = follow_told(numbers, short, route, static, q_start, one)
            return record.q, record.qdd, record.reference, record.travelled, record.zone, record.tool

        names = ("q", "qdd", "reference", "travelled", "zone", "tool")
        found = dict(zip(names, jax.jit(jax.vmap(play), compiler_options=unrolled_options())(nobody), strict=True))
        found = {name: np.asarray(value) for name, value in found.items()}
        if path.joints is None:
            raise ValueError("the planner gives no joints; accepted: one that does")
        oracle = SerialRoute(short, np.asarray(path.waypoints), np.asarray(path.joints)).curve
    places = np.linspace(0, oracle.length, PLACES)
    line = np.stack([oracle.at(s)[0] for s in places])
    meant = np.stack([[oracle.at(s)[0][:3] for s in run] for run in found["travelled"]])
    return {
        "reference_off": np.linalg.norm(found["reference"] - meant, axis=-1).max(axis=1),
        "joints_off": np.stack([from_curve(q, line[:, 9:]).max() for q in found["q"]]),
        "tool_off": np.stack([from_curve(x, line[:, :3]).max() for x in found["tool"]]),
        "travelled": found["travelled"],
        "zone": found["zone"],
        "qdd_share": np.abs(found["qdd"]).max(axis=1) / np.asarray(cell.arm.qdd_max),
        "length": oracle.length,
        "dt": short.dt,
    }


def clock_motion(travelled: NDArray, dt: float) -> tuple[NDArray, NDArray]:
    """Acceleration [m/s^2] and, while it grows and speeds up, jerk [m/s^3] of the clock, by differences over time."""
    mean = np.diff(travelled, axis=-1) / dt
    acceleration = np.diff(mean, axis=-1) / dt
    jerk = np.diff(acceleration, axis=-1) / dt
    speeding = (acceleration[..., 1:] > 0) & (acceleration[..., :-1] >= 0)
    return acceleration, np.where(speeding, jerk, 0.0)
