"""Hyperparameters compared on the inner folds: the held-out blocks are not looked at."""

import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .data import FOLDS, Hands
from .measure import by_classifier, looked
from .train import Recipe, fit

CHANGES = (
    {},
    {"noise": 0.04},
    {"noise": 0.12},
    {"noise": 0.04, "squeeze": 0.2},
    {"noise": 0.04, "hidden": (32,)},
    {"noise": 0.04, "decay": 0.1},
    {"noise": 0.04, "others": 0},
)
"""Changes of the recipe that are compared, one at a time."""


def on_folds(hands: Hands, recipe: Recipe, seed: int) -> tuple[float, ...]:
    """Means over the inner folds: accuracy, the same disturbed, disorder rejected, other fingers rejected."""
    found = []
    for fold in FOLDS:
        seen = looked(by_classifier(fit(hands.outside(*fold), recipe, seed)), hands.of(*fold), seed)
        found.append((seen.accuracy, seen.turned, min(seen.rejected.values()), seen.other))
    return tuple(np.mean(found, axis=0).tolist())


def compared(hands: Hands, recipe: Recipe, seed: int) -> Iterator[str]:
    """A line for each recipe."""
    yield "accuracy  turned  rejected  other  recipe"
    for change in CHANGES:
        values = on_folds(hands, replace(recipe, **change), seed)
        yield "  ".join(f"{value:.4f}" for value in values) + f"  {change or 'as shipped'}"
        sys.stdout.flush()
