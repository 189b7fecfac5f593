"""Losses and gradients over all training worlds, and how many forward episodes one of them counts as."""

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
    """The gradient program of `experiments.tune`, for as many starts as it steps side by side."""

    def __init__(self, problem: Problem, config: TuneConfig) -> None:
        self.problem, self.starts = problem, config.starts
        self.tuner = Tuner(problem, config)
        self.worlds = stacked(list(problem.training.values()))
        self.dtype = jnp.result_type(float)

    def call(self, vectors: NDArray) -> tuple[NDArray, NDArray]:
        """Loss (start,) and gradient (start, parameter) of at most `starts` settings."""
        full = np.concatenate([vectors, np.repeat(vectors[:1], self.starts - len(vectors), axis=0)])
        found = self.tuner.gradients(jnp.asarray(full, self.dtype), self.worlds)
        loss, gradient = np.asarray(found.loss, float), np.asarray(found.gradient, float)
        return loss[: len(vectors)], gradient[: len(vectors)]

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
        problem, episodes = self.problem, self.starts * len(self.problem.training)
        start = np.repeat(self.problem.chosen.start()[None], self.starts, axis=0)

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
