"""Accuracy of a map whose points have no error: what the spacing of the points alone allows."""

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
    """The map with each point of level 0 moved to the nearest point of the exact surfaces, and refitted."""
    rows = np.array(seen.state.levels[0].rows)
    there = rows[:, 3] > 0
    points = np.moveaxis(rows[:, :3], 1, 2)
    d, g = truth(case.world, points[there])
    points[there] -= d[:, None] * g
    rows[:, :3] = np.moveaxis(points, 2, 1)
    state = jax.tree.map(jnp.array, seen.state)  # a copy: `settled` donates its argument
    state = eqx.tree_at(lambda s: s.levels[0].rows, state, jnp.asarray(rows))
    state = eqx.tree_at(lambda s: s.stale, state, jnp.asarray(there.any(axis=1)))
    return settled(state)


def exact_points_cosine(case: Case, seen: Survey, asked: Queries) -> float:
    """Mean cosine of the uncorrected gradient if the map's points had no error."""
    return float(np.mean(cosines(ask(on_surfaces(case, seen), asked.x).plain_gradient, asked.gradient)))
