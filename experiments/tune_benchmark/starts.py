"""Settings to start from: the defaults, and others drawn within the bounds."""

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from ..tune.problem import Problem

SPREAD = 0.5
"""Deviation of a start without bounds in its coordinate [1]."""


def starting(problem: Problem, seed: int, first: int, count: int) -> NDArray[np.float64]:
    """Settings `first` to `first + count` of a seed's endless row, as coordinates (setting, parameter); setting 0 is the defaults."""
    start = problem.chosen.start()
    key, like = jax.random.key(seed), jnp.asarray(start, jnp.result_type(float))
    rows = [
        np.asarray(problem.chosen.drawn(jax.random.fold_in(key, k), like, SPREAD), float) if k else start
        for k in range(first, first + count)
    ]
    return np.stack(rows)
