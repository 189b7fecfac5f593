"""A map's points from above, from the front and from the side, coloured by label."""

import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hrcjax.viz.style import DYNAMIC_POINT, NEW_POINT, STATIC_POINT, heading
from hrcjax.viz.three_views import VIEWS, three_views

POINT_COLOURS = ("#ffffff", NEW_POINT, STATIC_POINT, DYNAMIC_POINT)
"""By label: none, new, static, dynamic."""
NAMES = ("none", "new", "static", "dynamic")
ORDER = ((2, 1), (3,))
"""Drawing order of labels: static and new, then dynamic."""
TOWARDS = (1.0, -1.0, 1.0)
"""Direction towards the viewer: z from above, -y from the front, x from the side."""
LIGHTER = (0.0, 0.55, 0.6, 0.0)
"""Lightening of the farthest points of each label relative to the nearest [1]."""


def _shaded(labels: Int[np.ndarray, "point"], nearness: Float[np.ndarray, "point"]) -> Float[np.ndarray, "point 3"]:
    """The colours of labels, lighter with distance; `nearness` from 0 to 1."""
    light = np.asarray(LIGHTER)[labels, None] * (1.0 - nearness)[:, None]
    colours = np.asarray([to_rgb(colour) for colour in POINT_COLOURS])[labels]
    return colours * (1 - light) + light


def cloud_views(
    points: Float[np.ndarray, "point 3"], labels: Int[np.ndarray, "point"], title: str = ""
) -> tuple[Figure, list[Axes]]:
    """Three views at one scale: from above (along -z), from the front (along y) and from the side (along -x).

    Points farther away are lighter.

    Args:
        points: in the world [m].
        labels: 1 new, 2 static, 3 dynamic.
    """
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.ones(3))
    margin = 0.03 * max(float((high - low).max()), 0.1)
    figure, views, corner = three_views(low - margin, high + margin)
    size = float(np.clip(60_000 / max(len(points), 1), 0.6, 12.0))
    for axes, (right, up), sign in zip(views, VIEWS, TOWARDS, strict=True):
        depth = sign * points[:, 3 - right - up]
        span = float(np.ptp(depth)) if len(depth) else 0.0
        nearness = (depth - depth.min()) / span if span > 0 else np.ones(len(depth))
        for kinds in ORDER:
            of = np.flatnonzero(np.isin(labels, kinds))
            of = of[np.argsort(depth[of], kind="stable")]  # the nearest over the others
            if len(of):
                colours, wide = _shaded(labels[of], nearness[of]), 2.0 if 3 in kinds else 1.0
                axes.scatter(points[of, right], points[of, up], s=wide * size, c=colours, linewidths=0, rasterized=True)
        axes.grid(alpha=0.25, lw=0.5)
        axes.set_axisbelow(True)
    handles = [
        Line2D([], [], ls="", marker="o", ms=7, color=POINT_COLOURS[k], label=f"{NAMES[k]}  {int(np.sum(labels == k)):,}")
        for k in (2, 1, 3)
    ]  # fmt: skip
    corner.legend(handles=handles, loc="center left", frameon=False, fontsize=10, title="points", alignment="left")
    heading(figure, title)
    return figure, list(views)
