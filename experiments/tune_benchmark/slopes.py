"""Losses and gradients over all training worlds, and how many forward episodes one of them counts as."""

from dataclasses import replace
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.numerics import unrolled_options

from ..tune.config import TuneConfig
from ..tune.loop import Tuner, stacked
from ..tune.problem import Problem
from .forward import Forward, timed

CALLS = 3
"""Warm calls whose median time counts."""


class Slopes:
    """The gradient program of `experiments.tune`, for as many settings as are asked for side by side."""

    def __init__(self, problem: Problem, config: TuneConfig, at_once: int) -> None:
        self.problem, self.at_once = problem, at_once
        self.tuner = Tuner(problem, replace(config, starts=at_once))
        self.worlds = stacked(list(problem.training.values()))
        self.dtype = jnp.result_type(float)

    def call(self, vectors: NDArray) -> tuple[NDArray, NDArray]:
        """Loss (setting,) and gradient (setting, parameter), `at_once` in a call; the last one is filled up."""
        losses, gradients = [], []
        for first in range(0, len(vectors), self.at_once):
            some = vectors[first : first + self.at_once]
            full = np.concatenate([some, np.repeat(some[:1], self.at_once - len(some), axis=0)])
            found = self.tuner.gradients(jnp.asarray(full, self.dtype), self.worlds)
            losses.append(np.asarray(found.loss, float)[: len(some)])
            gradients.append(np.asarray(found.gradient, float)[: len(some)])
        return np.concatenate(losses), np.concatenate(gradients)

    @cached_property
    def compile_s(self) -> float:
        """Time to trace and compile: the first call less the second [s]."""
        start = self.problem.chosen.start()[None]
        times = [timed(lambda: self.call(start)) for _ in range(2)]
        return max(times[0] - times[1], 0.0)

    def cost(self, forward: Forward) -> dict[str, float]:
        """Times of warm calls and their ratios.

        Returns:
            ratio: of a gradient call over a forward call of the true metrics, of the same settings and worlds [1]; packed_ratio: the
            same over full calls of the forward program, for each episode [1]; times [s].
        """
        problem, episodes = self.problem, self.at_once * len(self.problem.training)
        start = np.repeat(self.problem.chosen.start()[None], self.at_once, axis=0)

        def over(vectors: Any, worlds: Any) -> Any:
            def each(vector: Any) -> Any:
                params = problem.params_of(vector)
                return jax.vmap(lambda world: problem.measure(params, world))(worlds)

            return jax.vmap(each)(vectors)

        program = jax.jit(over, compiler_options=unrolled_options())
        as_many = lambda: jax.block_until_ready(program(jnp.asarray(start, self.dtype), self.worlds))  # noqa: E731  # a call
        compile_s, _ = self.compile_s, as_many()
        _ = forward.compile_s
        world = next(iter(problem.training.values()))
        full = np.repeat(start[:1], forward.at_once, axis=0)
        gradient_s, forward_s, packed_s = (
            float(np.median([timed(work) for _ in range(CALLS)]))
            for work in (lambda: self.call(start), as_many, lambda: forward.call(full, world))
        )
        return {
            "ratio": gradient_s / forward_s,
            "packed_ratio": gradient_s / episodes / (packed_s / forward.at_once),
            "gradient_s": gradient_s,
            "forward_s": forward_s,
            "packed_s": packed_s,
            "gradient_compile_s": compile_s,
            "forward_compile_s": forward.compile_s,
        }
