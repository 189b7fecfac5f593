"""Sobol indices of a function on a full grid, exactly: its variance, split by means over the other axes.

The inputs are independent and uniform on the points of the grid (Sobol 1993; total index: Homma and Saltelli 1996). Points that
do not count are filled in by the sum of main effects that fits the others best, so that a pattern of gaps does not make one
input look like another; the total indices are then too small rather than too large. Values of an input of which no point
counts are left out.
"""

import numpy as np

ROUNDS = 1000
"""Largest number of rounds of the fit; some tens are usual."""
SETTLED = 1e-8
"""Change of the fit in a round, relative to the spread of the values, at which it ends [1]."""


def sobol_indices(
    values: np.ndarray, good: np.ndarray | None = None, negligible: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """First-order and total index of every axis [1]; 0 where nothing changes.

    Args:
        values: on the grid, one axis per input.
        good: which points count; None: all.
        negligible: range of the values, relative to the largest, up to which nothing changes.

    Raises:
        ValueError: no point counts.
    """
    good = np.ones(values.shape, bool) if good is None else good
    if not good.any():
        raise ValueError("no point of the grid counts")
    counted = values[good]
    first, total = np.zeros(values.ndim), np.zeros(values.ndim)
    if np.ptp(counted) <= negligible * np.abs(counted).max() or np.ptp(counted) == 0:
        return first, total
    axes = range(values.ndim)
    for axis in axes:
        kept = np.flatnonzero(good.any(axis=tuple(k for k in axes if k != axis)))
        values, good = values.take(kept, axis), good.take(kept, axis)
    whole = values if good.all() else np.where(good, values, main_effects(values, good))
    variance = float(np.var(whole))
    for axis in axes:
        others = tuple(k for k in axes if k != axis)
        first[axis] = np.var(whole.mean(axis=others)) / variance  # V(E[Y | x_i]) / V(Y)
        total[axis] = np.mean(np.var(whole, axis=axis)) / variance  # E[V(Y | x_~i)] / V(Y)
    return first, total


def main_effects(values: np.ndarray, good: np.ndarray) -> np.ndarray:
    """The sum of one function per axis that fits the good points best, on the whole grid; by fitting one axis after the other.

    Args:
        values: on the grid.
        good: which points count; some at each value of each axis.
    """
    known = np.where(good, values, 0.0)
    fit = np.full(values.shape, values[good].mean())
    enough = SETTLED * np.ptp(values[good])
    for _ in range(ROUNDS):
        most = 0.0
        for axis in range(values.ndim):
            others = tuple(k for k in range(values.ndim) if k != axis)
            misfit = np.where(good, known - fit, 0.0).sum(axis=others, keepdims=True)
            step = misfit / good.sum(axis=others, keepdims=True)
            fit = fit + step
            most = max(most, float(np.abs(step).max()))
        if most < enough:
            break
    return fit
