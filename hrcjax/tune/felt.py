"""Before a tuning: which parameters the loss feels at all, and which pairs it cannot tell apart.

Two parameters are not told apart where one undoes the other: every term of the loss in every world answers to both in the same ratio
(their columns of the Jacobian of all terms in all worlds are parallel, its Gauss-Newton matrix is singular), and the mean loss has no
curvature along the direction in which the answers cancel. Each alone occurs by chance: columns of a mean Hessian of few parameters may
be parallel, and so are slopes in worlds that are much alike.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

STEP = 0.05
"""Step of the coordinates for differences [1]."""
LEAST_FELT = 1e-5
"""Derivative by a coordinate, as a share of the loss, below which a parameter is not felt [1]."""
ALIKE = 0.99
"""|cosine| of two parameters' columns above which they are not told apart [1]."""
LEAST_ROWS = 3
"""Rows that two columns must have for that: shorter ones are parallel by chance."""
FLAT = 0.05
"""Curvature along the direction in which two parameters cancel, as a share of what their entries could add up to, that is none [1]."""
COUNTS = 1e-3
"""Share of the largest entry of a column from which on a row counts [1]."""
SMOOTH = 0.2
"""Largest difference of a derivative by values from one by gradients, as a share of the larger, without a jump between [1]."""

GradientsFn = Callable[[NDArray], tuple[NDArray, NDArray, NDArray]]
"""Losses (point), gradients (point, parameter) and terms in each world (point, world, term) at points (point, parameter)."""


class Felt:
    """What the loss feels at one point.

    Attributes:
        loss: there.
        gradient: by the coordinates (parameter).
        curvature: second derivative by central differences of gradients, symmetric (parameter, parameter).
        rows: derivatives of every term in every world by central differences of their values, times weight, over the loss
            (row, parameter).
        jumps: whether the loss jumps within a step of each coordinate, so that its column of `rows` is none (parameter).
    """

    def __init__(self, loss: float, gradient: NDArray, curvature: NDArray, rows: NDArray, jumps: NDArray) -> None:
        self.loss, self.gradient, self.curvature, self.rows, self.jumps = loss, gradient, curvature, rows, jumps

    @property
    def share(self) -> NDArray:
        """|derivative| by each coordinate over the loss [1]."""
        return np.abs(self.gradient) / _size(self.loss)

    @property
    def felt(self) -> NDArray:
        """Whether each parameter is felt, by the slope, by a slope one step away, or by a term in one world."""
        near = np.abs(self.curvature).max(axis=1) * STEP / _size(self.loss)
        alone = np.abs(self.rows).max(axis=0, initial=0)
        known = np.isfinite(self.gradient)
        return known & (np.fmax(np.fmax(self.share, near), alone) >= LEAST_FELT)

    def cosines(self) -> NDArray:
        """Between the columns of `rows` (parameter, parameter): 1 or -1 where one parameter can undo the other; 0 where a
        column is 0, NaN where there are too few rows or a jump."""
        rows = self.rows[np.isfinite(self.rows).any(axis=1)]  # of worlds in which the terms are finite
        strange = self.jumps | ~np.isfinite(rows).all(axis=0)
        known = np.where(strange, 0, rows)
        length = np.linalg.norm(known, axis=0)
        unit = np.divide(known, length, out=np.zeros_like(known), where=length > 0)
        large = np.abs(known) >= COUNTS * np.maximum(np.abs(known).max(axis=0, initial=0), np.finfo(float).tiny)
        either = (large[:, :, None] | large[:, None, :]).sum(axis=0)
        few = (either < LEAST_ROWS) & (length > 0) & (length[:, None] > 0)
        return np.where(few | strange | strange[:, None], np.nan, unit.T @ unit)

    def _pairs(self) -> list[tuple[int, int]]:
        felt = self.felt
        return [(i, k) for i in range(len(felt)) for k in range(i + 1, len(felt)) if felt[i] and felt[k]]

    def alike(self) -> list[tuple[int, int, float]]:
        """Pairs of felt parameters that are not told apart, with their cosine."""
        cosines = self.cosines()
        near = [(i, k, float(cosines[i, k])) for i, k in self._pairs() if abs(cosines[i, k]) > ALIKE]
        return [(i, k, cosine) for i, k, cosine in near if self._flat([i, k], np.sign(cosine))]

    def _flat(self, pair: list[int], sign: float) -> bool:
        """Whether the loss has no curvature where two parameters cancel; `sign` is that of their cosine."""
        lengths = np.sqrt(np.nansum(self.rows[:, pair] ** 2, axis=0))
        way = np.array([lengths[1], -sign * lengths[0]]) / np.hypot(*lengths)
        parts = self.curvature[np.ix_(pair, pair)] * np.outer(way, way)
        return bool(abs(parts.sum()) <= max(FLAT * np.abs(parts).sum(), LEAST_FELT / STEP * _size(self.loss)))

    def unknown(self) -> list[tuple[int, int]]:
        """Pairs of felt parameters, without jumps, of which too few rows are not 0 to tell."""
        cosines = self.cosines()
        return [(i, k) for i, k in self._pairs() if np.isnan(cosines[i, k]) and not (self.jumps[i] or self.jumps[k])]


def _size(loss: float) -> float:
    return max(abs(loss), float(np.finfo(float).tiny))


def feel(gradients: GradientsFn, point: NDArray, weights: Sequence[float], at_once: int = 1) -> Felt:
    """Loss, gradient, curvature, and the answers of all terms in all worlds at a point.

    Args:
        weights: of each term [1/unit].
        at_once: points in one call; the last call is filled up with the point itself.
    """
    size = len(point)
    points = np.concatenate([point[None], *(point + sign * STEP * np.eye(size) for sign in (1, -1))])
    filled = np.concatenate([points, np.repeat(point[None], -len(points) % at_once, axis=0)])
    parts = [gradients(filled[first : first + at_once]) for first in range(0, len(filled), at_once)]
    loss, slope, each = (np.concatenate([np.asarray(part[k], float) for part in parts]) for k in range(3))
    up, down = slice(1, 1 + size), slice(1 + size, 1 + 2 * size)
    curvature = (slope[up] - slope[down]) / (2 * STEP)
    both = np.stack([curvature, curvature.T])  # the same but for rounding; one alone where the other is not finite
    known = np.isfinite(both)
    mean = np.where(known, both, 0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    mean = np.where(known.any(axis=0), mean, np.nan)
    answers = np.asarray(weights, float) * (each[up] - each[down]) / (2 * STEP) / _size(loss[0])
    own = np.arange(size)
    by_slopes = (slope[up][own, own] + 4 * slope[0] + slope[down][own, own]) / 6
    jumps = _differ((loss[up] - loss[down]) / (2 * STEP), by_slopes, LEAST_FELT / STEP * _size(loss[0]))
    return Felt(float(loss[0]), slope[0], mean, answers.reshape(size, -1).T, jumps)


def _differ(by_values: NDArray, by_slopes: NDArray, rounding: float) -> NDArray:
    """Whether two derivatives differ by more than a smooth function's would; not where one is not finite."""
    larger = np.maximum(np.abs(by_values), np.abs(by_slopes))
    return np.abs(by_values - by_slopes) > SMOOTH * larger + rounding
