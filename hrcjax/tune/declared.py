"""The losses that a tuning may choose from, by name, a user's own among them, and their weighted terms."""

import importlib
import inspect
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import jax.numpy as jnp

from hrcjax.lab.errors import UsageError, one_line
from hrcjax.sim import Cell, Params, World, episode
from hrcjax.tune import losses
from hrcjax.tune.evidence import evidence, leave_one_out
from hrcjax.tune.losses import LossFn
from hrcjax.tune.sound_loss import sound
from hrcjax.typing import Array, Float

TermsFn = Callable[[Params, World], Float[Array, "term"]]
"""Every term of the loss in one world."""


@dataclass(frozen=True)
class Loss:
    """One term of a loss; lower is better."""

    name: str
    """As on the command line."""
    unit: str
    """SI."""
    meaning: str
    """One line."""
    of: LossFn
    """The function."""
    of_episode: bool = True
    """False: it reads no episode, and gets None where no other loss needs one."""


def _loss(name: str, unit: str, of: LossFn, of_episode: bool = True) -> Loss:
    return Loss(name, unit, first_sentence(of), of, of_episode)


def first_sentence(of: LossFn) -> str:
    """The first sentence of a function's docstring; empty without one."""
    return " ".join((inspect.getdoc(of) or "").split("\n\n")[0].split()).split(". ")[0].rstrip(".")


LOSSES = {
    one.name: one
    for one in (
        _loss("sound", "1", sound),
        _loss("progress", "1", losses.progress),
        _loss("time", "s", losses.time),
        _loss("clearance", "1", losses.clearance),
        _loss("separation", "1", losses.separation),
        _loss("excess_speed", "m^2/s^2", losses.excess_speed),
        _loss("jerk", "m^2/s^6", losses.jerk),
        _loss("effort", "rad^2/s^4", losses.effort),
        _loss("energy", "J", losses.energy),
        _loss("evidence", "1", evidence, of_episode=False),
        _loss("leave_one_out", "1", leave_one_out, of_episode=False),
    )
}


def find_loss(name: str) -> Loss:
    """A declared loss by name, or MODULE:FUNCTION; modules in the current folder are found.

    Raises:
        UsageError: no such loss, module or function.
    """
    if name in LOSSES:
        return LOSSES[name]
    place, colon, function = name.partition(":")
    if not (colon and place and function):
        raise UsageError(f"no loss {name!r}; accepted: {', '.join(LOSSES)}, or MODULE:FUNCTION")
    if str(Path.cwd()) not in sys.path and "" not in sys.path:
        sys.path.insert(0, str(Path.cwd()))
    try:
        of: Any = getattr(importlib.import_module(place), function)
    except Exception as error:  # user code may raise anything
        raise UsageError(f"--loss {name}: {type(error).__name__}: {one_line(error)}") from error
    if not callable(of):
        raise UsageError(f"--loss {name}: accepted is a function (params, cell, world, episode) -> scalar")
    return _loss(name, "1", cast(LossFn, of))


def parse_losses(words: Sequence[str]) -> tuple[tuple[Loss, ...], tuple[float, ...]]:
    """Losses and their weights from words NAME or NAME=WEIGHT.

    Raises:
        UsageError: no such loss, one given twice, a weight that is not above 0.
    """
    found: dict[str, float] = {}
    for word in words:
        name, equals, weight = word.partition("=")
        try:
            found_weight = float(weight) if equals else 1.0
        except ValueError:
            found_weight = math.nan
        if not 0 < found_weight < math.inf:
            raise UsageError(f"--loss {word}: accepted: NAME or NAME=WEIGHT, a weight above 0")
        if name in found:
            raise UsageError(f"--loss {word}: {name} is given twice")
        found[name] = found_weight
    if not found:
        raise UsageError(f"--loss is empty; accepted: {', '.join(LOSSES)}, or MODULE:FUNCTION")
    return tuple(find_loss(name) for name in found), tuple(found.values())


def episode_terms(cell: Cell, chosen: Sequence[Loss]) -> TermsFn:
    """The terms as a function of parameters and world: one episode, read by every loss; none is traced if no loss reads one."""
    needed = any(loss.of_episode for loss in chosen)

    def terms(params: Params, world: World) -> Float[Array, "term"]:
        run: Any = episode(params, cell, world, cell.field.fit(params.field, world.frames)) if needed else None
        return jnp.stack([jnp.asarray(loss.of(params, cell, world, run), world.q_start.dtype) for loss in chosen])

    return terms
