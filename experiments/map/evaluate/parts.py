"""Programs of a fixed batch size for any number of queries."""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np


def in_parts(program: Callable[[jax.Array], Sequence[jax.Array]], x: np.ndarray, size: int) -> list[np.ndarray]:
    """Results of a program for `size` rows of x (n, 3) at a time; the last batch is padded with its last row."""
    parts = []
    for begin in range(0, len(x), size):
        part = x[begin : begin + size]
        full = np.concatenate([part, np.repeat(part[-1:], size - len(part), axis=0)])
        parts.append([np.asarray(v)[: len(part)] for v in program(jnp.asarray(full, jnp.float32))])
    return [np.concatenate(v) for v in zip(*parts, strict=True)]
