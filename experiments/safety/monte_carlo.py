"""Many episodes by chance: the closed loop beside people, told by a sensing that keeps its word but is late, noisy and fails.

The loop is that of the cell: plan, path clock, motion policy, monitor, governor, servo. Images are not rendered: the field reads the
exact capsules of the image in use, moved by noise, less what it vouches for. Counted are violations, by the exact shapes.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.capsules import Capsules
from hrcjax.numerics import unrolled_options
from hrcjax.sim import Cell, Fields, Params, Sensed, Task, TickState, tick
from hrcjax.sim.episode import plan_route
from hrcjax.sim.outcome import MOVING, REACHED
from hrcjax.sim.prepare import posture_at
from hrcjax.sim.route import Route
from hrcjax.sim.tick import Record, initial_state
from hrcjax.typing import Array
from hrcjax.world import Scene, first_obstacles, scene_named

from .draws import LEAD, RATE, Draw, Drawer
from .exact_field import EXACT_FIELD, Margin, Shapes, standing
from .exposure import SHORT, TOWARDS, Exposure, exposed, window_of

AT_ONCE = 64
"""Episodes of a batch."""
EPISODE = 8.0
"""Length of an episode [s]."""


class Told(eqx.Module):
    """What a batch of episodes is told, and the truth."""

    a: Array
    """Capsules' ends in every image (episode image capsule 3) [m]."""
    b: Array
    radius: Array
    """(episode capsule) [m]."""
    noise: Array
    """Of every image (episode image 3) [m]."""
    image: Array
    """In use at every tick (episode tick)."""
    age: Array
    """Of that image [s]."""
    guarded: Array
    """See `Sensed.guarded`."""


def told(draws: list[Draw], dtype: jnp.dtype | type = jnp.float32) -> Told:
    """The arrays of some episodes."""

    def stack(name: str) -> Array:
        values = np.stack([getattr(draw, name) for draw in draws])
        return jnp.asarray(values, dtype if values.dtype.kind == "f" else values.dtype)

    found = {name: stack(name) for name in ("a", "b", "radius", "noise", "age", "guarded")}
    return Told(**found, image=jnp.asarray(np.stack([draw.image for draw in draws]), jnp.int32))


def follow_told(params: Params, cell: Cell, route: Route, static: Any, q_start: Array, one: Told) -> Record:
    """An episode; all arrays without the leading axis."""
    seen = Shapes(one.a + one.noise[:, None], one.b + one.noise[:, None], jnp.broadcast_to(one.radius, one.a.shape[:2]))
    now = jax.tree.map(lambda x: x[one.image], seen)

    def step(state: TickState, item: tuple) -> tuple[TickState, Record]:
        people, age, guarded = item
        sensed = Sensed(Fields(static, people), age, jnp.asarray(True), guarded, jnp.asarray(0, jnp.int32))
        return tick(params, cell, route, sensed, state)

    return jax.lax.scan(step, initial_state(cell, q_start), (now, one.age, one.guarded))[1]


def true_people(one: Told, times: Array) -> Capsules:
    """The people at every tick, on straight lines between the images' poses."""
    place = jnp.clip(times * RATE + LEAD, 0, one.a.shape[0] - 1)
    low = jnp.clip(jnp.floor(place).astype(jnp.int32), 0, one.a.shape[0] - 2)
    part = (place - low.astype(place.dtype))[:, None, None]
    a, b = (x[low] + part * (x[low + 1] - x[low]) for x in (one.a, one.b))
    return Capsules(a, b, jnp.broadcast_to(one.radius, (*times.shape, *one.radius.shape)))


@dataclass(frozen=True)
class Chance:
    """Episodes by chance in the scenes of a cell."""

    cell: Cell
    params: Params
    people: tuple[str, ...]
    length: float = EPISODE
    """Of an episode [s]."""
    _kept: dict[tuple[str, int], "Ready"] = field(default_factory=dict, compare=False)

    @cached_property
    def short_cell(self) -> Cell:
        """The cell with the field of exact shapes, and shorter episodes."""
        return replace(self.cell, field=EXACT_FIELD, ticks=round(self.length / self.cell.dt))

    @cached_property
    def _ready(self) -> Any:
        def ready(params: Params, scene: Scene, q_start: Array) -> tuple:
            task = Task(first_obstacles(scene, self.cell.obstacles), q_start, params.potential, self.cell.arm)
            return plan_route(params, self.short_cell, task)[1], standing(self.short_cell, scene)

        return jax.jit(ready)

    @cached_property
    def _play(self) -> Any:
        cell = self.short_cell
        window = window_of(self.params.safety.ssm, cell.dt)

        def one(
            params: Params, route: Route, static: Any, q_start: Array, goal: Array, given: Told
        ) -> dict[str, Array]:
            record = follow_told(params, cell, route, static, q_start, given)
            people = true_people(given, jnp.asarray(cell.times, q_start.dtype))
            seen: Exposure = exposed(cell.arm, params.safety.ssm, window, record.q, record.qd, people)
            moving = jnp.max(jnp.abs(record.qd), axis=1) > MOVING
            return {
                "excess": jnp.max(seen.excess),
                "excess_now": jnp.max(seen.excess_now),
                "excess_pose": jnp.max(seen.excess_pose),
                "short": jnp.max(seen.short),
                "separation": jnp.min(seen.separation),
                "hit": jnp.any(moving & (seen.separation < 0)),
                "stops": jnp.sum((record.zone[1:] == 3) & (record.zone[:-1] != 3)),
                "held": jnp.any(given.age > params.safety.max_age),
                "over": jnp.sum(seen.excess > TOWARDS),
                "worst_zone": record.zone[jnp.argmax(seen.excess)],
                "arrived": jnp.any(jnp.sum((record.tool - goal) ** 2, axis=1) < REACHED**2),
                "met": jnp.any(record.zone >= 2),
                "worst": jnp.argmax(seen.excess),
                "finite": jnp.all(jnp.isfinite(record.q)),
            }

        every = jax.vmap(one, in_axes=(None, None, None, None, None, 0))
        return jax.jit(every, compiler_options=unrolled_options())

    def scene(self, name: str, seed: int) -> tuple[Scene, Array]:
        """A scene and the start in it."""
        made = scene_named(name, seed)
        return made, posture_at(self.short_cell, made.start)

    def params_of(self, dtype: jnp.dtype | type = jnp.float32, retreat: bool = True, in_front: float = 0.0) -> Params:
        """The parameters with those of this field; without the retreat of a stop, if told so.

        Args:
            in_front: see `Margin.in_front`.
        """
        with_field = eqx.tree_at(lambda p: p.field, self.params, Margin(in_front=in_front))
        if not retreat:
            with_field = eqx.tree_at(lambda p: p.safety.zone.retreat_speed, with_field, 0.0)
        return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), with_field)

    def ready(self, scene_name: str, scene_seed: int) -> "Ready":
        """A scene made ready, kept."""
        if (scene_name, scene_seed) not in self._kept:
            scene, q_start = self.scene(scene_name, scene_seed)
            route, static = self._ready(self.params_of(), scene, q_start)
            drawer = Drawer(scene, self.people, self.short_cell.ticks, self.short_cell.dt)
            self._kept[scene_name, scene_seed] = Ready(scene, q_start, route, static, drawer)
        return self._kept[scene_name, scene_seed]

    def case(
        self, scene_name: str, scene_seed: int, first: int, count: int, retreat: bool = True, in_front: float = 0.0
    ) -> Mapping[str, Any]:
        """What is stored of `count` episodes in a scene, of the seeds from `first` on."""
        ready = self.ready(scene_name, scene_seed)
        scene, q_start, route, static, drawer = ready
        params = self.params_of(retreat=retreat, in_front=in_front)
        begun = time.perf_counter()
        found: list[dict[str, Any]] = []
        for begin in range(first, first + count, AT_ONCE):
            draws = [drawer(seed) for seed in range(begin, begin + AT_ONCE)]
            batch = self._play(params, route, static, q_start, scene.goal, told(draws))
            kept = min(AT_ONCE, first + count - begin)
            arrays = {name: np.asarray(value)[:kept] for name, value in batch.items()}
            arrays["fastest"] = np.array([draw.fastest for draw in draws])[:kept]
            arrays["person"] = np.array([self.people.index(draw.person) for draw in draws])[:kept]
            found.append(arrays)
        joined = {name: np.concatenate([part[name] for part in found]) for name in found[0]}
        return joined | {"seconds": time.perf_counter() - begun}


class Ready(NamedTuple):
    """A scene with its plan and its field."""

    scene: Scene
    q_start: Array
    route: Route
    static: Any
    drawer: Drawer


def violated(case: Mapping[str, Any]) -> Any:
    """Episodes with a violation: faster towards a person than allowed, or no way to stop before C."""
    return (np.asarray(case["excess"]) > TOWARDS) | (np.asarray(case["short"]) > SHORT)
