"""Lumped weights compared with exact weights of the same points."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.map import FieldMap, Level, exact_distance_and_gradient, map_distance_and_gradient

from .accuracy import Measures, cosines, rmse
from .queries import Queries
from .survey import LAYOUT, PARAMS

LARGEST_DISTANCE = 0.2
"""Largest distance of the queries, within which level 0 alone is read [m]."""
COUNT = 512


@cache
def _both():
    def one(levels: tuple[Level, ...], x: jax.Array):
        lumped = map_distance_and_gradient(LAYOUT, levels, PARAMS.ratio, x, corrected=False)
        return lumped, exact_distance_and_gradient(LAYOUT, levels, x, PARAMS.ratio, PARAMS.noise)

    return jax.jit(lambda levels, x: jax.lax.map(lambda x: one(levels, x), x, batch_size=16))


def lumped_and_exact(state: FieldMap, asked: Queries) -> Measures:
    """RMSE [m] and cosine of both, uncorrected for curvature, and the RMS difference of the two [m]."""
    near = np.nonzero(asked.distance < LARGEST_DISTANCE)[0]
    near = np.resize(near, COUNT)
    both = _both()(state.levels, jnp.asarray(asked.x[near]))
    (lumped, lumped_g), (exact, exact_g) = jax.tree.map(np.asarray, both)
    truth, towards = asked.distance[near], asked.gradient[near]
    return {
        "rmse_lumped": rmse(lumped, truth),
        "rmse_exact": rmse(exact, truth),
        "cosine_lumped": float(np.mean(cosines(lumped_g, towards))),
        "cosine_exact": float(np.mean(cosines(exact_g, towards))),
        "apart": rmse(lumped, exact),
    }
