"""Forward episodes: one compiled program for a fixed number of settings in one world, and the true score of settings."""

import time
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.numerics import unrolled_options

from ..tune.problem import Problem
from .problem import SCORE


class Forward:
    """Measures settings in worlds, `at_once` in a call."""

    def __init__(self, problem: Problem, at_once: int) -> None:
        self.problem, self.at_once = problem, at_once
        self.dtype = jnp.result_type(float)

    @cached_property
    def _program(self) -> Any:
        problem = self.problem

        def over(vectors: Any, world: Any) -> Any:
            return jax.vmap(lambda vector: problem.measure(problem.params_of(vector), world))(vectors)

        return jax.jit(over, compiler_options=unrolled_options())

    def call(self, vectors: NDArray, world: Any) -> Mapping[str, NDArray]:
        """Every metric (setting,) of at most `at_once` settings; the call is filled up with the first of them."""
        full = np.concatenate([vectors, np.repeat(vectors[:1], self.at_once - len(vectors), axis=0)])
        found = jax.block_until_ready(self._program(jnp.asarray(full, self.dtype), world))
        return {name: np.asarray(value)[: len(vectors)] for name, value in found.items()}

    @cached_property
    def compile_s(self) -> float:
        """Time to trace and compile: the first call less the second [s]."""
        world, start = next(iter(self.problem.training.values())), self.problem.chosen.start()[None]
        times = [timed(lambda: self.call(start, world)) for _ in range(2)]
        return max(times[0] - times[1], 0.0)

    def measured(self, vectors: NDArray, worlds: Mapping[str, Any]) -> dict[str, NDArray]:
        """Every metric (setting, world)."""
        _ = self.compile_s  # compiled before, so that no caller's time has it
        groups = [vectors[k : k + self.at_once] for k in range(0, len(vectors), self.at_once)]
        found = [[self.call(some, world) for world in worlds.values()] for some in groups]
        names = found[0][0].keys()
        return {name: np.concatenate([np.stack([one[name] for one in row], axis=1) for row in found]) for name in names}


def true_scores(found: Mapping[str, NDArray]) -> NDArray:
    """Mean score over worlds (setting,); minus infinity where one is not finite."""
    with np.errstate(invalid="ignore"):
        means = np.asarray(found[SCORE], float).mean(axis=1)
    return np.where(np.isfinite(means), means, -np.inf)


def timed(work: Any) -> float:
    """Time of a call [s]."""
    begin = time.monotonic()
    work()
    return time.monotonic() - begin
