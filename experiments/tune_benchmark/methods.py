"""Runs one method with all its seeds side by side, from its budget to its choices; finished ones are read from the store."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from .account import Account, Race
from .choice import choose, scored_way
from .cma_es import cma_es
from .config import BY_GRADIENT, SMOOTH, TuneBenchmarkConfig
from .gradient import gradient
from .grid_sweep import grid_sweep
from .lockstep import Ask, in_lockstep
from .quasi_newton import quasi_newton
from .random_search import random_search

Search = Callable[[Account, TuneBenchmarkConfig, int], None]
SEARCHES: dict[str, Search] = {
    "gradient": gradient,
    "quasi_newton": quasi_newton,
    "random": random_search,
    "random_smooth": random_search,
    "cma_es": cma_es,
    "cma_smooth": partial(cma_es, smooth=True),
}
ONE_SEED = ("defaults", "sweep")
"""Methods without chance."""


@dataclass(frozen=True)
class Entry:
    """What a method ended with."""

    vector: NDArray
    """Coordinates of its choice."""
    score: float
    """True training score."""
    spent: float
    """[forward episodes]."""
    seconds: float
    """Time of its batches, without compilation [s]."""
    settings: int
    """Settings evaluated, by gradient or forward."""
    not_finite: int
    """Of them with a loss that is not finite."""
    way: NDArray
    """(2, point): forward episodes spent, best true training score so far."""


def by_loss(method: str) -> bool:
    """Whether a method sees the smooth loss alone."""
    return method in BY_GRADIENT or method in SMOOTH.values()


def seeds_of(config: TuneBenchmarkConfig, method: str) -> tuple[int, ...]:
    """The seeds that a method runs with."""
    return config.seeds_of_methods[:1] if method in ONE_SEED else config.seeds_of_methods


def played(race: Race, config: TuneBenchmarkConfig, method: str, budget: float, grid: NDArray) -> list[Entry]:
    """A method with each of its seeds, side by side: they share the calls of the programs.

    Args:
        budget: of each seed [forward episodes].
        grid: settings of the sweep.
    """
    seeds, entries = seeds_of(config, method), {}

    def work(seed: int) -> Callable[[Ask], None]:
        def play(ask: Ask) -> None:
            entries[seed] = _one(race, ask, config, method, seed, budget, grid)

        return play

    in_lockstep([work(seed) for seed in seeds], race.answer)
    return [entries[seed] for seed in seeds]


def _one(
    race: Race, ask: Ask, config: TuneBenchmarkConfig, method: str, seed: int, budget: float, grid: NDArray
) -> Entry:
    name, start = f"{method}-{seed}", race.problem.chosen.start()
    done = race.store.get(f"done/{name}")
    if done is None:
        account = Account(race, name, budget, ask)
        if method in BY_GRADIENT:
            account.reserve = float(min(config.choices * race.worlds, budget))
        if method == "defaults":
            account.evaluate(start[None])
        elif method == "sweep":
            grid_sweep(account, config, grid)
        else:
            SEARCHES[method](account, config, seed)
        searched = len(account.vectors)
        vector, score = choose(account, start, config.choices, by_loss(method))
        way = np.stack(scored_way(account, searched, score))
        way[0] = 0.0 if method == "defaults" else way[0]
        lost = int(np.sum(~np.isfinite(account.losses)))
        spent = 0.0 if method == "defaults" else account.spent
        numbers = np.array([score, spent, account.seconds, len(account.vectors), lost], float)
        done = race.store.put(f"done/{name}", {"vector": vector, "numbers": numbers, "way": way})
    else:
        race.advance(float(done["numbers"][1]), float(done["numbers"][2]), name)
    score, spent, seconds, settings, lost = map(float, done["numbers"])
    return Entry(done["vector"], score, spent, seconds, int(settings), int(lost), done["way"])
