"""The sound score by plain sums; as `hrcjax.metrics.sound_score` with its default weights."""

import numpy as np
from numpy.typing import NDArray


def sound_scores(
    clearance: float,
    separation: NDArray,
    protective: NDArray,
    until: int,
    arrived: bool,
    touched: bool,
    times: tuple[float, float],
    log_jerk: float,
    work: float,
) -> dict[str, float]:
    """The terms and the score, by the names of `hrcjax.metrics.METRICS`.

    Args:
        clearance: the least one [m].
        separation, protective: distances over sample [m].
        until: number of samples up to the arrival.
        touched: whether the arm touched an obstacle or the person.
        times: of the straight way, and to the goal [s].
        log_jerk: -ln of the dimensionless jerk [1].
        work: of the joints [J].
    """
    near = min(max(clearance / 0.05, 0.0), 1.0)
    missing = [min(max(1 - d / s, 0.0), 1.0) for d, s in zip(separation[:until], protective[:until], strict=True)]
    terms = {
        "sound_clearance": 100 * (1 - (1 - near) ** 2),
        "sound_separation": 100 * sum((1 - u) ** 2 for u in missing) / until,
        "sound_time": 100 * min(times[0] / times[1], 1.0) if times[1] > 0 else 100.0,
        "sound_jerk": 100 * min((720 / 1.875**2 * np.exp(log_jerk)) ** 0.1, 1.0),
        "sound_energy": 3000 / (30 + work),
    }
    weights = (0.25, 0.25, 0.2, 0.15, 0.15)
    quality = sum(weight * term for weight, term in zip(weights, terms.values(), strict=True))
    return {**terms, "score_sound": 20 + 0.8 * quality if arrived and not touched else 0.1 * quality}
