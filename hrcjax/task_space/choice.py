"""Which shape explains best what was seen of one thing."""

import jax
import numpy as np

from hrcjax.task_space.shape_fit import KINDS, UNKNOWNS, Evidence, FitParams, Fitted, fit_shape


def criterion(kind: int, fitted: Fitted, seen: Evidence) -> float:
    """What decides between shapes, the less the better: the cost, in which every point off the surface and every ray of free
    space that is claimed counts in its standard deviations, and log n for every free number (Schwarz 1978) [1]."""
    count = int(np.sum(seen.mask)) + int(np.sum(seen.free))
    return float(fitted.cost) + UNKNOWNS[kind] * float(np.log(max(count, 2)))


def best_shape(seen: Evidence, params: FitParams) -> tuple[int, Fitted, float]:
    """The best kind of shape, its fit, and the criterion."""
    fits = {kind: jax.device_get(fit_shape(kind, params, seen)) for kind in KINDS}
    scores = {kind: criterion(kind, fit, seen) for kind, fit in fits.items()}
    kind = min(scores, key=lambda k: scores[k] if np.isfinite(scores[k]) else np.inf)
    return kind, fits[kind], scores[kind]
