"""Episodes in all variants side by side, sensed through images, and their measures."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.cells.people import FASTEST, make_people, recording_notes
from hrcjax.metrics import METRICS
from hrcjax.numerics import unrolled_options
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Cell, Params, World, episode, make_world, outcome
from hrcjax.sim.outcome import MOVING, counted
from hrcjax.typing import Array
from hrcjax.world import MOTIONS, Person, person_at, scene_named

from .config import MODES
from .contact_ratio import NEAR, ContactRatio
from .exposure import exposed, window_of
from .variants import VARIANTS, batch_axes, variant_part, with_variants

MEASURES = ("time_to_goal", "success", "clearance", "energy", "score_safety", "score_efficiency", "score_overall", "score_sound", "time_green", "time_yellow", "time_red", "time_stop", "time_below_sp")  # fmt: skip
"""Measures of an episode that are stored, of `hrcjax.metrics.METRICS`."""
assert set(MEASURES) <= set(METRICS)


@dataclass(frozen=True)
class Bench:
    """A cell with its parameters, and its compiled program."""

    cell: Cell
    params: Params
    _last: dict[tuple[str, str, int], World] = field(default_factory=dict, compare=False)

    @cached_property
    def measured_cell(self) -> Cell:
        """The cell with the monitor that has variants."""
        part = variant_part(self.cell.arm, self.cell.contact_mass)
        return replace(self.cell, safety=part, contact_mass="reflected")

    @cached_property
    def settings(self) -> Params:
        """The parameters of all variants."""
        return with_variants(self.params, VARIANTS)

    @cached_property
    def _programs(self) -> Mapping[str, Any]:
        return {mode: self._program(mode) for mode in MODES}

    def _program(self, mode: Literal["both", "path"]) -> Any:
        cell, window = replace(self.measured_cell, motion=mode), window_of(self.params.safety.ssm, self.cell.dt)

        def one(params: Params, world: World, fields: Any) -> dict[str, Array]:
            run = episode(params, cell, world, fields)
            record, ssm = run.record, cell.safety.yardstick(params.safety)
            person = jax.vmap(lambda t: person_at(world.person, t))(jnp.asarray(cell.times, record.q.dtype))
            seen = exposed(cell.arm, ssm, window, record.q, record.qd, person)
            found = outcome(params, cell, world, run)
            counts = counted(cell, world, record.tool)
            moving = jnp.max(jnp.abs(record.qd), axis=1) > MOVING
            return {
                **{name: getattr(found.metrics, name) for name in MEASURES},
                "hit": found.hit,
                "run_into": found.run_into,
                "counts": counts,
                "moving": moving,
                "zone": record.zone,
                "speed_limit": record.speed_limit,
                "tool": record.tool,
                "travelled": record.travelled,
                "q": record.q,
                "qd": record.qd,
                **{
                    name: getattr(seen, name)
                    for name in ("separation", "approach", "excess", "excess_now", "excess_pose", "short")
                },
            }

        def run(params: Params, world: World) -> dict[str, Array]:
            fields = cell.field.fit(params.field, world.frames)
            return jax.vmap(one, in_axes=(batch_axes(params), None, None))(params, world, fields)

        return jax.jit(run, compiler_options=unrolled_options())

    def play(self, world: World, mode: str) -> dict[str, np.ndarray]:
        """The measures of all variants in a world."""
        return {name: np.asarray(value) for name, value in self._programs[mode](self.settings, world).items()}

    def contact_ratios(self, world: World, played: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Speed towards people near a contact over that of a region, (variant time) [1]; see `ContactRatio.at`."""
        person = jax.vmap(lambda t: person_at(world.person, t))(jnp.asarray(self.cell.times, jnp.float32))
        a, b, radius = (np.asarray(x, np.float64) for x in (person.a, person.b, person.radius))
        ratio = ContactRatio(self.cell.arm, self.params.safety.pfl)
        near = (played["separation"] < NEAR + 1e-3) & played["counts"]
        found = [
            ratio.over(q.astype(float), qd.astype(float), here, a, b, radius, world.person.regions)
            for q, qd, here in zip(played["q"], played["qd"], near, strict=True)
        ]
        names = ("contact_ratio", "contact_ratio_any", "contact_ratio_rule")
        return dict(zip(names, np.stack(found, axis=1), strict=True))

    def world(self, scene_name: str, name: str, seed: int) -> World:
        """A scene with the people of a name, sensed in every image; the last one is kept."""
        key = (scene_name, name, seed)
        if key not in self._last:
            scene = scene_named(scene_name, seed)
            person = make_people(name, scene, seed, self.cell.ticks * self.cell.dt, self.cell.people)
            self._last.clear()
            self._last[key] = make_world(self.cell, scene, person, cell_rig(scene), jax.random.key(seed))
        return self._last[key]

    def case(self, mode: str, scene: str, name: str, seed: int) -> dict[str, Any]:
        """What is stored of a scene with its people."""
        world = self.world(scene, name, seed)
        times = jnp.asarray(self.cell.times, jnp.float32)
        hand = world.person.regions.index("hand")
        played = self.play(world, mode)
        ratios = self.contact_ratios(world, played)
        return {
            **{name: value for name, value in played.items() if name not in ("q", "qd")},
            **ratios,
            "scene": scene,
            "person": name.split("/")[-1],
            "seed": seed,
            "clean": is_clean(name, self.cell.ticks * self.cell.dt),
            "hand": np.asarray(_hand(world.person, times, hand)),
            "goal": np.asarray(world.scene.goal),
        }


@partial(jax.jit, static_argnums=2)
def _hand(person: Person, times: Array, capsule: int) -> Array:
    """The end of a capsule at all times [m]."""
    return jax.vmap(lambda t: person_at(person, t).b[capsule])(times)


def is_clean(name: str, duration: float) -> bool:
    """Whether a motion is without jumps."""
    if name in MOTIONS:
        return True
    return not any(f"over {FASTEST:g} m/s" in note for note in recording_notes(name, duration))
