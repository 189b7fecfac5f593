"""The account of one method: what it asks for is computed once, stored, and charged in forward episodes, never above its budget."""

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
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


@dataclass(frozen=True)
class Question:
    """What is asked of all training worlds."""

    vectors: NDArray
    gradient: bool = False
    """Loss and gradient, or every metric."""


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

    def answer(self, questions: Sequence[Question]) -> list[dict[str, Any]]:
        """Arrays of every question, and its share of the time of their common calls as "seconds" [s]."""
        found: list[dict[str, Any]] = [{}] * len(questions)
        for gradient in (False, True):
            places = [k for k, question in enumerate(questions) if question.gradient == gradient]
            if not places:
                continue
            vectors = np.concatenate([questions[k].vectors for k in places])
            _ = (self.slopes if gradient else self.forward).compile_s  # compiled before the clock starts
            begin = time.monotonic()
            if gradient:
                loss, slope = self.slopes.call(vectors)
                arrays: Mapping[str, NDArray] = {"loss": loss, "gradient": slope}
            else:
                arrays = self.forward.measured(vectors, self.problem.training)
            each_s, first = (time.monotonic() - begin) / len(vectors), 0
            for k in places:
                end = first + len(questions[k].vectors)
                found[k] = {name: value[first:end] for name, value in arrays.items()}
                found[k]["seconds"] = each_s * (end - first)
                first = end
        return found


@dataclass
class Account:
    """One method with one seed."""

    race: Race
    name: str
    """Unique in the run, such as "random-0"."""
    budget: float
    """[forward episodes]."""
    ask: Callable[[Question], dict[str, Any]] | None = None
    """Answers together with the questions of other accounts; None: at once."""
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

    def asked(self, question: Question) -> dict[str, Any]:
        """Arrays of a question."""
        return self.ask(question) if self.ask else self.race.answer([question])[0]

    def _charged(self, kind: str, vectors: NDArray, gradient: bool) -> Case:
        """A batch from the store, or computed and stored; its cost is added."""
        cost = len(vectors) * self._price(gradient)
        if len(vectors) > self.affordable(gradient):
            raise ValueError(f"{self.name}: {len(vectors)} settings cost more than is left of its budget")
        mark = hashlib.sha256(np.ascontiguousarray(vectors).tobytes()).hexdigest()[:12]
        name = f"{kind}/{self.name}-{self.batches:04d}-{mark}"
        case, _ = self.race.store.take(name, lambda: self.asked(Question(vectors, gradient)))
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
        case = self._charged("forward", vectors, False)
        scores, losses = true_scores(case), np.asarray(case["loss"], float).mean(axis=1)
        losses = np.where(np.isfinite(losses), losses, np.inf)
        self._note(vectors, losses, scores)
        return scores, losses

    def gradients(self, vectors: NDArray) -> tuple[NDArray, NDArray]:
        """Smooth loss (setting,) and its gradient (setting, parameter), means over all training worlds; not finite where they are."""
        case = self._charged("gradient", vectors, True)
        self._note(vectors, case["loss"], np.full(len(vectors), np.nan))
        return case["loss"], case["gradient"]
