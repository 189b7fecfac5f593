"""How much of what was measured of a thing its shape leaves out: a shape that does so describes something smaller than what stands there."""

import numpy as np
from jaxtyping import Float
from numpy.lib.stride_tricks import sliding_window_view

from hrcjax.task_space.instances import Part
from hrcjax.task_space.solid_distance import Solid, solid_distances
from hrcjax.task_space.view import View

WINDOW = 5
"""Edge of the square of pixels whose median distance counts [px]."""
SURE = 2.0
"""Standard deviations of a median that are taken from it [1]."""
MEDIAN = np.sqrt(np.pi / 2)
"""Standard deviation of the median of normal numbers over that of their mean [1]."""


def left_out(
    views: list[View], parts: list[Part], flat: list[Float[np.ndarray, "_ 3"]], solid: Solid, stands: bool, least: int
) -> float:
    """How far outside of a solid something of a thing surely is; 0: nothing is [m].

    Of its pixels it is the greatest median distance among neighbours, less what may be the noise of that median: most of a neighbourhood is at
    least as far out, so that single pixels, and those that fly along an edge, do not count. Of a thing that stands, it is also how high the solid
    ends over the table: nobody has seen what is between the two, but nothing has been seen to pass there either.

    Args:
        flat: points of all pixels of every view [m].
        stands: whether the thing reaches down to the table.
        least: pixels of a neighbourhood that are the thing's, at least; fewer are noise [1].
    """
    _, center, size, _ = solid
    most = max(0.0, float(center[2] - size[2])) if stands else 0.0
    for part in parts:
        view = views[part.view]
        row, column = np.divmod(part.pixels, view.depth.shape[1])
        shape = np.array([np.ptp(row), np.ptp(column)]) + WINDOW
        at = row - row.min() + WINDOW // 2, column - column.min() + WINDOW // 2
        off, spread = np.full(shape, np.inf), np.zeros(shape)
        off[at] = solid_distances(*solid, flat[part.view][part.pixels])
        spread[at] = view.deviation.ravel()[part.pixels]
        near, noise = (_neighbours(image, at) for image in (off, spread))
        count = np.sum(noise > 0, axis=1)
        median = np.take_along_axis(np.sort(near, axis=1), (count[:, None] - 1) // 2, axis=1)[:, 0]
        sure = median - SURE * MEDIAN * np.linalg.norm(noise, axis=1) / count
        most = max(most, float(np.max(sure, where=count >= least, initial=0.0)))
    return most


def _neighbours(image: np.ndarray, at: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The values in the windows about pixels, whose places are those of an image that is half a window larger on every side."""
    row, column = (place - WINDOW // 2 for place in at)
    return sliding_window_view(image, (WINDOW, WINDOW))[row, column].reshape(len(row), -1)
