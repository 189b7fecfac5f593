"""The systems that are compared: what each is, and a run of it beside a person."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.people import make_people
from hrcjax.cells.ur5 import make_cell
from hrcjax.numerics import unrolled_options
from hrcjax.sense import no_faults
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Cell, Params
from hrcjax.sim.default_parts import potential_planner
from hrcjax.sim.prepare import Surveyed, stage_for, survey_world
from hrcjax.sim.survey import SenseParams
from hrcjax.world import Person, Scene, scene_named

from .baseline.episode import baseline_episode
from .baseline.guard import Guard
from .baseline.settings import BaselineSettings
from .cycle import cycled
from .nearest import NEAREST_FIELD
from .trace import PROBE_TICKS, PROBES, Trace, probes_between, true_distances, waypoints_of
from .unguarded import UNGUARDED

SCENE = "hri"
"""The scene with the paper's waypoints."""
OURS: dict[str, str] = {
    "ours": "our policies on our field along a route to and fro, with speed and separation (mode both)",
    "nearest": "ours on the distance to the nearest point",
    "path": "our path, whose clock alone reacts (mode path)",
    "ours_free": "ours without speed and separation",
}
BASELINES: dict[str, str] = {
    "baseline": "OctoMap, BFMT*, toppra, a monitor that stops and plans anew",
    "baseline_guarded": "the same with our safety layer over it: speed and separation slow its motions",
    "baseline_slow": "the baseline with the acceleration at which its cycle takes as long as that of ours",
}
EXPLAINED = OURS | BASELINES
"""System -> what it is."""
SYSTEMS = tuple(EXPLAINED)


def cell_of(system: str, cell: Cell) -> Cell:
    """The cell of one of our systems."""
    motion: Literal["both", "path"] = "path" if system == "path" else "both"
    cell = replace(cell, motion=motion)
    if system == "nearest":
        return replace(cell, field=NEAREST_FIELD)
    return replace(cell, safety=UNGUARDED) if system == "ours_free" else cell


@dataclass(frozen=True)
class Bench:
    """Runs of all systems of one length."""

    seconds: float
    """Length of a run [s]."""
    params: Params
    """Of our systems."""
    settings: BaselineSettings
    """Of the baseline."""
    slow: BaselineSettings
    """Of the baseline at our cycle time."""
    decimation: int = 4
    """Of the 640 x 480 pixels of the cameras every n-th column and row is kept."""

    @cached_property
    def cell(self) -> Cell:
        """The cell of all. Ours plan the tool's way by the potential: between the waypoints a straight line, as the HRI paper's target
        policy asks for."""
        cell = make_cell()
        return replace(cell, ticks=round(self.seconds / cell.dt), plan=potential_planner())

    @cached_property
    def scene(self) -> Scene:
        """The scene of all."""
        return scene_named(SCENE, 0)

    @cached_property
    def waypoints(self) -> NDArray:
        """Joints at the waypoints [rad]."""
        return waypoints_of(self.cell, self.scene)

    @cached_property
    def _set_ups(self) -> dict[int, Surveyed]:
        return {}

    @cached_property
    def _programs(self) -> dict[str, Callable[..., Any]]:
        return {}

    def person(self, name: str, seed: int) -> Person:
        """Everybody in the cell."""
        return make_people(name, self.scene, seed, self.seconds, self.cell.people)

    def set_up(self, person: Person, seed: int) -> Surveyed:
        """The cell after its set-up, which is made once for a seed, with the people who will come."""
        rig = cell_rig(self.scene, decimation=self.decimation)
        if seed not in self._set_ups:
            key = jax.random.fold_in(jax.random.key(seed), 1)
            self._set_ups[seed] = survey_world(self.cell, self.scene, person, rig, key)
        stage = stage_for(rig, self.scene, person, no_faults(rig.count, self.scene.start.dtype))
        return eqx.tree_at(lambda k: k.stage, self._set_ups[seed], stage)

    def trace(self, system: str, name: str, seed: int) -> Trace:
        """A run of a system beside the people of a name; the images of a seed have the same noise for all."""
        person = self.person(name, seed)
        if system in BASELINES:
            settings = self.slow if system == "baseline_slow" else self.settings
            rig = cell_rig(self.scene, decimation=self.decimation)
            guard = self._guard(person, seed) if system == "baseline_guarded" else None
            return baseline_episode(self.cell, self.scene, person, settings, seed, rig, self.waypoints, guard)
        return self._ours(system, person, seed)

    def _guard(self, person: Person, seed: int) -> Guard:
        known, cell = self.set_up(person, seed), replace(self.cell, motion="path")
        single = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), self.params)
        return Guard(cell, single, known, jax.random.key(seed), self.settings.tool_speed)

    def _program(self, system: str) -> Callable[..., Any]:
        if system not in self._programs:
            cell = cell_of(system, self.cell)
            play = partial(_played, cell)
            self._programs[system] = jax.jit(play, compiler_options=unrolled_options())
        return self._programs[system]

    def _ours(self, system: str, person: Person, seed: int) -> Trace:
        known = self.set_up(person, seed)
        single = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), self.params)
        waypoints = jnp.asarray(self.waypoints, jnp.float32)
        probes = probes_between(self.waypoints)
        found = self._program(system)(single, known, jax.random.key(seed), waypoints, jnp.asarray(probes, jnp.float32))
        record, cell = found.record, self.cell
        q, qd, tool = (np.asarray(getattr(record, name), float) for name in ("q", "qd", "tool"))
        t = np.asarray(cell.times)
        separation, clearance = true_distances(cell, self.scene, person, q, t)
        times = t[::PROBE_TICKS]
        true, _ = true_distances(cell, self.scene, person, np.tile(probes, (len(times), 1)), np.repeat(times, PROBES))
        return Trace(
            dt=cell.dt, t=t, q=q, qd=qd, tool=tool, separation=separation, clearance=clearance,
            known=np.asarray(record.separation, float), lag=np.zeros(len(t)), zone=np.asarray(record.zone),
            probe_t=times, probe_known=np.asarray(found.probe_known, float)[::PROBE_TICKS],
            probe_true=true.reshape(-1, PROBES),
        )  # fmt: skip


def _played(cell: Cell, params: Params, known: Surveyed, key: Any, waypoints: Any, probes: Any) -> Any:
    return cycled(params, cell, known, key, SenseParams(), waypoints, probes)
