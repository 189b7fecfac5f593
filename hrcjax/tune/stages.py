"""The parts of an episode that a gradient passes, one after the other: plan, fields, ticks, losses.

Each is a function of the coordinates of all starts and of all worlds, so that it can be a program of its own. What no chosen parameter
reaches is the same for all starts, is computed once for each world, and needs no derivative.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from hrcjax.sim import Cell, Episode
from hrcjax.sim.episode import follow, plan_route, task_of
from hrcjax.sim.tick import NOT_FINITE_TORQUE, TORQUE_LIMITED
from hrcjax.tune.declared import Loss
from hrcjax.typing import Array, Bool, Float

PLAN = ("plan", "potential")
FIELD = ("field",)
"""First words of the names of the parameters that plan and fields depend on."""


@dataclass(frozen=True)
class Stages:
    """The stages of an episode for some chosen parameters."""

    cell: Cell
    losses: tuple[Loss, ...]
    weights: tuple[float, ...]
    params_of: Callable[[Float[Array, "parameter"]], Any]
    """Parameters of a vector of coordinates."""
    names: tuple[str, ...]
    """The chosen parameters."""

    @property
    def plan_tuned(self) -> bool:
        """Whether a chosen parameter reaches the plan."""
        return any(name.partition(".")[0] in PLAN for name in self.names)

    @property
    def fields_tuned(self) -> bool:
        """Whether a chosen parameter reaches the fields."""
        return any(name.partition(".")[0] in FIELD for name in self.names)

    def plan(self, vectors: Float[Array, "start parameter"], worlds: Any) -> Any:
        """Paths and routes, (start, world) or (world)."""

        def one(vector: Array, world: Any) -> Any:
            params = self.params_of(vector)
            return plan_route(params, self.cell, task_of(params, self.cell, world))

        return _over(one, self.plan_tuned)(vectors, worlds)

    def fit(self, vectors: Float[Array, "start parameter"], worlds: Any) -> Any:
        """Fields, (start, world) or (world)."""

        def one(vector: Array, world: Any) -> Any:
            return self.cell.field.fit(self.params_of(vector).field, world.frames)

        return _over(one, self.fields_tuned)(vectors, worlds)

    def ticks(self, vectors: Float[Array, "start parameter"], worlds: Any, routes: Any, fields: Any) -> Any:
        """Final states and records, (start, world)."""

        def one(vector: Array, world: Any, route: Any, fields: Any) -> Any:
            return follow(self.params_of(vector), self.cell, route, world.frames, world.q_start, fields)

        starts = (0, None, 0 if self.plan_tuned else None, 0 if self.fields_tuned else None)
        return jax.vmap(jax.vmap(one, in_axes=(None, 0, 0, 0)), in_axes=starts)(vectors, worlds, routes, fields)

    def loss(
        self, vectors: Float[Array, "start parameter"], worlds: Any, paths: Any, runs: Any
    ) -> tuple[Float[Array, "start"], Float[Array, "start world term"]]:
        """The weighted sum of the terms, mean over worlds; the terms in every world.

        Args:
            runs: final states and records.
        """

        each = jnp.stack([self.term(one, vectors, worlds, paths, runs) for one in self.losses], axis=-1)
        return weighted(each, self.weights), each

    def term(
        self, loss: Loss, vectors: Float[Array, "start parameter"], worlds: Any, paths: Any, runs: Any
    ) -> Float[Array, "start world"]:
        """One of the terms in every world.

        Args:
            runs: final states and records.
        """

        def one(vector: Array, world: Any, path: Any, run: Any) -> Array:
            value = loss.of(self.params_of(vector), self.cell, world, Episode(path, run[1], run[0]))
            return jnp.asarray(value, world.q_start.dtype)

        starts = (0, None, 0 if self.plan_tuned else None, 0)
        return jax.vmap(jax.vmap(one, in_axes=(None, 0, 0, 0)), in_axes=starts)(vectors, worlds, paths, runs)


def weighted(each: Float[Array, "start world term"], weights: Sequence[float]) -> Float[Array, "start"]:
    """The weighted sum of the means over worlds."""
    return jnp.mean(each, axis=1) @ jnp.asarray(weights, each.dtype)


def torque_clipped(runs: Any) -> Bool[Array, ""]:
    """Whether a torque was clipped, or not finite, in any tick: then derivatives by `Cell.linear_servo` do not hold."""
    return jnp.any(runs[1].status & (TORQUE_LIMITED | NOT_FINITE_TORQUE) != 0)


def _over(one: Callable[[Array, Any], Any], tuned: bool) -> Callable[[Array, Any], Any]:
    """Over worlds, and over starts if a tuned parameter is in it."""
    worlds = jax.vmap(one, in_axes=(None, 0))
    return jax.vmap(worlds, in_axes=(0, None)) if tuned else lambda vectors, worlds_: worlds(vectors[0], worlds_)
