"""The end of a method: its best candidate by the true training score, from its own compute; and its way there, for a figure."""

import numpy as np
from numpy.typing import NDArray

from .account import Account, Question
from .forward import true_scores

TRACED = 10
"""Points of the way of a method on the smooth loss that are measured for the figure."""


def least_first(account: Account, count: int) -> list[int]:
    """Places of different settings with the least smooth loss, at most `count` of them; the first setting is always one."""
    kept = [0]
    for k in map(int, np.argsort(account.losses, kind="stable")):
        if len(kept) >= count or not np.isfinite(account.losses[k]):
            break
        if not any(np.array_equal(account.vectors[k], account.vectors[j]) for j in kept):
            kept.append(k)
    return kept


def choose(account: Account, start: NDArray, choices: int, smooth: bool) -> tuple[NDArray, float]:
    """Setting and true training score.

    Args:
        start: what is kept if a method has no candidate.
        choices: candidates that are compared, of a method on the smooth loss.
        smooth: whether the method saw the smooth loss alone.
    """
    account.reserve = 0.0
    if not account.vectors and account.affordable():
        account.evaluate(start[None])
    if not account.vectors:
        return start, -np.inf
    if not smooth:
        scores = np.where(np.isnan(account.scores), -np.inf, account.scores)
        best = int(np.argmax(scores))
        return account.vectors[best], float(scores[best])
    places = least_first(account, choices)
    known = np.array([account.scores[k] for k in places])
    if np.isnan(known).any():
        places = places[: account.affordable()]
        if not places:
            return start, -np.inf
        known, _ = account.evaluate(np.stack([account.vectors[k] for k in places]))
    best = int(np.argmax(known))
    return account.vectors[places[best]], float(known[best])


def scored_way(account: Account, searched: int, chosen: float) -> tuple[NDArray, NDArray]:
    """Compute spent and best true training score so far.

    Args:
        searched: number of settings before the choice.
        chosen: true training score of the choice.

    A method that saw the smooth loss alone did not know the scores on its way: some of its settings, the least so far by the smooth
    loss, are measured for this, outside of its account.
    """
    after, scores = np.array(account.after[:searched]), np.array(account.scores[:searched], float)
    if searched and np.isnan(scores).any():
        losses = np.array(account.losses[:searched])
        better = np.flatnonzero(losses < np.concatenate([[np.inf], np.minimum.accumulate(losses)[:-1]]))
        if not len(better):
            return np.array([account.spent]), np.array([chosen])
        some = better[np.unique(np.linspace(0, len(better) - 1, TRACED).round().astype(int))]
        vectors = np.stack([account.vectors[k] for k in some])
        case, _ = account.race.store.take(f"way/{account.name}", lambda: account.asked(Question(vectors)))
        after, scores = after[some], true_scores(case)
    after, scores = np.append(after, account.spent), np.append(scores, chosen)
    return after, np.maximum.accumulate(scores)
