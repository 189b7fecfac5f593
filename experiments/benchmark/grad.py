"""Value and gradient of a batch of complete episodes compared with the value alone, in float32 on all cores.

Every numeric parameter of the default cell is differentiated, in reverse mode through all ticks. A quarter of the compile
time is JAX's tracing, the rest XLA's; most of it is the control tick (joint servo, motion policy, kinematics), a third the
path optimiser.
"""

import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from hrcjax.cells import build_world, make_cell
from hrcjax.lab.parameters import leaf_names, set_leaves
from hrcjax.numerics import unrolled_options
from hrcjax.sim import Params
from hrcjax.tune import episode_loss

BATCH = 64


def best_time(f: Callable[..., Any], *args: Any, repeat: int) -> float:
    """Best time of a few calls [s]."""
    times = []
    for _ in range(repeat):
        begin = time.perf_counter()
        jax.block_until_ready(f(*args))
        times.append(time.perf_counter() - begin)
    return min(times)


def run(repeat: int = 2) -> dict[str, dict[str, Any]]:
    """Episodes of the default cell with a person who reaches in; every numeric parameter is differentiated."""
    cell = make_cell()
    world = build_world(cell, "robotica", "reach_in", 0)
    names = leaf_names(Params())
    spread = jnp.linspace(0.9, 1.1, BATCH)
    params = set_leaves(Params(), {name: value * spread for name, value in names.items()})

    def total(params: Params) -> jax.Array:
        return jnp.sum(jax.vmap(lambda one: episode_loss(one, cell, world))(params))

    begin = time.perf_counter()
    value_and_grad = jax.jit(jax.value_and_grad(total)).lower(params).compile(compiler_options=unrolled_options())
    compile_s = time.perf_counter() - begin
    value = jax.jit(total).lower(params).compile(compiler_options=unrolled_options())
    jax.block_until_ready((value(params), value_and_grad(params)))
    forward, both = best_time(value, params, repeat=repeat), best_time(value_and_grad, params, repeat=repeat)
    return {
        "ratio_to_forward": {"value": both / forward, "unit": "1"},
        "compile_s": {"value": compile_s, "unit": "s"},
        "forward_s": {"value": forward, "unit": "s"},
        "ticks_per_s": {"value": BATCH * cell.ticks / both, "unit": "1/s"},
    }
