"""The tick taken apart is the tick; operations within loops are counted."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.benchmark.loop import best_times, cost, inner_cost, scan_part
from experiments.benchmark.tick_parts import Part, Seen, Setting, apart
from hrcjax.cells import make_cell
from hrcjax.numerics import safe_norm, unit, unrolled_options
from hrcjax.sim import Fields, Params, Task, path_through
from hrcjax.sim.parts import FieldPart, Reading
from hrcjax.sim.route import make_route
from hrcjax.sim.tick import Sensed, initial_state, tick
from hrcjax.world import scene_named


@pytest.mark.slow
def test_the_tick_taken_apart_is_the_tick() -> None:
    """Beside a ball that stands for a person, in the red zone and far from it: state and record, to the bit or nearly so."""

    def read(params: object, fields: Fields, x: jax.Array) -> Reading:
        ball, floor = x - fields.moving, jnp.asarray([0.0, 0.0, 1.0], x.dtype)
        near, height = safe_norm(ball) - 0.2, x[2] + 0.3
        least = near < height
        gradient = jnp.where(least, unit(ball), floor)
        return Reading(jnp.minimum(near, height), gradient, near[None], unit(ball)[None], height, floor)

    cell = replace(make_cell(), field=FieldPart(lambda params, frames: Fields(None, None), read))
    params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), Params())
    scene = scene_named("robotica", 0)
    q = jnp.asarray(cell.arm.home, jnp.float32)

    @jax.jit
    def route() -> object:
        line = jnp.linspace(0, 1, 12, dtype=jnp.float32)[:, None] * (scene.goal - scene.start) + scene.start
        return make_route(cell.arm, q, path_through(Task(scene, q, params.potential, cell.arm), line))

    def both(route: object, ball: jax.Array, qd: jax.Array) -> tuple[object, object]:
        no = jnp.asarray(False)
        sensed = Sensed(Fields(None, ball), jnp.asarray(0.05, jnp.float32), ~no, no, jnp.asarray(3))
        state = eqx.tree_at(lambda s: s.arm.qd, initial_state(cell, q), qd)
        after, values = apart(cell, Setting(params, route), sensed, state)  # pyright: ignore[reportArgumentType]
        return tick(params, cell, route, sensed, state), (after, values["record"])  # pyright: ignore[reportArgumentType]

    program = jax.jit(both, compiler_options=unrolled_options())
    zones = set()
    for ball in ([0.0, 1.0, 0.3], [0.0, 6.0, 0.3]):
        qd = jnp.asarray([0.5, -0.3, 0.2, 0.1, -0.4, 0.3], jnp.float32)
        whole, parts = program(route(), jnp.asarray(ball, jnp.float32), qd)
        for one, other in zip(jax.tree.leaves(whole), jax.tree.leaves(parts), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-6)
        zones.add(int(whole[1].zone))
    assert len(zones) == 2


def test_loops_within_a_tick_are_counted_with_their_length() -> None:
    def program(x: jax.Array) -> jax.Array:
        def inner(y: jax.Array, _: None) -> tuple[jax.Array, None]:
            return y @ x, None

        def tick(y: jax.Array, _: None) -> tuple[jax.Array, None]:
            return jax.lax.scan(jax.checkpoint(inner), y, None, length=5)[0] @ x, None

        return jax.lax.scan(tick, x, None, length=30)[0]

    traced = jax.jit(program).trace(jnp.ones((32, 32), jnp.float32))
    operations = (cost(traced.lower().compile()) + inner_cost(traced.jaxpr.jaxpr))[0]
    assert operations == pytest.approx((5 + 1) * 2 * 32**3, rel=0.01)


def test_a_part_is_run_at_every_tick_on_its_own_inputs() -> None:
    part = Part(("a",), lambda cell, setting, sensed, v: {"b": setting.params * v["a"] + sensed.age, "c": v["a"] > 1})
    a, age = jnp.asarray([1.0, 2.0, 4.0], jnp.float32), jnp.asarray([0.5, 0.25, 0.0], jnp.float32)
    seen = Seen(None, (jnp.zeros(3), age, age > 1, age > 1, jnp.zeros(3, int)))
    setting = Setting(jnp.asarray(3.0, jnp.float32), None)  # pyright: ignore[reportArgumentType]
    kept = scan_part(None, part, True, setting, seen, {"a": a})  # pyright: ignore[reportArgumentType]
    assert kept["b"].tolist() == [3.5, 6.25, 12.0]
    assert float(scan_part(None, part, False, setting, seen, {"a": a})) == 3.5 + 6.25 + 12.0 + 2  # pyright: ignore[reportArgumentType]


def test_short_calls_are_repeated_as_long_as_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    took = {"whole": 8.0, "part": 2.0, "peak": 1.0}
    now, called = [0.0], dict.fromkeys(took, 0)
    monkeypatch.setattr("experiments.benchmark.loop.time.perf_counter", lambda: now[0])

    def call(name: str) -> None:
        called[name] += 1
        now[0] += took[name]

    best = best_times({name: lambda name=name: call(name) for name in took}, ["part"], 3)
    assert best == took and called == {"whole": 5, "part": 2 + 3 * 4, "peak": 5}
