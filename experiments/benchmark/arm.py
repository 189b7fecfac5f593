"""Speed of the arm's dynamics: the folded chain compared with MuJoCo's C rollout and MJX, alternating on the same cores.

Steps of 2 ms, each arm with its own start and torques. Folded and MJX in float32 on all cores, `mujoco.rollout` in double
precision with one thread per core. Times are the best of the repetitions.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

import os
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import rollout

from hrcjax.robot import Arm, ArmState, jit_for, load_arm, step

DT = 0.002
THREADS = min(2, os.cpu_count() or 1)
FOLDED = {64: 2000, 1024: 200, 4096: 60}
"""Batch size -> steps of a scan."""
MJX = {64: 200, 1024: 25}
STOCK = {64: 4}
C_ARMS, C_STEPS = 256, 400


def _inputs(arm: Arm, batch: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    return rng.uniform(-1, 1, (batch, 6)), rng.uniform(-0.01, 0.01, (batch, steps, 6)) * arm.tau_max


def _compiled(arm: Arm, backend: str, batch: int, steps: int, stock: bool = False) -> tuple[Callable[[], Any], float]:
    """A call that runs a batch of rollouts, and its compile time [s]; `stock`: MJX with the default compiler options."""

    def one(q: jax.Array, torque: jax.Array) -> jax.Array:
        def tick(state: ArmState, tau: jax.Array) -> tuple[ArmState, None]:
            return step(arm, state, tau, DT, backend), None

        return jax.lax.scan(tick, ArmState(q, jnp.zeros_like(q)), torque)[0].q

    q, torque = (jnp.asarray(x, jnp.float32) for x in _inputs(arm, batch, steps))
    program = jit_for("folded" if stock else backend, jax.vmap(one))

    def call() -> None:
        jax.block_until_ready(program(q, torque))

    start = time.perf_counter()
    call()
    first = time.perf_counter() - start
    start = time.perf_counter()
    call()
    return call, first - (time.perf_counter() - start)


def _rollout(arm: Arm) -> Callable[[], Any]:
    model = arm.model
    model.opt.timestep = DT
    q, torque = _inputs(arm, C_ARMS, C_STEPS)
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros((C_ARMS, mujoco.mj_stateSize(model, full)))
    start[:, 1:7] = q
    data = [mujoco.MjData(model) for _ in range(THREADS)]
    runner = rollout.Rollout(nthread=THREADS)
    return lambda: runner.rollout(model, data, start, torque)


def run(repeat: int = 5) -> dict[str, dict[str, float | str]]:
    """Rates and ratios, by row.

    Args:
        repeat: rounds; every backend runs once per round.
    """
    arm = load_arm("ur5")
    # compile times are measured without the cache
    cached = jax.config.jax_enable_compilation_cache
    jax.config.update("jax_enable_compilation_cache", False)
    try:
        calls: dict[tuple[str, int], tuple[Callable[[], Any], int]] = {("c", C_ARMS): (_rollout(arm), C_ARMS * C_STEPS)}
        compile_s = 0.0
        for backend, sizes in (("folded", FOLDED), ("mjx", MJX)):
            for batch, steps in sizes.items():
                call, seconds = _compiled(arm, backend, batch, steps)
                calls[backend, batch] = call, batch * steps
                if backend == "folded":
                    compile_s = max(compile_s, seconds)
        ((stock_batch, stock_steps),) = STOCK.items()
        stock, _ = _compiled(arm, "mjx", stock_batch, stock_steps, stock=True)
    finally:
        jax.config.update("jax_enable_compilation_cache", cached)

    best: dict[tuple[str, int], float] = {}
    for _ in range(repeat):
        for key, (call, steps) in calls.items():
            start = time.perf_counter()
            call()
            best[key] = max(best.get(key, 0.0), steps / (time.perf_counter() - start))
    start = time.perf_counter()
    stock()
    stock_rate = stock_batch * stock_steps / (time.perf_counter() - start)

    top = {name: max(rate for (kind, _), rate in best.items() if kind == name) for name in ("c", "folded", "mjx")}
    at = {
        name: max((rate, batch) for (kind, batch), rate in best.items() if kind == name)[1]
        for name in ("folded", "mjx")
    }
    return {
        "ratio_to_mujoco_rollout": {
            "value": top["folded"] / top["c"],
            "unit": f"folded / C rollout, {THREADS} threads",
        },
        "ratio_to_mjx_step": {"value": top["folded"] / top["mjx"], "unit": f"folded / mjx.step at batch {at['mjx']}"},
        "steps_per_s": {"value": top["folded"], "unit": f"steps/s, batch {at['folded']}"},
        **{f"steps_per_s_batch_{batch}": {"value": best["folded", batch], "unit": "steps/s"} for batch in FOLDED},
        "mujoco_rollout_steps_per_s": {"value": top["c"], "unit": f"steps/s, {THREADS} threads"},
        "mjx_steps_per_s": {"value": top["mjx"], "unit": f"steps/s, batch {at['mjx']}, without fusion emitters"},
        "mjx_stock_steps_per_s": {
            "value": stock_rate,
            "unit": f"steps/s, batch {stock_batch}, default compiler options",
        },
        "compile_s": {"value": compile_s, "unit": "s, folded vmap of scan, slowest batch"},
    }
