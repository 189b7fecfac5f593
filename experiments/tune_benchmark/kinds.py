"""Held-out worlds by what of them was seen in training, and those in which no method succeeds: a mean over all hides both."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..tune.problem import WorldName
from .compare import known, ranked
from .problem import SCORE

SEEN = "scene and people of training, other seeds"
OTHER_PEOPLE = "scene of training, other people"
OTHER_SCENES = "other scenes"


def kinds(train: Sequence[WorldName], held: Sequence[WorldName]) -> dict[str, list[int]]:
    """Kind -> places of its held-out worlds; kinds without one are left out."""
    pairs, scenes = {world[:2] for world in train}, {world[0] for world in train}
    found: dict[str, list[int]] = {SEEN: [], OTHER_PEOPLE: [], OTHER_SCENES: []}
    for k, world in enumerate(held):
        found[SEEN if world[:2] in pairs else OTHER_PEOPLE if world[0] in scenes else OTHER_SCENES].append(k)
    return {kind: places for kind, places in found.items() if places}


def never(held_out: Mapping[str, Mapping[str, NDArray]]) -> NDArray[np.bool_]:
    """Worlds in which no run of any method succeeds."""
    return np.all([np.all(known(metrics["success"]) == 0, axis=0) for metrics in held_out.values()], axis=0)


def lines(held_out: Mapping[str, Mapping[str, NDArray]], groups: Mapping[str, Sequence[int]]) -> list[list[str]]:
    """A table: methods, best first, and their mean scores in the worlds of each kind, without those that nobody solves."""
    scores = {method: known(metrics[SCORE]) for method, metrics in held_out.items()}
    lost = never(held_out)
    left = {kind: [k for k in places if not lost[k]] for kind, places in groups.items()}
    head = ["method", *(f"{kind} ({len(left[kind])} of {len(places)} worlds)" for kind, places in groups.items())]
    rows = [
        [method, *(f"{scores[method][:, places].mean():.2f}" if places else "-" for places in left.values())]
        for method in ranked(scores)
    ]
    return [head, *rows]
