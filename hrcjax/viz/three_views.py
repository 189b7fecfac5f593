"""Three views of one box at the same scale: from above, below it from the front, and from the side."""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcjax.viz.style import TEXT, label, new_figure, tidy

VIEWS = ((0, 1), (0, 2), (1, 2))
"""Axes of the world to the right and up: from above, from the front, from the side."""
SIZE = 9.5
"""Largest total width and height of the views [inch]."""


def three_views(
    low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]
) -> tuple[Figure, tuple[Axes, Axes, Axes], Axes]:
    """An empty figure: axes of the three views, and axes in the free corner for legend or colour bar.

    Args:
        low, high: corners of the box [m].
    """
    x, y, z = (max(float(v), 1e-3) for v in high - low)
    least = 0.25 * max(x, y, z)  # leave room for the labels of a flat box
    wide, tall = x + max(y, least), max(y, least) + max(z, least)
    scale = SIZE / max(wide, tall)
    figure = new_figure(max(wide * scale + 1.5, 5.5), max(tall * scale + 1.6, 4.5))
    shares = {"width_ratios": [x, max(y, least)], "height_ratios": [max(y, least), max(z, least)]}
    grid = figure.subplots(2, 2, gridspec_kw=shares)
    views = (grid[0, 0], grid[1, 0], grid[1, 1])
    for axes, (right, up), name in zip(views, VIEWS, ("above", "the front", "the side"), strict=True):
        axes.set_aspect("equal")
        axes.set_xlim(low[right], high[right])
        axes.set_ylim(low[up], high[up])
        axes.set_xlabel(label("xyz"[right], "m"))
        axes.set_ylabel(label("xyz"[up], "m"))
        axes.set_title(f"from {name}", fontsize=9, color=TEXT)
        tidy(axes)
    grid[0, 1].axis("off")
    return figure, views, grid[0, 1]
