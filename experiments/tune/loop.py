"""The steps of a tuning: minibatches, gradients, updates, checkpoints."""

import sys
import time
from collections.abc import Callable
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.lab.progress import Progress
from hrcjax.numerics import unrolled_options
from hrcjax.tune import TuneState, Values, initial_tuning, minibatch, tune_step, values_and_gradients
from hrcjax.tune.felt import Felt, feel
from hrcjax.tune.staged import StagedGradient

from .config import TuneConfig
from .live import LiveTable
from .optimiser import Checkpoints, History, make_optimiser
from .problem import Problem

SPREAD = 0.5
"""Deviation of other starts without bounds in their coordinate [1]."""


def stacked(worlds: list[Any]) -> Any:
    """Worlds as one, along a first axis, on the host."""
    return jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *worlds)


class Tuner:
    """The programs of a tuning: each is compiled once."""

    def __init__(self, problem: Problem, config: TuneConfig) -> None:
        self.problem, self.config = problem, config
        self.worlds = stacked(list(problem.training.values()))
        self.count = len(problem.training)
        self.optimiser = make_optimiser(config.rate, config.clip)
        self.compile_s = self.run_s = 0.0
        """Time to trace and compile the gradient; time of all its calls [s]."""
        self.calls = 0

    @cached_property
    def start(self) -> TuneState:
        """Before the first step."""
        starting, batches = jax.random.split(jax.random.key(self.config.seed))
        first = jnp.asarray(self.problem.chosen.start(), jnp.result_type(float))
        keys = jax.random.split(starting, max(self.config.starts - 1, 1))[: self.config.starts - 1]
        others = [self.problem.chosen.drawn(key, first, SPREAD) for key in keys]
        return initial_tuning(jnp.stack([first, *others]), self.optimiser, batches)

    def some_worlds(self, state: TuneState) -> Any:
        """The worlds of the next step."""
        places = np.asarray(minibatch(state.key, state.step, self.count, min(self.config.batch, self.count)))
        return jax.tree.map(lambda a: a[places], self.worlds)

    @cached_property
    def _gradients(self) -> Callable[[Any, Any], Values]:
        problem, begin = self.problem, time.monotonic()
        like = self.start.vector, self.some_worlds(self.start)
        if problem.stages is not None:
            made = StagedGradient(problem.stages, *like, problem.identity)
        else:

            def gradients(vectors: Any, worlds: Any) -> Values:
                return values_and_gradients(problem.terms, problem.weights, problem.params_of, vectors, worlds)

            made = jax.jit(gradients, compiler_options=unrolled_options()).lower(*like).compile()
        self.compile_s = time.monotonic() - begin
        return made

    @cached_property
    def _update(self) -> Any:
        return jax.jit(lambda state, found: tune_step(state, found, self.optimiser))

    @cached_property
    def _values(self) -> Any:
        return jax.jit(jax.vmap(self.problem.chosen.values))

    def gradients(self, vectors: Any, worlds: Any) -> Values:
        """Losses and gradients of every start."""
        made = self._gradients
        begin = time.monotonic()
        found = jax.block_until_ready(made(vectors, worlds))
        self.run_s += time.monotonic() - begin
        self.calls += 1
        return found

    def feel(self) -> Felt:
        """What the loss feels at the first start, in the worlds of the first step."""
        worlds, dtype = self.some_worlds(self.start), self.start.vector.dtype

        def at(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            found = self.gradients(jnp.asarray(points, dtype), worlds)
            return np.asarray(found.loss), np.asarray(found.gradient), np.asarray(found.each)

        return feel(at, np.asarray(self.start.vector[0], float), self.problem.weights, self.config.starts)

    def step(self, state: TuneState) -> tuple[TuneState, History]:
        """One step, and its row of the history."""
        found = self.gradients(state.vector, self.some_worlds(state))
        row = {
            "loss": found.loss, "terms": found.terms, "gradient": found.gradient, "vector": state.vector,
            "values": self._values(state.vector), "finite": found.finite,
        }  # fmt: skip
        return self._update(state, found), {name: np.asarray(value)[None] for name, value in row.items()}


def tune(tuner: Tuner, kept: Checkpoints) -> tuple[TuneState, History]:
    """All steps that are not done; the state after the last, and the history of all."""
    steps, every = tuner.config.steps, tuner.config.every
    found = kept.newest(tuner.start)
    state, history = found if found else (tuner.start, {})
    if found:
        done = int(state.step)
        less = f": more than --steps {steps}, and all of them count; no step is left" if done > steps else ""
        print(f"goes on after step {done}{less}", file=sys.stderr, flush=True)
    table = LiveTable(tuner.problem.chosen.names, [one.name for one in tuner.problem.losses], tuner.config.starts)
    with Progress(max(steps, int(state.step)), done=int(state.step), unit="step") as progress:
        if int(state.step) < steps:
            progress.say(table.header, sys.stdout)
        while int(state.step) < steps:
            state, row = tuner.step(state)
            history = {name: np.concatenate([history[name], more]) if history else more for name, more in row.items()}
            progress.advance(
                1, None, f"loss {np.nanmin(row['loss']) if np.isfinite(row['loss']).any() else np.nan:.4g}"
            )
            if int(state.step) % every == 0 or int(state.step) == steps:
                kept.save(state, history)
                progress.say(table.row(int(state.step), history, int(np.asarray(state.skipped).sum())), sys.stdout)
    return state, history
