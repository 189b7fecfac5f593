"""The derivative of an episode's loss by the knobs, in double precision and reverse mode, against central differences."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.cells.named_cell import NamedCell
from hrcjax.cells.worlds import build_world
from hrcjax.lab.parameters import set_leaves
from hrcjax.numerics import unrolled_options
from hrcjax.sim import Params, World, episode
from hrcjax.tune import episode_loss

RANGES = {"K_att": (0.03, 0.2), "K_rep": (1e-6, 1e-3), "zeta": (1.5, 5.0)}
"""Of the default sweep; settings are drawn log-uniformly."""
STEPS = (1e-4, 1e-5)
"""Relative steps of the central differences: two, as at a jump they disagree [1]."""
AT_ONCE = 10
"""Settings in one call."""
WORLD = ("robotica", "reach_in", 0)
"""Scene, person and seed of the default sweep."""


def settings(count: int, seed: int = 0) -> NDArray:
    """Log-uniform settings (setting knob); the first ones of a larger number are those of a smaller one."""
    u = np.random.default_rng(seed).uniform(size=(count, len(RANGES)))
    low, high = np.log(np.array(list(RANGES.values()))).T
    return np.exp(low + u * (high - low))


def as_double(tree: Any) -> Any:
    """Every number in double precision; within `jax.enable_x64`."""

    def one(a: Any) -> Any:
        return jnp.asarray(a, jnp.float64) if jnp.issubdtype(jnp.result_type(a), jnp.floating) else jnp.asarray(a)

    return jax.tree.map(one, tree)


class Differentiator:
    """The loss of the default sweep's episode as a function of log K_att, log K_rep and log zeta."""

    def __init__(self, named: NamedCell) -> None:
        self.named = named
        aliases = named.known_aliases()
        self.names = [aliases[knob] for knob in RANGES]

    @cached_property
    def world(self) -> World:
        """Sensed in single precision, as in a sweep."""
        return build_world(self.named.cell, *WORLD)

    def _params(self, logs: Any) -> Params:
        return as_double(set_leaves(self.named.params, dict(zip(self.names, jnp.exp(logs), strict=True))))

    def _loss(self, logs: Any, world: World) -> Any:
        return episode_loss(self._params(logs), self.named.cell, world)

    @cached_property
    def _gradient(self) -> Any:
        over = jax.vmap(jax.value_and_grad(self._loss), in_axes=(0, None))
        return jax.jit(over, compiler_options=unrolled_options())

    @cached_property
    def _value(self) -> Any:
        return jax.jit(jax.vmap(self._loss, in_axes=(0, None)), compiler_options=unrolled_options())

    @cached_property
    def _signs(self) -> Any:
        cell = self.named.cell

        def signs(logs: Any, world: World) -> tuple[Any, ...]:
            params = self._params(logs)
            run = episode(params, cell, world, cell.field.fit(params.field, world.frames))
            return run.path.status, run.path.waypoints, run.record.zone, run.record.reasons, run.record.status

        return jax.jit(jax.vmap(signs, in_axes=(0, None)), compiler_options=unrolled_options())

    def case(self, knobs: NDArray) -> Mapping[str, Any]:
        """Gradients by the logarithms of the knobs, and differences at both steps, of some settings (setting knob)."""
        with jax.enable_x64(True):
            world = as_double(self.world)
            logs = np.log(knobs)
            loss, gradient = self._gradient(jnp.asarray(logs), world)
            count, size = logs.shape
            differences = np.empty((len(STEPS), count, size))
            for n, step in enumerate(STEPS):
                for k in range(size):
                    ends = [np.asarray(self._value(jnp.asarray(logs + sign * step * np.eye(size)[k]), world)) for sign in (1, -1)]  # fmt: skip
                    differences[n, :, k] = (ends[0] - ends[1]) / (2 * step)
            found = {
                "knobs": knobs,
                "loss": np.asarray(loss),
                "gradient": np.asarray(gradient),
                "differences": differences,
            }
            return found | {"what": self._what(logs, found, world)}

    def _what(self, logs: NDArray, found: Mapping[str, Any], world: World) -> NDArray:
        """What jumps within the smaller step where gradient and differences disagree (setting knob): names."""
        names = np.full(logs.shape, "", dtype="U32")
        for k in np.flatnonzero(~right(found).all(axis=0)):
            step = STEPS[-1] * np.eye(logs.shape[1])[k]
            one, other = (
                jax.tree.map(np.asarray, self._signs(jnp.asarray(logs + sign * step), world)) for sign in (1, -1)
            )
            for n in np.flatnonzero(~right(found)[:, k]):
                names[n, k] = difference(*(jax.tree.map(lambda a, n=n: a[n], side) for side in (one, other)))
        return names


def difference(one: tuple[NDArray, ...], other: tuple[NDArray, ...]) -> str:
    """What tells two neighbouring episodes apart: the plan, a zone, a reason of a stop, an intervention; or nothing known."""
    plan = one[0] != other[0] or np.abs(one[1] - other[1]).max() > 1e-3
    apart = {
        "plan": plan,
        "zone": (one[2] != other[2]).any(),
        "stop": (one[3] != other[3]).any(),
        "guard": (one[4] != other[4]).any(),
    }
    return "+".join(name for name, differs in apart.items() if differs) or "unknown"


FLOOR = 1e-9
"""Derivatives by a factor e below this share of the loss count as 0 [1]."""
WITHIN = 0.01
"""Relative error that counts as equal [1]."""


def right(case: Mapping[str, Any]) -> NDArray:
    """Where the gradient equals the differences at one of the steps (setting knob)."""
    gradient, floor = case["gradient"], FLOOR * np.abs(case["loss"])[:, None]
    each = [np.abs(gradient - d) <= WITHIN * np.abs(d) + floor for d in case["differences"]]
    return np.logical_or.reduce(each)


def jumps(case: Mapping[str, Any]) -> NDArray:
    """Where the differences at both steps disagree (setting knob): the loss jumps within the larger one."""
    wide, narrow = case["differences"]
    floor = FLOOR * np.abs(case["loss"])[:, None]
    return np.abs(wide - narrow) > 2 * WITHIN * np.abs(narrow) + 2 * floor


def nonzero(case: Mapping[str, Any]) -> NDArray:
    """Where the gradient is felt (setting knob)."""
    return np.abs(case["gradient"]) > FLOOR * np.abs(case["loss"])[:, None]
