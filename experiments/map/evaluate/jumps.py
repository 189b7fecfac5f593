"""The largest discontinuity of the distance along straight lines."""

import numpy as np

from hrcjax.map import FieldMap

from .answers import distance_and_slope
from .families import Case

LINES, LENGTH, STEP = 24, 0.3, 5e-4
"""Number of lines, length of each [m], and initial step [m]."""
SUSPECTS, HALVINGS = 64, 6
"""Steps that are refined, and how often they are halved: to 8 micrometres."""


def largest_jump(case: Case, state: FieldMap, seed: int) -> float:
    """Largest jump of the distance along random lines [m].

    The residual of a step is its change of distance less the mean of the slopes at its ends times its length. The steps with
    the largest residuals are halved, and the half with the larger residual is kept; a true jump does not shrink.
    """
    draw = np.random.default_rng(seed)
    count = round(LENGTH / STEP)
    begin = draw.uniform(case.lower, case.upper, (LINES, 3))
    way = draw.normal(size=(LINES, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    s = STEP * np.arange(count + 1)
    x = begin[:, None] + s[:, None] * way[:, None]
    d, g = distance_and_slope(state, x.reshape(-1, 3))
    d, slope = d.reshape(LINES, -1), np.sum(g.reshape(LINES, -1, 3) * way[:, None], axis=2)

    def leap(d0: np.ndarray, d1: np.ndarray, s0: np.ndarray, s1: np.ndarray, h: np.ndarray | float) -> np.ndarray:
        return np.abs(d1 - d0 - h * (s0 + s1) / 2)

    first = leap(d[:, :-1], d[:, 1:], slope[:, :-1], slope[:, 1:], STEP)
    line, index = np.unravel_index(np.argsort(-first, axis=None)[:SUSPECTS], first.shape)
    low, high = s[index], s[index + 1]
    left, right = (d[line, index], slope[line, index]), (d[line, index + 1], slope[line, index + 1])
    for _ in range(HALVINGS):
        half = (low + high) / 2
        d_half, g_half = distance_and_slope(state, begin[line] + half[:, None] * way[line])
        middle = (d_half, np.sum(g_half * way[line], axis=1))
        one = leap(left[0], middle[0], left[1], middle[1], half - low)
        two = leap(middle[0], right[0], middle[1], right[1], high - half)
        before = one >= two
        low, high = np.where(before, low, half), np.where(before, half, high)
        left, right = (
            tuple(np.where(before, a, b) for a, b in zip(left, middle, strict=True)),
            tuple(np.where(before, a, b) for a, b in zip(middle, right, strict=True)),
        )
    return float(np.max(leap(left[0], right[0], left[1], right[1], high - low)))
