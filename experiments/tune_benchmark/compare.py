"""Methods in the held-out worlds: means, and paired differences with intervals of the bootstrap.

A world is a cluster: a draw takes whole worlds, with all seeds of a method in it. The seeds of each method are drawn too, since
another run of it would have had others; a setting is the same in all worlds, so that seeds and worlds are crossed.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

DRAWS = 4000
"""Draws of the bootstrap."""
INSIDE = 0.95
"""Probability inside of an interval [1]."""
LOSS = 0.5
"""Points by which a method loses a world that is named."""
Scores = Mapping[str, NDArray]
"""Method -> (seed, world)."""


@dataclass(frozen=True)
class Difference:
    """Mean difference of two methods [points]."""

    mean: float
    low: float
    high: float

    @property
    def word(self) -> str:
        """What the interval says of the first method."""
        return "wins" if self.low > 0 else "loses" if self.high < 0 else "no difference shown"


def known(scores: NDArray) -> NDArray:
    """Scores, 0 where one is not finite: what did not run through has no score."""
    return np.where(np.isfinite(scores), scores, 0.0)


def difference(one: NDArray, other: NDArray, seed: int) -> Difference:
    """One less the other, (seed, world) each, the worlds being the same; low and high are NaN for fewer than two worlds."""
    one, other = known(one), known(other)
    mean = float(one.mean() - other.mean())
    worlds = one.shape[1]
    if worlds < 2:
        return Difference(mean, np.nan, np.nan)
    rng = np.random.default_rng(seed)
    picked = rng.integers(worlds, size=(DRAWS, worlds))

    def drawn(scores: NDArray) -> NDArray:
        seeds = len(scores)
        rows = rng.integers(seeds, size=(DRAWS, seeds)) if seeds > 1 else np.zeros((DRAWS, 1), int)
        shares = np.stack([(rows == k).mean(axis=1) for k in range(seeds)], axis=1)
        return np.take_along_axis(shares @ scores, picked, axis=1).mean(axis=1)

    low, high = np.quantile(drawn(one) - drawn(other), [(1 - INSIDE) / 2, (1 + INSIDE) / 2])
    return Difference(mean, float(low), float(high))


def ranked(scores: Scores) -> list[str]:
    """Methods by their mean held-out score, best first."""
    return sorted(scores, key=lambda name: -known(scores[name]).mean())


def mean(values: NDArray) -> float:
    """Of those that are finite; NaN if there is none."""
    finite = np.asarray(values, float)[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else np.nan


@dataclass(frozen=True)
class LostWorld:
    """A world in which one method is behind another."""

    world: str
    behind: float
    """[points]."""
    term: str
    """The part of the score that is behind most; "success" where the share of successful runs is lower."""
    by: float
    """Its lead at the other: of a term in its points out of 100, of success in runs [1]."""


def lost_worlds(
    one: Mapping[str, NDArray], other: Mapping[str, NDArray], worlds: list[str], score: str, terms: tuple[str, ...]
) -> list[LostWorld]:
    """Worlds in which one method is more than `LOSS` points behind another, mean over seeds, the worst first.

    Args:
        one, other: metrics (seed, world) by name.
    """
    behind = known(other[score]).mean(axis=0) - known(one[score]).mean(axis=0)
    found = []
    for k in np.argsort(-behind, kind="stable"):
        if behind[k] <= LOSS:
            break

        def lead(name: str, k: int = int(k)) -> float:
            return mean(other[name][:, k]) - mean(one[name][:, k])

        if "success" in one and lead("success") > 0:
            term, by = "success", lead("success")
        else:
            each = {name: lead(name) for name in terms if name in one and np.isfinite(lead(name))}
            term = max(each, key=each.__getitem__) if each else ""
            by = each.get(term, np.nan)
        found.append(LostWorld(worlds[k], float(behind[k]), term, by))
    return found
