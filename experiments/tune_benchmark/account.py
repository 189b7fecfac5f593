"""The account of one method: what it asks for is computed once, stored, and charged in forward episodes, never above its budget."""

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.case_store import Case, RunStore

from ..tune.problem import Problem
from .forward import Forward, true_scores
from .slopes import Slopes

SPARE = 1e-6
"""Rounding of sums of costs [forward episodes]."""


@dataclass
class Race:
    """What all methods share."""

    problem: Problem
    forward: Forward
    slopes: Slopes
    store: RunStore
    ratio: float
    """Forward episodes that the gradient of one counts as [1]."""
    advance: Callable[[float, float, str], None] = lambda cost, seconds, note: None
    """Told the cost and time of every batch, and whose it is."""

    @property
    def worlds(self) -> int:
        """Training worlds."""
        return len(self.problem.training)


@dataclass
class Account:
    """One method with one seed."""

    race: Race
    name: str
    """Unique in the run, such as "random-0"."""
    budget: float
    """[forward episodes]."""
    reserve: float = 0.0
    """Part of the budget that the search leaves for the choice at the end [forward episodes]."""
    spent: float = 0.0
    """[forward episodes]."""
    seconds: float = 0.0
    """Time of all batches, without compilation [s]."""
    batches: int = 0
    vectors: list[NDArray] = field(default_factory=list)
    """Every setting asked for, in order."""
    after: list[float] = field(default_factory=list)
    """Spent when it was known [forward episodes]."""
    losses: list[float] = field(default_factory=list)
    """Smooth loss of each, infinite where it is not finite."""
    scores: list[float] = field(default_factory=list)
    """True training score of each; NaN: not asked for."""

    def affordable(self, gradient: bool = False) -> int:
        """Settings that can still be evaluated in all training worlds."""
        left = self.budget - self.reserve - self.spent
        return max(int((left + SPARE) / self._price(gradient)), 0)

    def _price(self, gradient: bool) -> float:
        return self.race.worlds * (self.race.ratio if gradient else 1.0)

    def _charged(self, kind: str, vectors: NDArray, gradient: bool, make: Callable[[], dict[str, Any]]) -> Case:
        """A batch from the store, or computed and stored; its cost is added."""
        cost = len(vectors) * self._price(gradient)
        if len(vectors) > self.affordable(gradient):
            raise ValueError(f"{self.name}: {len(vectors)} settings cost more than is left of its budget")

        def work() -> dict[str, Any]:
            _ = (self.race.slopes if gradient else self.race.forward).compile_s  # compiled before the clock starts
            begin = time.monotonic()
            found = make()
            return {**found, "seconds": time.monotonic() - begin}

        mark = hashlib.sha256(np.ascontiguousarray(vectors).tobytes()).hexdigest()[:12]
        case, _ = self.race.store.take(f"{kind}/{self.name}-{self.batches:04d}-{mark}", work)
        self.batches += 1
        self.spent += cost
        self.seconds += float(case["seconds"])
        self.race.advance(cost, float(case["seconds"]), self.name)
        return case

    def _note(self, vectors: NDArray, losses: NDArray, scores: NDArray) -> None:
        self.vectors += list(np.array(vectors, float))
        self.after += [self.spent] * len(vectors)
        self.losses += list(np.where(np.isfinite(losses), losses, np.inf))
        self.scores += list(scores)

    def evaluate(self, vectors: NDArray) -> tuple[NDArray, NDArray]:
        """True training score and smooth loss (setting,); minus infinity and infinity where not finite."""
        race = self.race
        case = self._charged(
            "forward", vectors, False, lambda: dict(race.forward.measured(vectors, race.problem.training))
        )
        scores, losses = true_scores(case), np.asarray(case["loss"], float).mean(axis=1)
        losses = np.where(np.isfinite(losses), losses, np.inf)
        self._note(vectors, losses, scores)
        return scores, losses

    def gradients(self, vectors: NDArray) -> tuple[NDArray, NDArray]:
        """Smooth loss (setting,) and its gradient (setting, parameter), means over all training worlds; not finite where they are."""

        def make() -> dict[str, Any]:
            loss, gradient = self.race.slopes.call(vectors)
            return {"loss": loss, "gradient": gradient}

        case = self._charged("gradient", vectors, True, make)
        self._note(vectors, case["loss"], np.full(len(vectors), np.nan))
        return case["loss"], case["gradient"]
