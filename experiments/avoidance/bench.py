"""Worlds and episodes: each step compiled once, the set-up of a scene shared by all people."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.people import make_people
from hrcjax.numerics import unrolled_options
from hrcjax.reference.measures import SLOW
from hrcjax.sense.rig import cell_rig
from hrcjax.sim import Cell, Episode, Frames, Params, World, episode, make_world
from hrcjax.sim.outcome import AFTER, REACHED
from hrcjax.sim.prepare import frame_stamps, survey_world
from hrcjax.world import Person, Scene, motion_named

MODES = ("both", "path")
"""Ways to move: policies may leave the path, or only its clock reacts."""
FAR_BEHIND = -10.0
"""Margin with which the governor never stops the arm before a surface [m]."""


def single(tree: Any) -> Any:
    """Parameters in single precision, as in a sweep."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), tree)


def on_host(tree: Any) -> Any:
    """Arrays in NumPy, numbers in double precision."""
    return jax.tree.map(lambda a: np.asarray(a, float) if np.asarray(a).dtype.kind == "f" else np.asarray(a), tree)


def without_leaves(params: Params) -> Params:
    """The policy without its collision leaf and without its repulsion."""
    for name in ("collision", "repulsion"):
        leaf = getattr(params.policy, name, None)
        if leaf is not None and hasattr(leaf, "weight"):
            params = eqx.tree_at(
                lambda p, name=name: getattr(p.policy, name).weight, params, jnp.zeros((), jnp.float32)
            )
    return params


def without_stop(params: Params) -> Params:
    """The same, and a governor that does not stop the arm before surfaces, as far as it has that."""
    params = without_leaves(params)
    if hasattr(params.motion, "surface_margin"):
        params = eqx.tree_at(lambda p: p.motion.surface_margin, params, jnp.asarray(FAR_BEHIND, jnp.float32))
    return params


@dataclass(frozen=True)
class Played:
    """An episode on the host, every tick."""

    t: NDArray
    q: NDArray
    qd: NDArray
    tool: NDArray
    zone: NDArray
    reasons: NDArray
    """Why the arm is stopped: bits."""
    status: NDArray
    """Interventions: bits."""
    plan_status: int
    plan: NDArray
    """Planned tool path (waypoint 3) [m]."""

    def arrival(self, goal: NDArray) -> int | None:
        """The first tick with the tool at the goal and at rest; None: never."""
        speed = np.linalg.norm(np.diff(self.tool, axis=0, prepend=self.tool[:1]), axis=1) / (self.t[1] - self.t[0])
        at = (np.linalg.norm(self.tool - goal, axis=1) <= REACHED) & (speed <= SLOW)
        return int(at.argmax()) if at.any() else None

    def arrived(self, goal: NDArray) -> bool:
        """Whether it came to rest at the goal."""
        return self.arrival(goal) is not None

    def end(self, goal: NDArray) -> int:
        """The last tick that counts."""
        at, last = self.arrival(goal), len(self.t) - 1
        return last if at is None else min(last, at + round(AFTER / (self.t[1] - self.t[0])))

    def time(self, goal: NDArray) -> float:
        """Time to the goal, or the whole duration [s]."""
        at = self.arrival(goal)
        return float(self.t[-1] if at is None else self.t[at])


def played(cell: Cell, run: Episode) -> list[Played]:
    """The episodes of a batch."""
    names = ("q", "qd", "tool", "zone", "reasons", "status")
    arrays = {name: np.asarray(getattr(run.record, name)) for name in names}
    status, plan = np.asarray(run.path.status), np.asarray(run.path.waypoints)
    return [
        Played(t=np.asarray(cell.times, float), plan_status=int(status[k]), plan=plan[k], **{n: a[k] for n, a in arrays.items()})
        for k in range(len(status))
    ]  # fmt: skip


@dataclass(frozen=True)
class Bench:
    """A cell with its parameters, and its compiled steps."""

    cell: Cell
    params: Params

    @property
    def variants(self) -> tuple[str, ...]:
        """Names of the variants of `play_variants`."""
        return ("on", "leaf_off", "off")

    @cached_property
    def modes(self) -> tuple[str, ...]:
        """The ways in which this cell can move."""
        return MODES if hasattr(self.cell, "motion") else MODES[:1]

    def moving(self, mode: str) -> Cell:
        """The cell that moves in a way."""
        return replace(self.cell, motion=mode) if hasattr(self.cell, "motion") else self.cell

    @cached_property
    def _programs(self) -> Mapping[str, Any]:
        def program(cell: Cell) -> Any:
            def run(params: Params, world: World) -> Episode:
                fields = cell.field.fit(params.field, world.frames)
                return episode(params, cell, world, fields)

            return jax.jit(jax.vmap(run, in_axes=(0, None)), compiler_options=unrolled_options())

        return {mode: program(self.moving(mode)) for mode in self.modes}

    def play(self, params: list[Params], world: World, mode: str = "both") -> list[Played]:
        """Episodes of some settings in one world."""
        batch = jax.tree.map(lambda *leaves: jnp.stack(leaves), *params)
        return played(self.cell, self._programs[mode](batch, world))

    def play_variants(self, world: World) -> list[Played]:
        """Episodes with all on, without the policy's leaves, and without the governor's stop before surfaces too."""
        params = single(self.params)
        return self.play([params, without_leaves(params), without_stop(params)], world)

    def empty_world(self, scene: Scene, seed: int, known: Scene) -> World:
        """A scene as the cameras saw it at the set-up, with nobody in any later image.

        Args:
            known: what the planner is told.
        """
        cell, rig = self.cell, cell_rig(scene)
        duration = cell.ticks * cell.dt
        nobody: Person = motion_named("nobody", scene, 0, duration, 30.0)
        found = survey_world(cell, scene, nobody, rig, jax.random.key(seed))
        stamps, cameras = (jnp.asarray(a) for a in frame_stamps(cell, rig))
        dtype, capacity = found.q_start.dtype, cell.moving_points * cell.people
        one = Frames.nobody(found.field, capacity, rig.count, dtype, found.survey.overflow, found.survey.map, found.hidden)  # fmt: skip
        count = stamps.shape[0]

        def all_(a: Any) -> Any:
            return jax.tree.map(lambda x: jnp.broadcast_to(x, (count, *x.shape)), a)

        frames = eqx.tree_at(
            lambda f: (f.moving, f.beyond, f.stamp, f.camera, f.valid, f.reasons, f.guarded),
            one,
            (
                all_(one.moving), all_(one.beyond), jnp.asarray(stamps, dtype), cameras, jnp.ones(count, bool),
                all_(one.reasons), jnp.zeros(count, bool),
            ),
        )  # fmt: skip
        return World(scene, nobody, frames, found.q_start, known)

    def world(self, scene: Scene, name: str, seed: int) -> World:
        """A scene with the people of a name, sensed in every image."""
        person = make_people(name, scene, seed, self.cell.ticks * self.cell.dt, self.cell.people)
        return make_world(self.cell, scene, person, cell_rig(scene), jax.random.key(seed))
