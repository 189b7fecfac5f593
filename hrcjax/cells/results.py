"""The results of a setting that a sweep stores: metrics, traces and a status."""

from typing import Any

import jax
import jax.numpy as jnp

from hrcjax.cells.named_cell import NamedCell
from hrcjax.lab.field_docs import class_docs, split_unit
from hrcjax.metrics import METRICS
from hrcjax.sim import Params, Traces, World, episode, outcome
from hrcjax.sim.tick import NOT_FINITE_COMMAND, NOT_FINITE_READING, NOT_FINITE_TORQUE
from hrcjax.sweeps.sweepable import NOT_FINITE, Trace

STATUSES = {
    0: "ok",
    1: "goal not reached in time",
    2: "the arm touched an obstacle",
    3: "the arm touched the person while it moved",
    4: "the person touched the standing arm",
    5: "no plan: the planned path touches an obstacle that the planner knew",
}
"""Of several, the first of 3, 2, 4, 5, 1 is told. What else the planner found is in `plan_status`."""

BROKEN = NOT_FINITE_COMMAND | NOT_FINITE_TORQUE | NOT_FINITE_READING
"""Bits of the tick status that make a result invalid."""


def _trace(name: str) -> Trace:
    """Dims, unit and description of a field of `Traces`, from its shape annotation and docstring."""
    meaning, unit = split_unit(class_docs(Traces)[name])
    dims = Traces.__annotations__[name].dim_str.split()
    return Trace(tuple("xyz" if dim == "3" else dim for dim in dims), unit, meaning)


TRACES = {name: _trace(name) for name in Traces.__annotations__}


def evaluate(named: NamedCell, params: Params, world: World) -> dict[str, Any]:
    """Results of a batch of settings in one world.

    Args:
        params: swept leaves have one more leading axis than the cell's own; the others are shared by all settings.
    """
    cell, defaults = named.cell, named.params
    axes = jax.tree.map(lambda leaf, default: 0 if jnp.ndim(leaf) > jnp.ndim(default) else None, params, defaults)
    field_axes = jax.tree.leaves(axes.field)
    share = all(axis is None for axis in field_axes)
    shared = cell.field.fit(params.field, world.frames) if share else None

    def one(setting: Params) -> dict[str, Any]:
        fields = cell.field.fit(setting.field, world.frames) if shared is None else shared
        run = episode(setting, cell, world, fields)
        kept = outcome(setting, cell, world, run)
        metrics = {name: getattr(kept.metrics, name) for name in METRICS}
        metrics["clearance"] = jnp.where(jnp.any(world.scene.mask), metrics["clearance"], jnp.nan)
        somebody = jnp.any(world.person.present) & jnp.any(world.person.radius >= 0)
        metrics["separation"] = jnp.where(somebody, metrics["separation"], jnp.nan)
        own = {name: measure(setting, cell, world, run) for name, (_, measure) in named.metrics.items()}
        traces = {name: getattr(kept.traces, name) for name in TRACES}
        touched = kept.metrics.clearance < 0
        status = jnp.where(kept.metrics.success > 0, 0, 1)
        status = jnp.where(kept.no_plan, 5, status)
        status = jnp.where(kept.run_into, 4, status)
        status = jnp.where(touched, 2, status)
        status = jnp.where(kept.hit, 3, status)
        status = jnp.where(kept.run_status & BROKEN != 0, NOT_FINITE, status)
        return {**metrics, **own, **traces, "status": status.astype(jnp.int32)}

    return jax.vmap(one, in_axes=(axes,))(params)
