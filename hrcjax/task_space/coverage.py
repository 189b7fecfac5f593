"""How much of what was measured of a thing its shape leaves out: a shape that does so describes something smaller than what stands there."""

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from hrcjax.task_space.instances import Part
from hrcjax.task_space.solid_distance import Solid, solid_distances
from hrcjax.task_space.view import View

WINDOW = 5
"""Edge of the square of pixels whose distances are averaged [px]."""
SURE = 2.0
"""Standard deviations of a mean that are taken from it [1]."""


def left_out(views: list[View], parts: list[Part], flat: list[Float[np.ndarray, "_ 3"]], solid: Solid, stands: bool, least: int) -> float:
    """How far outside of a solid something of a thing surely is; 0: nowhere [m].

    Of its pixels it is the greatest mean distance among neighbours, as single ones are noisy or fly, less what may be the noise of that
    mean. What lies deep within counts as if it were on the surface, so that it hides nothing beside it. Of a thing that stands, it is
    also how high the solid ends above the table: what is between the two has been seen by nobody, but nothing has been seen to pass there.

    Args:
        flat: points of all pixels of every view [m].
        stands: whether the thing reaches down to the table.
        least: pixels that a mean has at least; fewer are noise [1].
    """
    _, center, size, _ = solid
    most = max(0.0, float(center[2] - size[2])) if stands else 0.0
    for part in parts:
        view = views[part.view]
        spread = view.deviation.ravel()[part.pixels]
        off = np.maximum(solid_distances(*solid, flat[part.view][part.pixels]), -SURE * spread)
        row, column = np.divmod(part.pixels, view.depth.shape[1])
        row, column = row - row.min(), column - column.min()
        shape = row.max() + 1, column.max() + 1

        def total(values: np.ndarray, at: tuple = (row, column), shape: tuple = shape) -> np.ndarray:
            image = np.zeros(shape)
            image[at] = values
            return ndimage.uniform_filter(image, WINDOW, mode="constant")[at] * WINDOW**2

        count = np.round(total(np.ones(len(off))))
        mean = (total(off) - SURE * np.sqrt(np.maximum(total(spread**2), 0))) / np.maximum(count, 1)
        most = max(most, float(np.max(mean, where=count >= least, initial=0.0)))
    return most
