"""Scores of tables VIII and X from their own rows, and what the rounding of table VIII leaves open."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.metrics.score import ScoreParams, efficiency_score, overall_score, relative_score, safety_score
from hrcjax.plan import path_scores

from .printed import PATHS, SCORES, PathRow

ROUNDING = 0.005
"""Half a unit of the last digit of table VIII's lengths [cm] and bending energies [1/cm]."""
STEPS = 11
"""Bending energies tried within the rounding of each."""


def scores_of(lengths: Sequence[float] | NDArray, bendings: Sequence[float] | NDArray) -> NDArray:
    """omega1 = omega2 = 0.5 over min-max scaled length and bending energy among the candidates."""
    with jax.enable_x64(True):
        return np.asarray(path_scores(jnp.asarray(lengths, jnp.float64), jnp.asarray(bendings, jnp.float64)))


def closest_scores(rows: Sequence[PathRow] = PATHS) -> NDArray:
    """Of all values that round to the printed lengths and bending energies, the scores with the least largest deviation
    from the printed ones."""
    ends, inside = np.array([-1.0, 1.0]) * ROUNDING, np.linspace(-ROUNDING, ROUNDING, STEPS)
    grid = np.stack(np.meshgrid(*[ends] * len(rows), *[inside] * len(rows), indexing="ij"), axis=-1)
    grid = grid.reshape(-1, 2 * len(rows))
    lengths = np.array([row.length for row in rows]) + grid[:, : len(rows)]
    bendings = np.array([row.bending for row in rows]) + grid[:, len(rows) :]
    with jax.enable_x64(True):
        found = np.asarray(jax.jit(jax.vmap(path_scores))(jnp.asarray(lengths), jnp.asarray(bendings)))
    return found[np.argmin(np.abs(found - [row.score for row in rows]).max(axis=1))]


def table_ten() -> dict[str, tuple[float, float, float]]:
    """Of both runs of table X: safety, efficiency and overall score, from the rows; "without" and "with" zones."""
    params, out = ScoreParams(), {}
    with jax.enable_x64(True):
        for k, run in enumerate(("without", "with")):
            time, power, trajectory, joint, navigation, proximity, collision = (both[k] for both in SCORES.values())
            safety = safety_score(params, navigation, proximity, collision)
            efficiency = efficiency_score(params, time, power, trajectory, joint)
            out[run] = (float(safety), float(efficiency), float(overall_score(params, safety, efficiency)))
    return out


def relative_of_table_ten() -> float:
    """Overall score with zones, in percent of that without."""
    found = table_ten()
    with jax.enable_x64(True):
        return float(relative_score(found["with"][2], found["without"][2]))
