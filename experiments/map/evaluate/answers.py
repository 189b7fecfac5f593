"""Results of a map at many query points: one compiled program each."""

from functools import cache
from typing import NamedTuple

import jax
import numpy as np

from hrcjax.map import FieldMap, Level, distance_bound, map_distance, map_distance_and_gradient

from .parts import in_parts
from .survey import LAYOUT, PARAMS

BATCH = 64
PART = 1024
"""Queries of one call: one size, one compilation."""


class Answers(NamedTuple):
    """Results of a map at query points (query,)."""

    distance: np.ndarray
    """Distance, corrected for curvature [m]."""
    gradient: np.ndarray
    """Its gradient, next to surfaces their normal (query, 3) [1]."""
    plain: np.ndarray
    """Uncorrected distance [m]."""
    plain_gradient: np.ndarray
    """Its gradient (query, 3) [1]."""
    bound: np.ndarray
    """95 % lower bound of the distance [m]."""


@cache
def _ask():
    def ask(state: FieldMap, x: jax.Array) -> tuple[jax.Array, ...]:
        def one(x: jax.Array) -> tuple[jax.Array, ...]:
            d, g = map_distance_and_gradient(LAYOUT, state.levels, PARAMS.ratio, x)
            plain = map_distance_and_gradient(LAYOUT, state.levels, PARAMS.ratio, x, corrected=False)
            return d, g, *plain, distance_bound(LAYOUT, state, PARAMS.ratio, x)

        return jax.lax.map(one, x, batch_size=BATCH)

    return jax.jit(ask)


@cache
def _slope():
    def slope(levels: tuple[Level, ...], x: jax.Array) -> tuple[jax.Array, jax.Array]:
        return jax.lax.map(
            jax.value_and_grad(lambda x: map_distance(LAYOUT, levels, PARAMS.ratio, x)), x, batch_size=BATCH
        )

    return jax.jit(slope)


def ask(state: FieldMap, x: np.ndarray) -> Answers:
    """All results at x (query, 3) [m]."""
    return Answers(*in_parts(lambda x: _ask()(state, x), x, PART))


def distance_and_slope(state: FieldMap, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The corrected distance [m] and its derivative [1] at x (query, 3) [m]."""
    d, g = in_parts(lambda x: _slope()(state.levels, x), x, PART)
    return d, g
