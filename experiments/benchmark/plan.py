"""The planner of a point: settings of K_att, K_rep, zeta and omega2 planned and optimised per second, in float32 on all cores.

The scene is the Robotica paper's with its obstacles as columns. 10,000 settings are drawn log-uniformly within the ranges of the
sweep, and each is planned by `hrcjax.plan.plan`: 300 steps of descent, then two guesses of 48 waypoints through 10 iterations of the
optimiser. They run in batches, as many at a time as there are cores. `kept` is the share whose path keeps the distance that its zeta
asks for, and the bounds; where it does not, its status says so. `alone_ms` is the time of one setting by itself, and
`multi_start_alone_ms` that of `plan_multi_start` with 16 guesses.
"""

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import unrolled_options
from hrcjax.plan import PathResult, PlanParams, PlanSizes, plan, plan_multi_start
from hrcjax.world import first_obstacles, obstacle_distances, robotica

SETTINGS, BATCH = 10_000, 250
OBSTACLES = 4
STARTS = 16
RANGES = np.array([[0.01, 0.1], [1e-6, 1e-3], [1.0, 4.0], [1e-3, 0.1]])
"""Of K_att, K_rep, zeta and omega2."""


def planner(many: bool = False) -> Callable[[jax.Array], PathResult]:
    """(K_att, K_rep, zeta, omega2) -> the path in the paper's scene.

    Args:
        many: from many starts.
    """
    scene = first_obstacles(robotica("columns"), OBSTACLES)
    default = jax.tree.map(jnp.float32, PlanParams())
    places = (scene.start, scene.goal, lambda x: obstacle_distances(scene, x), scene.radius, scene.lower, scene.upper)

    def planned(knobs: jax.Array) -> PathResult:
        where = lambda p: (p.potential.k_att, p.potential.k_rep, p.potential.zeta, p.path.omega2)  # noqa: E731
        params = eqx.tree_at(where, default, tuple(knobs))
        if many:
            return plan_multi_start(params, *places, PlanSizes(), STARTS)
        return plan(params, *places, PlanSizes())

    return planned


def knob_settings(count: int) -> np.ndarray:
    """Random settings, (setting knob)."""
    low, high = np.log(RANGES).T
    return np.exp(np.random.default_rng(0).uniform(low, high, (count, len(RANGES)))).astype(np.float32)


def best_time(f: Callable[[], Any], repeat: int) -> float:
    """Best time of a few calls [s]."""
    times = []
    for _ in range(repeat):
        begin = time.perf_counter()
        jax.block_until_ready(f())
        times.append(time.perf_counter() - begin)
    return min(times)


def run(settings: int = SETTINGS, batch: int = BATCH, repeat: int = 2) -> dict[str, dict[str, Any]]:
    """Rows of the section."""
    knobs = jnp.asarray(knob_settings(settings)).reshape(-1, batch, len(RANGES))
    begin = time.perf_counter()
    program = jax.jit(jax.vmap(planner()), compiler_options=unrolled_options()).lower(knobs[0]).compile()
    compile_s = time.perf_counter() - begin

    def one(knobs: jax.Array) -> jax.Array:
        return jax.block_until_ready(program(knobs)).status

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        found = np.concatenate([np.asarray(status) for status in threads.map(one, knobs)])
        seconds = best_time(lambda: list(threads.map(one, knobs)), repeat)
    first = knobs[0, 0]
    alone, many = (jax.jit(planner(many), compiler_options=unrolled_options()) for many in (False, True))
    jax.block_until_ready((alone(first), many(first)))
    return {
        "settings_per_s": {"value": settings / seconds, "unit": "1/s"},
        "seconds": {"value": seconds, "unit": f"s, {settings:,} settings"},
        "kept": {"value": float(np.mean(found & 6 == 6)), "unit": "1", "better": ""},
        "alone_ms": {"value": 1e3 * best_time(lambda: alone(first), 10), "unit": "ms"},
        "multi_start_alone_ms": {"value": 1e3 * best_time(lambda: many(first), 10), "unit": "ms"},
        "compile_s": {"value": compile_s, "unit": "s"},
    }
