"""Time of the distance field per pair of query and training point, as a multiple of a bare exponential.

The reference: `jnp.exp` of a precomputed float32 array with one entry per pair, summed over each row. Rows named `_written`
compare with `jnp.exp` of the same array without the sum; its result is a second large array, which takes several times as
long. All programs are compiled before, run on the same threads, and interleaved; the best of several runs is reported.

The row `value` is the value alone by the closed form, the first result of `distance_and_gradient`; `definition` is
`distance`, the scalar function for automatic differentiation. Queries go through `jax.lax.map` in batches whose exponentials fit the cache; the closed loop (`union`) is 64 episodes
of 18 control points under nested `vmap`, its reverse mode the gradient of a scalar of all four results.
"""

import time
from collections.abc import Callable

import jax
import jax.numpy as jnp

from hrcjax.field import (
    FieldParams,
    GPField,
    distance,
    distance_and_gradient,
    fit,
    hessian,
    union_distance_and_gradient,
)
from hrcjax.geom.cloud import Cloud

QUERIES, POINTS, BATCH = 16_384, 1_000, 256
EPISODES, CONTROL_POINTS, STATIC_POINTS, MOVING_POINTS = 64, 18, 400, 112


def _best(programs: dict[str, tuple[Callable, jax.Array]], repeat: int) -> dict[str, float]:
    """Best time of each [s]; interleaved, so that other load affects all alike."""
    compiled = {name: (jax.jit(f), x) for name, (f, x) in programs.items()}
    for f, x in compiled.values():
        jax.block_until_ready(f(x))
    best = dict.fromkeys(compiled, float("inf"))
    for _ in range(repeat):
        for name, (f, x) in compiled.items():
            for _ in range(2):
                start = time.perf_counter()
                jax.block_until_ready(f(x))
                best[name] = min(best[name], time.perf_counter() - start)
    return best


def _exp_summed(ready: jax.Array) -> jax.Array:
    return jnp.sum(jnp.exp(ready), axis=1)


def _uniform(seed: int, *shape: int, low: float = -0.5, high: float = 0.5) -> jax.Array:
    return jax.random.uniform(jax.random.key(seed), shape, jnp.float32, low, high)


def _field(seed: int, count: int) -> GPField:
    return jax.jit(fit)(Cloud(_uniform(seed, count, 3), jnp.ones(count, bool)), FieldParams())


def _row(value: float, unit: str) -> dict[str, float | str]:
    return {"value": float(value), "unit": unit, "better": "low"}


def run(repeat: int = 5) -> dict[str, dict]:
    """Rows of {"value", "unit"}: ratios to a bare exponential [1], and times [ns per pair]."""
    field, queries = _field(0, POINTS), _uniform(1, QUERIES, 3)

    def chunked(f: Callable) -> tuple[Callable, jax.Array]:
        return lambda x: jax.lax.map(lambda at: f(field, at), x, batch_size=BATCH), queries

    ready = _uniform(2, QUERIES, POINTS, low=-20.0, high=0.0)
    query = _best(
        {
            "exp": (_exp_summed, ready),
            "exp_written": (jnp.exp, ready),
            "value": chunked(lambda field, at: distance_and_gradient(field, at)[0]),
            "definition": chunked(distance),
            "value_grad": chunked(distance_and_gradient),
            "hessian": chunked(hessian),
        },
        repeat,
    )
    static, moving = _field(3, STATIC_POINTS), _field(4, MOVING_POINTS)

    def union(x: jax.Array) -> tuple[jax.Array, ...]:
        return jax.vmap(lambda at: union_distance_and_gradient(static, moving, at))(x)

    def loss(x: jax.Array) -> jax.Array:
        return sum((jnp.sum(out * out) for out in union(x)), jnp.zeros((), x.dtype))

    pairs = EPISODES * CONTROL_POINTS * (STATIC_POINTS + MOVING_POINTS)
    body = _uniform(5, EPISODES, CONTROL_POINTS, 3)
    loop_ready = _uniform(6, EPISODES * CONTROL_POINTS, STATIC_POINTS + MOVING_POINTS, low=-20.0, high=0.0)
    loop = _best(
        {
            "exp": (_exp_summed, loop_ready),
            "exp_written": (jnp.exp, loop_ready),
            "union": (jax.vmap(union), body),
            "union_reverse": (jax.vmap(jax.grad(loss)), body),
        },
        4 * repeat,
    )
    rows = {}
    for name in ("value", "definition", "value_grad", "hessian"):
        rows[f"{name}_ratio_to_exp"] = _row(query[name] / query["exp"], "1")
        rows[f"{name}_ratio_to_exp_written"] = _row(query[name] / query["exp_written"], "1")
        rows[f"{name}_ns_per_pair"] = _row(1e9 * query[name] / (QUERIES * POINTS), "ns")
    for name in ("union", "union_reverse"):
        rows[f"{name}_ratio_to_exp"] = _row(loop[name] / loop["exp"], "1")
        rows[f"{name}_ratio_to_exp_written"] = _row(loop[name] / loop["exp_written"], "1")
        rows[f"{name}_ns_per_pair"] = _row(1e9 * loop[name] / pairs, "ns")
    rows["exp_ns_per_pair"] = _row(1e9 * query["exp"] / (QUERIES * POINTS), "ns")
    rows["exp_written_ns_per_pair"] = _row(1e9 * query["exp_written"] / (QUERIES * POINTS), "ns")
    return rows
