"""Shares and medians with 95 % intervals."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

DRAWS = 2000
"""Resamples of the bootstrap."""
Z = 1.959964
"""97.5 % quantile of the normal distribution."""


class Estimate(NamedTuple):
    """A value with its interval; NaN without data."""

    value: float
    low: float
    high: float
    scenes: int


def share(kept: NDArray) -> Estimate:
    """Share of true values, with Wilson's interval."""
    n = len(kept)
    if not n:
        return Estimate(np.nan, np.nan, np.nan, 0)
    p, z = float(np.mean(kept)), Z
    middle, half = p + z * z / (2 * n), z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return Estimate(p, float((middle - half) / (1 + z * z / n)), float((middle + half) / (1 + z * z / n)), n)


def median(x: NDArray) -> Estimate:
    """Median, with the percentile interval of the bootstrap over scenes; values may be infinite."""
    n = len(x)
    if not n:
        return Estimate(np.nan, np.nan, np.nan, 0)
    ordered = np.sort(x)

    def middle(rows: NDArray) -> NDArray:
        return (rows[:, (n - 1) // 2] + rows[:, n // 2]) / 2

    drawn = np.sort(ordered[np.random.default_rng(0).integers(0, n, (DRAWS, n))], axis=1)
    found = np.sort(middle(drawn))
    return Estimate(float(middle(ordered[None])[0]), float(found[int(0.025 * DRAWS)]), float(found[int(0.975 * DRAWS) - 1]), n)  # fmt: skip
