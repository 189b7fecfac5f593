"""The points of a map as arrays of the host, as many as there are."""

import numpy as np
from jaxtyping import Float, Int

from hrcjax.map.state import FieldMap


def labelled_points(state: FieldMap) -> tuple[Float[np.ndarray, "point 3"], Int[np.ndarray, "point"]]:
    """Points of level 0 [m] and their labels: NEW, STATIC or DYNAMIC. Within a compiled program: `map_points`."""
    rows, label = np.asarray(state.levels[0].rows), np.asarray(state.label)
    there = rows[:, 3] > 0
    return np.moveaxis(rows[:, :3], 1, 2)[there], label[there]
