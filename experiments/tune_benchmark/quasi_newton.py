"""L-BFGS-B of SciPy on the smooth loss, several starts side by side; where one has converged, it goes on from a new start."""

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from .account import Account
from .config import TuneBenchmarkConfig
from .lockstep import Ask, in_lockstep
from .starts import starting

Answer = tuple[float, NDArray]
"""Value and gradient."""
REACH = 6.0
"""Largest coordinate where there are two bounds: 0.25 % of the range is left; beyond, no loss feels the coordinate [1]."""


class _NotFinite(Exception):
    """An answer that no line search can use."""


def quasi_newton(account: Account, config: TuneBenchmarkConfig, seed: int) -> None:
    """Runs until the budget is used; a run that meets a value which is not finite ends there."""
    problem = account.race.problem
    both = [np.isfinite([b.low, b.high]).all() for b in problem.chosen.bounds]
    box = [(-REACH, REACH) if two else (None, None) for two in both]

    def runs(k: int):
        def work(ask: Ask) -> None:
            def finite(x: NDArray) -> Answer:
                value, slope = ask(np.array(x, float))
                if not (np.isfinite(value) and np.isfinite(slope).all()):
                    raise _NotFinite
                return value, slope

            for place in itertools.count(
                k, config.starts
            ):  # each run has starts of its own: no order decides who gets which
                first = starting(problem, seed, place, 1)[0]
                try:
                    minimize(finite, first, jac=True, method="L-BFGS-B", bounds=box)
                except _NotFinite:
                    continue

        return work

    def answer(points: list[NDArray]) -> list[Answer]:
        count = min(len(points), account.affordable(gradient=True))
        if not count:
            return []
        values, slopes = account.gradients(np.stack(points[:count]))
        return [(float(value), slope) for value, slope in zip(values, slopes, strict=True)]

    in_lockstep([runs(k) for k in range(config.starts)], answer)
