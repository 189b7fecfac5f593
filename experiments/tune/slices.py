"""Slices of loss and score through the tuned parameters: along each coordinate alone, and over the two that matter most."""

from dataclasses import dataclass, fields

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.field_docs import leaf_docs
from hrcjax.lab.table import aligned
from hrcjax.tune import Chosen

from .judge import Judge
from .problem import Problem

POINTS = 11
"""Points of a slice, the tuned one in the middle."""
SIDE = 9
"""Points along a side of the map, the tuned one in the middle."""
REACH = 2.0
"""Least way of a slice to either side of the tuned point, in the coordinate [1]."""
PAST = 1.25
"""A slice goes this far past the start, if that is farther [1]."""
SCORE = "score_sound"
"""The exact metric that is shown beside the loss."""


@dataclass(frozen=True)
class Slices:
    """Means over the training worlds; NaN where one is not finite, or nothing is known."""

    start: NDArray
    """Values before tuning (parameter) [unit of the parameter]."""
    values: NDArray
    """Values of each parameter along its slice (parameter, point) [unit of the parameter]."""
    loss: NDArray
    """(parameter, point) [1]."""
    score: NDArray
    """(parameter, point) [1]."""
    pair: NDArray
    """The two parameters over whose slices the loss changes most; one parameter: itself twice."""
    sides: NDArray
    """Values of these two along the sides of the map (2, point)."""
    map_loss: NDArray
    """(point of the first, point of the second) [1]; without points for one parameter."""
    map_score: NDArray
    """The same [1]."""


def reaches(first: NDArray, tuned: NDArray) -> NDArray:
    """How far the slices go to either side, in each coordinate: past the start [1]."""
    return np.maximum(REACH, PAST * np.abs(first - tuned))


def lines(tuned: NDArray, reach: NDArray) -> NDArray:
    """Points along each coordinate alone (parameter, point, coordinate)."""
    steps = np.linspace(-1, 1, POINTS)
    return tuned + steps[:, None] * (np.eye(len(tuned)) * reach)[:, None]


def square(tuned: NDArray, reach: NDArray, pair: NDArray) -> NDArray:
    """Points over two coordinates (point of the first, point of the second, coordinate)."""
    steps = np.linspace(-1, 1, SIDE)
    points = np.tile(tuned.astype(float), (SIDE, SIDE, 1))
    points[..., pair[0]] += reach[pair[0]] * steps[:, None]
    points[..., pair[1]] += reach[pair[1]] * steps
    return points


def most_felt(loss: NDArray) -> NDArray:
    """The two slices over which the loss changes most, the most first; a slice without two finite values changes by 0."""
    low, high = np.where(np.isfinite(loss), loss, np.inf).min(1), np.where(np.isfinite(loss), loss, -np.inf).max(1)
    order = np.argsort(-np.where(high >= low, high - low, 0.0), kind="stable")
    return order[[0, min(1, len(order) - 1)]]


def make_slices(judge: Judge, first: NDArray, tuned: NDArray) -> Slices:
    """The slices through tuned coordinates, measured and stored as every setting is.

    Args:
        first: coordinates of the start.
    """
    chosen, reach = judge.problem.chosen, reaches(first, tuned)

    def means(points: NDArray, what: str) -> tuple[NDArray, NDArray]:
        found = judge.measured(points.reshape(-1, len(tuned)).astype(first.dtype), judge.problem.training, what)
        loss = found["loss"].mean(axis=1)
        score = found[SCORE].mean(axis=1) if SCORE in found else np.full_like(loss, np.nan)
        return loss.reshape(points.shape[:-1]), score.reshape(points.shape[:-1])

    along = lines(tuned, reach)
    loss, score = means(along, "slice episode")
    pair = most_felt(loss)
    over = square(tuned, reach, pair)
    nothing = np.full((0, 0), np.nan)
    map_loss, map_score = means(over, "map episode") if len(tuned) > 1 else (nothing, nothing)
    values = np.stack([_values(chosen, along[k])[:, k] for k in range(len(tuned))])
    sides = np.stack([_values(chosen, over[:, 0])[:, pair[0]], _values(chosen, over[0])[:, pair[1]]])
    made = Slices(_values(chosen, first[None])[0], values, loss, score, pair, sides, map_loss, map_score)
    judge.store.put("slices", {field.name: getattr(made, field.name) for field in fields(made)})
    return made


def parameter_units(problem: Problem) -> list[str]:
    """The unit of each tuned parameter; "1" if its documentation has none."""
    docs = leaf_docs(problem.base)
    return [docs.get(name, ("", "1"))[1] for name in problem.chosen.names]


def slices_text(slices: Slices, problem: Problem) -> str:
    """A line each parameter: where its slice is least, against the tuned point."""
    rows = [["slice", "unit", "tuned", "loss", "least at", "loss", "largest loss"]]
    of = zip(problem.chosen.names, parameter_units(problem), slices.values, slices.loss, strict=True)
    for name, unit, x, loss in of:
        known = np.isfinite(loss)
        if not known.any():
            continue
        k = int(np.argmin(np.where(known, loss, np.inf)))
        numbers = (x[POINTS // 2], loss[POINTS // 2], x[k], loss[k], loss[known].max())
        rows.append([name, unit, *(f"{value:.4g}" for value in numbers)])
    return "Loss along each parameter alone, mean over the training worlds:\n" + aligned(rows, "<<>>>>>")


def _values(chosen: Chosen, points: NDArray) -> NDArray:
    return np.stack([np.asarray(chosen.values(jnp.asarray(p, jnp.result_type(float)))) for p in points])
