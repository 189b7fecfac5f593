"""Speed of plans: many settings of the potential at once in the Robotica paper's scene, and one problem alone."""

import time
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.cells import make_cell
from hrcjax.numerics import unrolled_options
from hrcjax.plan import ArmPath, ArmPathParams, ArmPlanSizes, PotentialParams, arm_body, plan_arm
from hrcjax.sim.prepare import posture_at
from hrcjax.world import obstacle_distances, scene_named

RANGES = np.array([[0.01, 0.1], [1e-6, 1e-3], [1.0, 4.0]])
"""Of K_att, K_rep and zeta."""
INFLATION = 0.0125
"""Of the arm's spheres, as for sweeps [m]."""
OBSTACLES = 4
"""Places for obstacles; the scene has as many."""


def robotica_plan() -> Callable[[jax.Array], ArmPath]:
    """(K_att, K_rep, zeta) -> the plan in the scene of columns, from start to goal with the tool down."""
    cell, scene = make_cell(), scene_named("robotica")
    kept = eqx.tree_at(
        lambda s: (s.kind, s.center, s.size, s.yaw, s.radius, s.mask),
        scene,
        tuple(x[:OBSTACLES] for x in (scene.kind, scene.center, scene.size, scene.yaw, scene.radius, scene.mask)),
    )
    q_start, q_goal = posture_at(cell, scene.start), posture_at(cell, scene.goal)
    body = arm_body(cell.arm, INFLATION, floor=0.0)
    path = jax.tree.map(jnp.float32, ArmPathParams())
    potential = jax.tree.map(jnp.float32, PotentialParams())

    def planned(knobs: jax.Array) -> ArmPath:
        params = eqx.tree_at(lambda p: (p.k_att, p.k_rep, p.zeta), potential, (knobs[0], knobs[1], knobs[2]))
        return plan_arm(
            path, params, body, q_start, q_goal, lambda x: obstacle_distances(kept, x), kept.radius, kept.lower, kept.upper,
            ArmPlanSizes(),
        )  # fmt: skip

    return planned


def knob_settings(count: int) -> np.ndarray:
    """Random settings, log-uniform, (setting knob)."""
    low, high = np.log(RANGES).T
    return np.exp(np.random.default_rng(0).uniform(low, high, (count, 3))).astype(np.float32)


def best_time(f: Callable[[], Any], repeat: int) -> float:
    """Best time of a few calls [s]."""
    times = []
    for _ in range(repeat):
        begin = time.perf_counter()
        jax.block_until_ready(f())
        times.append(time.perf_counter() - begin)
    return min(times)


def robotica_speed(count: int) -> dict[str, float]:
    """Settings planned per second, compile time, and shares of plans that keep their distances."""
    knobs = jnp.asarray(knob_settings(count))
    begin = time.perf_counter()
    program = jax.jit(jax.vmap(robotica_plan()), compiler_options=unrolled_options()).lower(knobs).compile()
    compile_s = time.perf_counter() - begin
    found: ArmPath = jax.block_until_ready(program(knobs))
    seconds = best_time(lambda: program(knobs), 3)
    kept = np.asarray(found.status) & 14 == 14
    return {"settings_per_s": count / seconds, "compile_s": compile_s, "kept": float(kept.mean())}


def alone_ms() -> float:
    """Time of one plan by itself [ms]."""
    knobs = jnp.asarray([0.03, 1e-5, 2.0], jnp.float32)
    program = jax.jit(robotica_plan(), compiler_options=unrolled_options())
    jax.block_until_ready(program(knobs))
    return 1e3 * best_time(lambda: program(knobs), 5)
