"""What a run found, as numbers: rows of the section, the table, and who wins."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcjax.lab.table import aligned

from .compare import Difference, difference, known, mean, ranked
from .config import BY_GRADIENT
from .methods import Entry
from .problem import REPORTED, SCORE

REFERENCE = "gradient"


@dataclass(frozen=True)
class Found:
    """Everything that the report needs."""

    entries: Mapping[str, list[Entry]]
    """Method -> of every seed."""
    held_out: Mapping[str, Mapping[str, NDArray]]
    """Method -> metric -> (seed, world)."""
    worlds: list[str]
    """Names of the held-out worlds."""
    units: Mapping[str, tuple[str, str]]
    """Of the metrics: unit, and "low" or "high"."""
    costs: Mapping[str, float]
    """Of the gradient: ratio and times; empty if no method used it."""
    budget: float
    """Of each method but the sweep [forward episodes]."""
    seed: int
    """Of the intervals."""

    @property
    def scores(self) -> dict[str, NDArray]:
        """Held-out score (seed, world) by method."""
        return {method: metrics[SCORE] for method, metrics in self.held_out.items()}

    def versus(self, one: str, other: str) -> Difference:
        """Difference of the held-out scores."""
        return difference(self.scores[one], self.scores[other], self.seed)


def _row(value: Any, unit: str, better: str = "") -> dict[str, Any]:
    return {"value": float(value), "unit": unit} | ({"better": better} if better else {})


def rows(found: Found) -> dict[str, dict[str, Any]]:
    """The section's rows, those that are finite."""
    made: dict[str, dict[str, Any]] = {}

    def put(name: str, apart: Difference) -> None:
        made[name] = _row(apart.mean, "points", "high")
        made[f"{name}_low"], made[f"{name}_high"] = _row(apart.low, "points"), _row(apart.high, "points")

    for method in ranked(found.scores):
        entries, metrics = found.entries[method], found.held_out[method]
        made[f"{method}_score"] = _row(known(metrics[SCORE]).mean(), "points", "high")
        for name in REPORTED[1:]:
            if name in metrics:
                made[f"{method}_{name}"] = _row(mean(metrics[name]), *found.units[name])
        made[f"{method}_training_score"] = _row(np.mean([one.score for one in entries]), "points", "high")
        made[f"{method}_choices"] = _row(choices(entries), "settings")
        made[f"{method}_episodes"] = _row(np.mean([one.spent for one in entries]), "forward episodes")
        made[f"{method}_wall_s"] = _row(np.mean([one.seconds for one in entries]), "s", "low")
        made[f"{method}_not_finite"] = _row(sum(one.not_finite for one in entries), "settings", "low")
        if method != "defaults" and "defaults" in found.scores:
            put(f"{method}_minus_defaults", found.versus(method, "defaults"))
        for one in BY_GRADIENT:
            if method != one and one in found.scores and f"{one}_minus_{method}" not in made:
                put(f"{one}_minus_{method}", found.versus(one, method))
    made["budget"] = _row(found.budget, "forward episodes")
    for name, value in found.costs.items():
        made["gradient_cost_ratio" if name == "ratio" else f"cost_{name}"] = _row(value, "1" if "ratio" in name else "s", "low")  # fmt: skip
    return {name: entry for name, entry in made.items() if np.isfinite(entry["value"])}


def cells(found: Found) -> list[list[str]]:
    """The table: a line each method, best first."""
    names = [name for name in REPORTED if any(name in metrics for metrics in found.held_out.values())]
    heads = [f"{name} [{found.units[name][0]}]" for name in names]
    lines = [
        ["method", *heads, "minus defaults (95 %)", "gradient minus it (95 %)", "training score", "episodes", "wall s"]
    ]
    for method in ranked(found.scores):
        entries, metrics = found.entries[method], found.held_out[method]
        values = [
            f"{known(metrics[SCORE]).mean():.2f}" if name == SCORE else f"{mean(metrics[name]):.3g}" for name in names
        ]
        pairs = [(method, "defaults"), (REFERENCE, method)]
        apart = [_apart(found.versus(*pair)) if pair[0] != pair[1] and set(pair) <= set(found.scores) else "" for pair in pairs]  # fmt: skip
        spent, seconds, score = (np.mean([getattr(e, what) for e in entries]) for what in ("spent", "seconds", "score"))
        lines.append([method, *values, *apart, f"{score:.2f}", f"{spent:.0f}", f"{seconds:.0f}"])
    return lines


def _apart(apart: Difference) -> str:
    return f"{apart.mean:+.2f}" + (f" ({apart.low:+.2f} to {apart.high:+.2f})" if np.isfinite(apart.low) else " (one world)")  # fmt: skip


def choices(entries: Sequence[Entry]) -> int:
    """Different settings that the seeds of a method ended with."""
    return len({entry.vector.tobytes() for entry in entries})


def table(found: Found) -> str:
    """As aligned text."""
    return aligned(cells(found), "<>")


def verdicts(found: Found) -> list[str]:
    """Who wins, a sentence each method; losses named just so."""
    order = ranked(found.scores)
    said = [
        f"Highest mean score in the held-out worlds: {order[0]}, {known(found.scores[order[0]]).mean():.2f} points."
    ]
    for method, entries in found.entries.items():
        if choices(entries) < len(entries):
            said.append(
                f"{method}: its {len(entries)} seeds ended with {choices(entries)} setting{'s' * (choices(entries) > 1)}, as each has the defaults among its starts "
                "or candidates; of their chance the intervals know no more."
            )
    if REFERENCE not in found.scores:
        return said
    for one in (name for name in BY_GRADIENT if name in found.scores):
        for method in order:
            if method != one and not (one != REFERENCE and method == REFERENCE):
                apart = found.versus(one, method)
                word = apart.word if np.isfinite(apart.low) else "one world, no interval"
                said.append(f"{one} against {method}: {word}, {_apart(apart)} points.")
    return said
