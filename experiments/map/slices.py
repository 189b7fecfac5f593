"""Slices of a map's distance field on three planes."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.lab.parameters import numbers_of
from hrcjax.map import FieldMap, MapLayout, MapParams, distance_bound, labelled_points, map_distances_and_gradients
from hrcjax.viz import FieldSlice

CELLS, ARROWS = 110, 18
"""Cells and arrows along the longer edge of a slice."""
MARGIN = 0.3
"""Margin of a slice around the points [m]."""
BATCH = 1024
"""Queries evaluated together."""
PLANES = ((2, 0, 1), (1, 0, 2), (0, 1, 2))
"""Normal axis, axis to the right, axis up: one horizontal slice, two vertical ones."""


def middle_of(points: np.ndarray) -> np.ndarray:
    """Centre of the bounding box without the outermost 2 % of the points, (3,) [m]."""
    low, high = (np.quantile(points, q, axis=0) for q in (0.02, 0.98))
    return (low + high) / 2


def make_slices(
    layout: MapLayout, params: MapParams, state: FieldMap, at: Any = None, bound: bool = False
) -> list[FieldSlice]:
    """Slices of the distance, corrected for curvature, with arrows of its gradient.

    Args:
        at: common point of the three planes (3,) [m]; None: the centre of the points.
        bound: draw the lower bound instead, without arrows.
    """
    points, _ = labelled_points(state)
    box = points if len(points) else np.asarray([layout.lower], float)
    at = np.asarray(middle_of(box) if at is None else at, float)
    low, high = (np.quantile(box, q, axis=0) for q in (0.002, 0.998))
    low, high = np.minimum(low, at) - MARGIN, np.maximum(high, at) + MARGIN
    ratio, levels = numbers_of(params)["ratio"], state.levels
    read = jax.jit(lambda levels, x: map_distances_and_gradients(layout, levels, ratio, x, corrected=True))
    least = jax.jit(lambda state, x: jax.vmap(lambda p: distance_bound(layout, state, ratio, p))(x))

    def distances(places: np.ndarray) -> np.ndarray:
        return _in_parts(lambda x: least(state, x) if bound else read(levels, x)[0], places, state)

    def gradients(places: np.ndarray) -> np.ndarray:
        return _in_parts(lambda x: read(levels, x)[1], places, state)

    planes = []
    for across, right, up in PLANES:
        size = max(high[right] - low[right], high[up] - low[up])

        def grid(step: float, across: int = across, right: int = right, up: int = up) -> tuple[Any, Any, np.ndarray]:
            a, b = (low[k] + (np.arange(max(2, round((high[k] - low[k]) / step))) + 0.5) * step for k in (right, up))
            places = np.empty((len(a), len(b), 3))
            places[..., across], places[..., right], places[..., up] = at[across], a[:, None], b
            return a, b, places

        a, b, places = grid(size / CELLS)
        distance = distances(places.reshape(-1, 3)).reshape(len(a), len(b))
        arrows = None
        if not bound:
            _, _, few = grid(size / ARROWS)
            few = few.reshape(-1, 3)
            arrows = np.column_stack([few[:, [right, up]], gradients(few)[:, [right, up]]])
        near = points[np.abs(points[:, across] - at[across]) < layout.spacing / 2]
        planes.append(
            FieldSlice(
                float(at[across]), a, b, distance, arrows, near[:, [right, up]]
            )
        )  # fmt: skip
    return planes


def _in_parts(function: Callable[[Any], Any], places: np.ndarray, state: FieldMap) -> np.ndarray:
    """The function at many points (n, 3), in batches of one size, so that it is compiled once."""
    padded = np.concatenate([places, np.repeat(places[-1:], -len(places) % BATCH, axis=0)])
    dtype = state.information.dtype
    parts = [np.asarray(function(jnp.asarray(part, dtype))) for part in padded.reshape(-1, BATCH, 3)]
    return np.concatenate(parts)[: len(places)]
