"""CMA-ES in the coordinates without bounds, from the defaults; again from a new start where it has converged."""

import numpy as np

from hrcjax.lab.errors import UsageError

from .account import Account
from .config import TuneBenchmarkConfig
from .starts import starting

try:
    from cmaes import CMA
except ImportError as missing:
    raise UsageError("CMA-ES needs cmaes: pip install 'hrcjax[tune]'") from missing

SIGMA = 1.0
"""Deviation of the first generation in every coordinate [1]."""
FAR = 30.0
"""Largest coordinate that is evaluated: bounds are reached to rounding [1]."""
WORST = 1e6
"""What the method is told where a value is not finite [1]."""


def cma_es(account: Account, config: TuneBenchmarkConfig, seed: int, smooth: bool = False) -> None:
    """Generations until the budget is used; the last one may be a part, which is not told.

    Args:
        smooth: minimises the smooth loss, instead of maximising the true score.
    """
    problem = account.race.problem
    if account.affordable():
        account.evaluate(starting(problem, seed, 0, 1))  # the defaults are a candidate of every method
    for k in range(account.affordable() + 1):
        population = config.population or None
        method = CMA(starting(problem, seed, k, 1)[0], SIGMA, seed=1000 * seed + k, population_size=population)
        while not method.should_stop():
            asked = np.stack([method.ask() for _ in range(method.population_size)])
            count = min(len(asked), account.affordable())
            if not count:
                return
            found = [
                account.evaluate(np.clip(asked[i : min(i + config.at_once, count)], -FAR, FAR))
                for i in range(0, count, config.at_once)
            ]
            if count < len(asked):
                return
            scores, losses = (np.concatenate(part) for part in zip(*found, strict=True))
            values = losses if smooth else -scores
            method.tell([(x, float(v) if np.isfinite(v) else WORST) for x, v in zip(asked, values, strict=True)])
