"""Settings to start from: the defaults, and others drawn within the bounds."""

import numpy as np
from numpy.typing import NDArray

from ..tune.problem import Problem

SPREAD = 0.5
"""Deviation of a start without two bounds in its coordinate [1]."""


LEAST = 1e-9
"""Keeps coordinates finite [1]."""
EDGE = 0.02
"""Share of the range at either bound where no method by steps starts, as no loss feels a coordinate there [1]."""


def starting(problem: Problem, seed: int, first: int, count: int, edge: float = EDGE) -> NDArray[np.float64]:
    """Settings `first` to `first + count` of a seed's endless row, as coordinates (setting, parameter); setting 0 is the defaults.

    Others are uniform between two bounds, in the logarithm where both are positive, as the coordinate is the logit of that share
    (`hrcjax.tune.bounds`); without two bounds normal about the defaults.

    Args:
        edge: share of the range that is left out at either bound [1].
    """
    start = problem.chosen.start()
    two = np.array([np.isfinite([b.low, b.high]).all() for b in problem.chosen.bounds])
    rows = []
    for k in range(first, first + count):
        rng = np.random.default_rng((seed, k))
        u = np.clip(edge + (1 - 2 * edge) * rng.random(len(start)), LEAST, 1 - LEAST)
        far, near = np.log(u) - np.log1p(-u), start + SPREAD * rng.normal(size=len(start))
        rows.append(np.where(two, far, near) if k else start)
    return np.stack(rows)
