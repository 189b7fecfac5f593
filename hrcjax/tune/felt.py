"""Before a tuning: which parameters the loss feels at all, and which pairs it cannot tell apart."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

STEP = 0.05
"""Step of the coordinates for differences of gradients [1]."""
LEAST_FELT = 1e-5
"""Derivative by a coordinate, as a share of the loss, below which a parameter is not felt [1]."""
ALIKE = 0.99
"""|cosine| of two parameters' columns of the second derivative above which they are not told apart [1]."""

GradientsFn = Callable[[NDArray], tuple[NDArray, NDArray]]
"""Losses (point) and gradients (point, parameter) at points (point, parameter)."""


class Felt:
    """What the loss feels at one point.

    Attributes:
        loss: there.
        gradient: by the coordinates (parameter).
        curvature: second derivative by central differences of gradients, symmetric (parameter, parameter).
    """

    def __init__(self, loss: float, gradient: NDArray, curvature: NDArray) -> None:
        self.loss, self.gradient, self.curvature = loss, gradient, curvature

    @property
    def share(self) -> NDArray:
        """|derivative| by each coordinate over the loss [1]."""
        return np.abs(self.gradient) / max(abs(self.loss), np.finfo(float).tiny)

    @property
    def felt(self) -> NDArray:
        """Whether each parameter is felt, by the slope or by a slope one step away."""
        near = np.abs(self.curvature).max(axis=1) * STEP / max(abs(self.loss), np.finfo(float).tiny)
        return np.maximum(self.share, near) >= LEAST_FELT

    def cosines(self) -> NDArray:
        """Between the columns of the curvature (parameter, parameter): 1 or -1 where two parameters change the gradient
        alike, so that one can undo the other; 0 where a column is 0."""
        length = np.linalg.norm(self.curvature, axis=0)
        unit = np.divide(self.curvature, length, out=np.zeros_like(self.curvature), where=length > 0)
        return unit.T @ unit

    def alike(self) -> list[tuple[int, int, float]]:
        """Pairs of felt parameters that are not told apart, with their cosine."""
        cosines, felt = self.cosines(), self.felt
        pairs = zip(*np.triu_indices(len(felt), 1), strict=True)
        return [(int(i), int(k), float(cosines[i, k])) for i, k in pairs if felt[i] and felt[k] and abs(cosines[i, k]) > ALIKE]  # fmt: skip


def feel(gradients: GradientsFn, point: NDArray, at_once: int = 1) -> Felt:
    """Loss, gradient and curvature at a point.

    Args:
        at_once: points in one call; the last call is filled up with the point itself.
    """
    size = len(point)
    points = np.concatenate([point[None], *(point + sign * STEP * np.eye(size) for sign in (1, -1))])
    filled = np.concatenate([points, np.repeat(point[None], -len(points) % at_once, axis=0)])
    parts = [gradients(filled[first : first + at_once]) for first in range(0, len(filled), at_once)]
    loss = np.concatenate([np.asarray(part[0], float) for part in parts])
    slope = np.concatenate([np.asarray(part[1], float) for part in parts])
    curvature = (slope[1 : 1 + size] - slope[1 + size : 1 + 2 * size]) / (2 * STEP)
    both = np.stack([curvature, curvature.T])  # the same but for rounding; one alone where the other is not finite
    known = np.isfinite(both)
    mean = np.where(known, both, 0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return Felt(float(loss[0]), slope[0], mean)
