"""Slices of a distance field: colour, contour lines, arrows of the gradient, and the surface points in the slice."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hrcjax.viz.heatmap import cell_edges
from hrcjax.viz.style import COLOUR_MAP, MISSING, TEXT, heading, label, number
from hrcjax.viz.three_views import VIEWS, three_views

STEPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Round spacings of contour lines [m]."""
LINES = 12
"""Largest number of contour lines."""
SURFACE = "#ff7f2a"
ARROW = 0.75
"""Length of an arrow of gradient 1 over the spacing of the arrows [1]."""


class FieldSlice(NamedTuple):
    """A distance field on a plane normal to one axis of the world."""

    at: float
    """Coordinate of the plane on its normal axis [m]."""
    right: Float[np.ndarray, "right"]
    """Ascending, at equal steps [m]."""
    up: Float[np.ndarray, "up"]
    """Ascending, at equal steps [m]."""
    distance: Float[np.ndarray, "right up"]
    """[m]"""
    arrows: Float[np.ndarray, "arrow 4"] | None = None
    """Position (right, up) [m] and in-plane gradient [1]."""
    points: Float[np.ndarray, "point 2"] | None = None
    """Points of the surfaces near the plane (right, up) [m]."""


def contour_levels(highest: float) -> Float[np.ndarray, "level"]:
    """Round distances from one step up to `highest` [m], at most LINES."""
    step = next((s for s in STEPS if highest / s <= LINES), None) or 10.0 ** math.ceil(math.log10(highest / LINES))
    return step * np.arange(1, max(int(highest / step + 1e-9), 1) + 1)


def draw_slice(axes: Axes, part: FieldSlice, highest: float) -> None:
    """Draws one slice.

    Args:
        highest: distance at the end of the colour scale [m].
    """
    shown = np.ma.masked_invalid(part.distance.T)
    edges = cell_edges(part.right), cell_edges(part.up)
    axes.pcolormesh(*edges, shown, cmap=COLOUR_MAP, vmin=0.0, vmax=highest, rasterized=True)
    levels = contour_levels(highest)
    if min(part.distance.shape) > 1 and shown.count() and shown.min() < levels[-1] and shown.max() > levels[0]:
        lines = axes.contour(part.right, part.up, shown, levels=levels, colors="white", linewidths=0.7, alpha=0.85)
        axes.clabel(lines, fontsize=6.5, fmt=number, inline=True, inline_spacing=2)
    if part.points is not None and len(part.points):
        axes.scatter(part.points[:, 0], part.points[:, 1], s=2.5, color=SURFACE, linewidths=0, zorder=3)
    if part.arrows is not None and len(part.arrows):
        x, y, gx, gy = part.arrows.T
        long = np.maximum(np.hypot(gx, gy), 1.0)  # limit the length of arrows to that of gradient 1
        gx, gy = gx / long, gy / long
        apart = np.diff(np.unique(x))
        step = float(apart.min()) if len(apart) else 1.0
        axes.quiver(
            x, y, gx, gy, color="white", alpha=0.8, angles="xy", scale_units="xy", scale=1.0 / (ARROW * step),
            pivot="mid", width=0.0032, headwidth=4.2, headlength=4.5, headaxislength=4.0, minlength=0.4, zorder=2,
        )  # fmt: skip
    axes.set_facecolor(MISSING)


def field_slices(
    slices: Sequence[FieldSlice], name: str = "distance", title: str = "", highest: float | None = None
) -> tuple[Figure, list[Axes]]:
    """Slices normal to z, y and x, at one scale and with one colour bar [m]; arrows point away from the surfaces.

    Args:
        slices: normal to z, seen from above; normal to y, from the front; normal to x, from the side.
        highest: distance at the end of the colour scale; the 98th percentile if not given [m].

    Raises:
        ValueError: not three slices.
    """
    if len(slices) != 3:
        raise ValueError(f"{len(slices)} slices; three are needed: normal to z, y and x")
    values = np.concatenate([part.distance[np.isfinite(part.distance)].ravel() for part in slices])
    if highest is None:
        highest = max(float(np.quantile(values, 0.98)) if len(values) else 1.0, 0.05)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for part, view in zip(slices, VIEWS, strict=True):
        for axis, values in zip(view, (part.right, part.up), strict=True):
            edges = cell_edges(values)
            low[axis], high[axis] = min(low[axis], edges[0]), max(high[axis], edges[-1])
    figure, views, corner = three_views(low, high)
    for axes, part, across in zip(views, slices, "zyx", strict=True):
        draw_slice(axes, part, highest)
        axes.set_title(f"{across} = {part.at:.2f} m", fontsize=9, color=TEXT)
    shade = ScalarMappable(Normalize(0.0, highest), COLOUR_MAP)
    bar = figure.colorbar(shade, cax=corner.inset_axes((0.12, 0.05, 0.08, 0.8)), extend="max")
    bar.set_label(label(name, "m"))
    bar.ax.tick_params(labelsize=8)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]  # a spine, whatever its type says
    if any(part.points is not None for part in slices):
        dot = Line2D([], [], ls="", marker="o", ms=4, color=SURFACE, label="surface points in the slice")
        corner.legend(handles=[dot], loc="upper left", frameon=False, fontsize=8, handletextpad=0.1)
    heading(figure, title)
    return figure, list(views)
