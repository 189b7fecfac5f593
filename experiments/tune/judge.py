"""Before and after: exact metrics of parameters in every world, means and their intervals over worlds."""

import hashlib
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.case_store import Case, RunStore
from hrcjax.lab.progress import Progress
from hrcjax.numerics import unrolled_options

from .problem import Problem

AT_ONCE = 2
"""Settings in one call: before and after."""
DRAWS = 2000
"""Draws of the bootstrap."""
INSIDE = 0.95
"""Probability inside of an interval [1]."""


class Judge:
    """Measures settings in worlds, each once."""

    def __init__(self, problem: Problem, store: RunStore) -> None:
        self.problem, self.store = problem, store

    @cached_property
    def _measure(self) -> Any:
        problem = self.problem

        def over(vectors: Any, world: Any) -> Any:
            return jax.vmap(lambda vector: problem.measure(problem.params_of(vector), world))(vectors)

        return jax.jit(over, compiler_options=unrolled_options())

    def measured(self, vectors: NDArray, worlds: Mapping[str, Any], what: str) -> dict[str, NDArray]:
        """Every metric (setting, world)."""
        groups = [vectors[k : k + AT_ONCE] for k in range(0, len(vectors), AT_ONCE)]
        found: list[list[Case]] = []
        with Progress(len(groups) * len(worlds), unit=what) as progress:
            for some in groups:
                found.append([])
                full = np.concatenate([some, np.repeat(some[:1], AT_ONCE - len(some), axis=0)])
                mark = hashlib.sha256(full.tobytes()).hexdigest()[:12]
                for name, world in worlds.items():
                    case, new = self.store.take(f"measure/{name}-{mark}", lambda f=full, w=world: self._measure(jnp.asarray(f), w))  # fmt: skip
                    found[-1].append({key: value[: len(some)] for key, value in case.items()})
                    progress.advance(1, None if new else 0.0)
        return {
            key: np.concatenate([np.stack([case[key] for case in group], axis=1) for group in found])
            for key in found[0][0]
        }


def interval(each: NDArray, seed: int) -> tuple[float, float]:
    """Of the mean of some numbers, those that are not NaN, by the bootstrap; NaN for fewer than two."""
    known = each[np.isfinite(each)]
    if len(known) < 2:
        return np.nan, np.nan
    drawn = np.random.default_rng(seed).choice(known, (DRAWS, len(known))).mean(axis=1)
    low, high = np.quantile(drawn, [(1 - INSIDE) / 2, (1 + INSIDE) / 2])
    return float(low), float(high)


def mean(each: NDArray) -> float:
    """Of those that are not NaN; NaN if there is none."""
    known = each[np.isfinite(each)]
    return float(known.mean()) if len(known) else np.nan


def comparison(metrics: Mapping[str, NDArray], units: Mapping[str, tuple[str, str]], seed: int) -> dict[str, dict]:
    """Rows of before (setting 0), after (setting 1) and the change in the same worlds with its interval."""
    rows: dict[str, dict] = {}
    for name, (unit, better) in units.items():
        before, after = np.asarray(metrics[name], float)
        both = np.isfinite(before) & np.isfinite(after)
        before, after = np.where(both, before, np.nan), np.where(both, after, np.nan)
        low, high = interval(after - before, seed)
        numbers = {
            "before": mean(before),
            "after": mean(after),
            "change": mean(after - before),
            "low": low,
            "high": high,
        }
        rows |= {f"{name} {what}": {"value": x, "unit": unit, "better": better} for what, x in numbers.items()}
    return rows
