"""Where the time of a control tick goes: the closed loop whole, and each of its parts in a scan of its own.

The batch is that of section `sweep`: 128 settings, 250 ticks, one program, float32. A part is repeated on the inputs that it
had in the loop, in the same order; what it gives is summed, so that nothing is left out, and only `record` is written, as
the loop writes it. A scan of a part alone reads its inputs from memory, which the loop has in the caches: the sum of the parts
may exceed the whole. `rest_share` is what the parts leave over, negative where they exceed the whole.

`kinematics`: positions, speeds and Jacobians of the control points. `field`: distances to people and to what stands, with
gradients. `safety`: the monitor's zones and limits. `guide`: path clock and motion policies. `governor`: joint limits and the
least change of the command. `servo`: computed torque and the arm's dynamics, in substeps. `record`: what is kept of a tick.

Rates are operations and bytes by the compiler's own count (`cost_analysis`), over the time. It counts a loop's body once: loops
of known length within a part are added, others count one round. Exponentials, roots, sines and their like are no operations in it, but
counted apart (`_gfunction_per_s`). Bytes are those between the compiler's fused loops, whether a cache has them or not, and may exceed what the memory gives.
The peaks are measured in the same run: a product of two matrices of 1024 x 1024, x + 1 of 256 MB, and the sum of exponentials of
an array in the cache.
"""

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import reduce
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr, jaxpr_as_fun

from hrcjax.cells import build_world, make_cell
from hrcjax.numerics import unrolled_options
from hrcjax.sim import Cell, Fields, Params, World, fit_fields, follow
from hrcjax.sim.tick import initial_state

from .sweep import TICKS, _paths, _routes
from .tick_parts import PARTS, Part, Seen, Setting, Values, apart, sensed_over_time

MATRIX = 1024
MOST = 50
"""Largest number of times that a part is repeated in a round."""
COPIED = 256_000_000
"""Bytes of the array that is read, and of the one that is written."""
RAISED = 100_000
"""Exponentials in a peak's call, times 100."""
UNITS = {"gflop": "GFLOP/s", "gb": "GB/s", "gfunction": "1e9 functions/s"}
"""What is counted, and the unit of its rate."""
AXES = Setting(None, 0)  # pyright: ignore[reportArgumentType]
"""What of a setting is batched."""


def total(values: Any) -> jax.Array:
    """The sum of all numbers of a pytree."""
    return reduce(jnp.add, (jnp.sum(leaf.astype(jnp.float32)) for leaf in jax.tree.leaves(values)))


def scan_apart(cell: Cell, setting: Setting, seen: Seen, q: jax.Array) -> Values:
    """All values of all ticks of one setting, by the tick taken apart."""
    start = initial_state(cell, q)
    return jax.lax.scan(lambda state, now: apart(cell, setting, seen.at(now), state), start, seen.ticks)[1]


def scan_part(cell: Cell, part: Part, kept: bool, setting: Setting, seen: Seen, values: Values) -> Any:
    """One part at every tick: what it gives, or the sum of it.

    Args:
        kept: give every tick's values instead of their sum.
        values: what the part reads, tick by tick.
    """

    def one(count: jax.Array, now: Any) -> tuple[jax.Array, Any]:
        given = part.run(cell, setting, seen.at(now[0]), now[1])
        return (count, given) if kept else (count + total(given), None)

    count, given = jax.lax.scan(one, jnp.zeros((), jnp.float32), (seen.ticks, values))
    return given if kept else count


def inner_cost(jaxpr: Any, outer: bool = True) -> np.ndarray:
    """Operations, bytes and functions of the loops of known length within a scan of ticks, beyond the one round that is counted.

    Args:
        jaxpr: of a program whose outermost scan is that of the ticks.
        outer: `jaxpr` lies outside of that scan.
    """
    more = np.zeros(3)
    for equation in jaxpr.eqns:
        looped = equation.primitive.name == "scan"
        for inside in equation.params.values():
            closed = inside if isinstance(inside, ClosedJaxpr) else None
            body = closed.jaxpr if closed else inside
            if not hasattr(body, "eqns"):
                continue
            times = equation.params["length"] - 1 if looped and not outer else 0
            more += (1 + times) * inner_cost(body, outer and not looped)
            if times and closed:
                shapes = [jax.ShapeDtypeStruct(v.aval.shape, v.aval.dtype) for v in body.invars]
                more += times * cost(jax.jit(jaxpr_as_fun(closed)).lower(*shapes).compile(unrolled_options()))
    return more


def cost(compiled: Any) -> np.ndarray:
    """Operations, bytes and functions by the compiler's count, one round of every loop."""
    found = compiled.cost_analysis() or {}
    return np.array([found.get(name, 0.0) for name in ("flops", "bytes accessed", "transcendentals")])


def built(f: Callable[..., Any], *args: Any) -> tuple[Callable[[], Any], np.ndarray, float]:
    """A call of the compiled program, operations, bytes and functions of a tick, and the compile time [s]."""
    begin = time.perf_counter()
    traced = jax.jit(f).trace(*args)
    program = traced.lower().compile(unrolled_options())
    compile_s = time.perf_counter() - begin
    count = cost(program) + inner_cost(traced.jaxpr.jaxpr)
    return lambda: jax.block_until_ready(program(*args)), count, compile_s


def peaks() -> dict[str, tuple[Callable[[], Any], float]]:
    """What shows the limits of the machine: calls, and their operations or bytes."""
    square = jnp.ones((MATRIX, MATRIX), jnp.float32)
    large = jnp.zeros(COPIED // 4, jnp.float32)
    product, raised = jax.jit(jnp.matmul), jax.jit(lambda x: x + 1, donate_argnums=0)
    small, rounds = jnp.linspace(-5.0, 0.0, RAISED, dtype=jnp.float32), jnp.linspace(0.0, 1.0, 100, dtype=jnp.float32)
    exponentials = jax.jit(lambda x, moved: jax.lax.map(lambda y: jnp.sum(jnp.exp(x - y)), moved))
    kept = [large]

    def copied() -> None:  # in the same memory: new pages take longer than the copy
        kept[0] = jax.block_until_ready(raised(kept[0]))

    return {
        "peak_gflop_per_s": (lambda: jax.block_until_ready(product(square, square)), 2.0 * MATRIX**3),
        "peak_gb_per_s": (copied, 2.0 * COPIED),
        "peak_gfunction_per_s": (lambda: jax.block_until_ready(exponentials(small, rounds)), 100.0 * RAISED),
    }


def best_times(calls: Mapping[str, Callable[[], Any]], short: Iterable[str], repeat: int) -> dict[str, float]:
    """Best time of each call [s].

    Args:
        short: what is repeated until it takes as long as "whole", so that a busy machine slows both alike.
    """
    for call in calls.values():
        call()
    once = {name: seconds(call, 1) for name, call in calls.items()}
    times = {name: min(MOST, max(1, round(once["whole"] / once[name]))) for name in short}
    rounds = [{name: seconds(call, times.get(name, 1)) for name, call in calls.items()} for _ in range(repeat)]
    return {name: min(round[name] for round in rounds) for name in calls}


def seconds(call: Callable[[], Any], times: int) -> float:
    """Mean time of a call [s]."""
    begin = time.perf_counter()
    for _ in range(times):
        call()
    return (time.perf_counter() - begin) / times


def programs(cell: Cell, world: World, paths: np.ndarray) -> tuple[dict[str, Any], float]:
    """The loop ("whole") and its parts as `built` gives them; and how far the tools of whole and parts differ [m]."""
    params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), Params())
    fields: Fields = jax.jit(fit_fields)(params.field, world.frames)
    setting = Setting(params, _routes(cell, world, paths))
    seen = jax.jit(lambda world, fields: sensed_over_time(cell, world.frames, fields, world.q_start))(world, fields)

    def whole(setting: Setting, world: World, fields: Fields) -> Any:
        return follow(setting.params, cell, setting.route, world.frames, world.q_start, fields)[1]

    found = {"whole": built(jax.vmap(whole, (AXES, None, None)), setting, world, fields)}
    every = jax.vmap(lambda s, seen, q: scan_apart(cell, s, seen, q), (AXES, None, None), 1)
    values = built(every, setting, seen, world.q_start)[0]()
    tool = np.asarray(values["record"].tool).swapaxes(0, 1)
    difference = float(np.max(np.linalg.norm(tool - np.asarray(found["whole"][0]().tool), axis=-1)))
    for name, part in PARTS.items():
        one = lambda s, seen, v, part=part, name=name: scan_part(cell, part, name == "record", s, seen, v)  # noqa: E731
        needs = {value: values[value] for value in part.needs}
        found[name] = built(jax.vmap(one, (AXES, None, 1)), setting, seen, needs)
        if name == "record":
            twice = jax.jit(jax.vmap(one, (AXES, None, 1))).lower(setting, *twice_as_long(seen, needs))
            all_ticks = cost(twice.compile(unrolled_options())) - found[name][1]
            for writes in ("record", "whole"):
                found[writes] = (found[writes][0], found[writes][1] - all_ticks, found[writes][2])
    return found, difference


def twice_as_long(seen: Seen, values: Values) -> tuple[Seen, Values]:
    """The shapes of inputs of twice as many ticks: what the compiler counts with their number is not done at every tick."""

    def longer(tree: Any) -> Any:
        return jax.tree.map(lambda a: jax.ShapeDtypeStruct((2 * a.shape[0], *a.shape[1:]), a.dtype), tree)

    return Seen(seen.static, longer(seen.ticks)), longer(values)


def run(repeat: int = 5, ticks: int = TICKS, settings: int | None = None) -> dict[str, dict[str, Any]]:
    """Seconds, shares and rates, by row.

    Args:
        repeat: rounds; everything runs once per round, and the best counts.
        ticks: control periods.
        settings: the first of the batch; None: all.
    """
    cell = replace(make_cell(), ticks=ticks)
    world = build_world(cell, "robotica", "reach_in", 0)
    found, difference = programs(cell, world, _paths(world)[:settings])
    limits = peaks()
    calls = {name: call for name, (call, *_) in found.items()} | {name: call for name, (call, _) in limits.items()}
    best = best_times(calls, PARTS, repeat)
    rows: dict[str, dict[str, Any]] = {
        "whole_s": {"value": best["whole"], "unit": "s"},
        **{name: {"value": 1e-9 * work / best[name], "unit": UNITS[name[5:-6]]} for name, (_, work) in limits.items()},
    }  # fmt: skip
    shares = {name: best[name] / best["whole"] for name in PARTS}
    for name in ("whole", *PARTS):
        rates = 1e-9 * ticks * found[name][1] / best[name]
        if name in shares:
            rows[f"{name}_s"] = {"value": best[name], "unit": "s"}
            rows[f"{name}_share"] = {"value": shares[name], "unit": "1, of whole_s", "better": ""}
        for (what, unit), rate in zip(UNITS.items(), rates, strict=True):
            better = {} if what == "gflop" else {"better": ""}
            rows[f"{name}_{what}_per_s"] = {"value": float(rate), "unit": unit, **better}
    rows["rest_share"] = {"value": 1.0 - sum(shares.values()), "unit": "1, of whole_s", "better": ""}
    rows["parts_tool_difference"] = {
        "value": difference,
        "unit": "m, largest distance between tools of whole and parts",
    }
    rows["compile_s"] = {"value": found["whole"][2], "unit": "s, whole"}
    return rows
