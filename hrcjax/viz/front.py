"""The Pareto front of settings: those that no other one beats, by sorting."""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

BLOCK = 512
"""Rows that are compared with as many others at a time."""


def pareto_mask(values: Float[np.ndarray, "n k"], better: Sequence[str]) -> Bool[np.ndarray, "n"]:
    """True for each row that no other row dominates (at least as good in every column and better in one).

    Equal rows do not dominate each other. Rows with a value that is not finite are never on the front.

    Args:
        better: "low" or "high" for each column.

    Raises:
        ValueError: `better` does not match the columns.
    """
    if len(better) != values.shape[1] or any(side not in ("low", "high") for side in better):
        raise ValueError(f"better is {list(better)!r}; accepted: 'low' or 'high' for each of {values.shape[1]} columns")
    cost = np.asarray(values, float) * np.array([1.0 if side == "low" else -1.0 for side in better])
    usable = np.flatnonzero(np.isfinite(cost).all(axis=1))
    front = np.zeros(len(cost), bool)
    if usable.size and cost.shape[1]:
        rows, which = np.unique(cost[usable], axis=0, return_inverse=True)  # by the first column, then the second, ...
        find = {1: _front_of_one, 2: _front_of_two, 3: _front_of_three}.get(rows.shape[1], _front_by_blocks)
        kept = find(rows)
        front[usable] = kept[which.reshape(-1)]
    else:
        front[usable] = True
    return front


def _front_of_one(rows: Float[np.ndarray, "n 1"]) -> Bool[np.ndarray, "n"]:
    """The least of different rows in order."""
    return np.arange(len(rows)) == 0


def _front_of_two(rows: Float[np.ndarray, "n 2"]) -> Bool[np.ndarray, "n"]:
    """The front of different rows in order: those whose second value is below all before."""
    return np.asarray(rows[:, 1] < np.concatenate([[np.inf], np.minimum.accumulate(rows[:, 1])[:-1]]))


def _front_of_three(rows: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, "n"]:
    """The front of different rows in order: those above no step of the stairs that the rows before make in the last two columns.

    The stairs are the front of these two columns: places ascend, heights descend (Kung, Luccio and Preparata 1975).
    """
    found = np.zeros(len(rows), bool)
    places, heights = [-np.inf], [np.inf]
    for n, (place, height) in enumerate(rows[:, 1:].tolist()):
        step = bisect_right(places, place)
        if heights[step - 1] <= height:
            continue
        found[n] = True
        step = bisect_left(places, place)
        end = step
        while end < len(heights) and heights[end] >= height:
            end += 1
        places[step:end], heights[step:end] = [place], [height]
    return found


def _front_by_blocks(rows: Float[np.ndarray, "n k"]) -> Bool[np.ndarray, "n"]:
    """The front of different rows in order. A row that beats another precedes it, so that those found before suffice.

    A block is compared with the front so far and then within itself, `BLOCK` x `BLOCK` numbers at a time. The front is read
    from its rows with the least sum on: they beat most.
    """
    found = np.zeros(len(rows), bool)
    front = np.empty((0, rows.shape[1] - 1))
    for begin in range(0, len(rows), BLOCK):
        block = rows[begin : begin + BLOCK, 1:]  # the first column is not lower than that of any row before
        left = np.arange(len(block))
        for start in range(0, len(front), BLOCK):
            if left.size:
                left = left[~_beaten(block[left], front[start : start + BLOCK])]
        inside = block[left]
        earlier = np.tri(len(left), k=-1, dtype=bool)
        left = left[~_beaten(inside, inside, earlier)]
        found[begin + left] = True
        front = np.concatenate([front, block[left]])
        front = front[np.argsort(front.sum(axis=1), kind="stable")]
    return found


def _beaten(
    rows: Float[np.ndarray, "n k"], others: Float[np.ndarray, "m k"], counted: Bool[np.ndarray, "n m"] | None = None
) -> Bool[np.ndarray, "n"]:
    """True for each row that is not lower in any column than one of the others.

    Args:
        counted: pairs that count; None: all.
    """
    worse = np.ones((len(rows), len(others)), bool) if counted is None else counted.copy()
    for column in range(rows.shape[1]):
        worse &= rows[:, column, None] >= others[None, :, column]
    return np.asarray(worse.any(axis=1))
