"""What a map could know if its points had no error: how much of a figure is due to their spacing alone."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.map import FieldMap

from .accuracy import cosines
from .answers import ask
from .families import Case
from .queries import Queries, truth
from .survey import Survey, settled


def on_surfaces(case: Case, seen: Survey) -> FieldMap:
    """The map with each point of level 0 moved to the nearest place of the exact surfaces, and fitted anew."""
    rows = np.array(seen.state.levels[0].rows)
    there = rows[:, 3] > 0
    points = np.moveaxis(rows[:, :3], 1, 2)
    d, g = truth(case.world, points[there])
    points[there] -= d[:, None] * g
    rows[:, :3] = np.moveaxis(points, 2, 1)
    state = jax.tree.map(jnp.array, seen.state)  # a copy: settling gives its map up
    state = eqx.tree_at(lambda s: s.levels[0].rows, state, jnp.asarray(rows))
    state = eqx.tree_at(lambda s: s.stale[0], state, jnp.asarray(there.any(axis=1)))
    return settled(state)


def exact_points_cosine(case: Case, seen: Survey, asked: Queries) -> float:
    """Mean cosine of the plain gradient if the map's points had no error."""
    return float(np.mean(cosines(ask(on_surfaces(case, seen), asked.x).plain_gradient, asked.gradient)))
