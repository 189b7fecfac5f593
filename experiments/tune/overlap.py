"""Held-out worlds that are not new: another seed or name, but the scene or the people of a world of the training."""

import hashlib
from collections.abc import Mapping
from typing import Any

import jax
import numpy as np

from hrcjax.tune.tuned import Seen


def digests(parts: Mapping[str, Any]) -> dict[str, str]:
    """Of the arrays of every part of a world."""
    return {name: _digest(tree) for name, tree in parts.items()}


def _digest(tree: Any) -> str:
    digest = hashlib.sha256()
    for leaf in jax.tree.leaves(tree):
        array = np.ascontiguousarray(leaf)
        digest.update(f"{array.dtype}{array.shape}".encode() + array.tobytes())
    return digest.hexdigest()[:16]


def not_new(held: Seen, training: Seen, before: Seen) -> str:
    """One line on the held-out worlds that a training has seen in part or whole; empty: none.

    Args:
        held: digests of the parts of the worlds that are held out.
        training: of those of this training.
        before: of those in which the parameters at the start were found.
    """
    ways: dict[str, list[str]] = {}
    for name, parts in held.items():
        if how := _how(name, parts, training, before):
            ways.setdefault(how, []).append(name)
    return "; ".join(f"{', '.join(names)} ({how})" for how, names in ways.items())


def _how(name: str, parts: Mapping[str, str], training: Seen, before: Seen) -> str:
    """How a world is not new, by what it shares most with; empty: in nothing."""
    if name in before:
        return "trained in by --from"
    best, how = 0, ""
    for seen, whose in ((training, "training"), (before, "the training of --from")):
        for other in seen.values():
            same = [part for part, digest in parts.items() if other.get(part) == digest]
            if len(same) > best:
                rest = ": only noise differs" if len(same) == len(parts) else ""
                best, how = len(same), f"{' and '.join(same)} as in {whose}{rest}"
    return how
