"""A metric over the settings: heat maps over two parameters for each value of a third, curves, and sampled points."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from hrcjax.viz.style import (
    BEST,
    COLOUR_MAP,
    INFEASIBLE,
    MISSING,
    as_row,
    finite_range,
    heading,
    label,
    new_figure,
    number,
    parameter_label,
    scale,
    tidy,
)

CONTOURS = 6
"""Largest number of contours over the range of the values."""
FINE = 5
"""Least number of values along both axes for contours."""
FAILED, FAILED_LINE = "failed", "#9aa0a8"
"""Id and colour of the hatching in the figure."""


class GridAxis(NamedTuple):
    """Values of one swept parameter."""

    name: str
    values: Float[np.ndarray, "value"]
    log: bool = False
    """Spaced and drawn logarithmically."""
    unit: str = ""


def cell_edges(values: Float[np.ndarray, "value"], log: bool = False) -> Float[np.ndarray, "edge"]:
    """Edges of cells around ascending values: midpoints between neighbours, logarithmic if `log`."""
    at = np.log(values) if log else np.asarray(values, float)
    if len(at) == 1:
        half = 0.5 if log or at[0] == 0 else abs(at[0]) / 2
        edges = np.array([at[0] - half, at[0] + half])
    else:
        middle = (at[1:] + at[:-1]) / 2
        edges = np.concatenate([[2 * at[0] - middle[0]], middle, [2 * at[-1] - middle[-1]]])
    return np.exp(edges) if log else edges


def best_cell(values: Float[np.ndarray, "..."], better: str) -> tuple[int, ...] | None:
    """Index of the best finite value; None if there is none or neither end is better."""
    if better not in ("low", "high") or not np.isfinite(values).any():
        return None
    flat = np.nanargmin(np.where(np.isfinite(values), values if better == "low" else -values, np.nan))
    return tuple(int(i) for i in np.unravel_index(flat, values.shape))


def heat_maps(
    values: Float[np.ndarray, "x y panel"],
    x: GridAxis,
    y: GridAxis,
    panel: GridAxis,
    name: str,
    unit: str = "",
    better: str = "",
    title: str = "",
    failed: Bool[np.ndarray, "x y panel"] | None = None,
) -> tuple[Figure, list[Axes]]:
    """One heat map over x and y for each value of `panel`, with one colour bar and contours; a star marks the best cell.

    Values that are not finite are light grey. Failed settings are hatched, decide neither colours nor contours unless all
    failed, and never count as best.
    """
    failed = np.zeros(values.shape, bool) if failed is None else failed
    count = values.shape[2]
    columns = min(4, count)
    rows = -(-count // columns)
    figure = new_figure(max(5.2, 2.5 * columns + 1.2), 2.35 * rows + 1.0)
    grid = as_row(figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False))
    whole = np.where(failed, np.nan, values)
    low, high = finite_range(whole if np.isfinite(whole).any() else values)
    colours = colormaps[COLOUR_MAP].with_extremes(bad=MISSING)
    levels = np.asarray(MaxNLocator(CONTOURS).tick_values(low, high))[1:-1]
    best = best_cell(whole, better)
    face = MISSING if np.isfinite(whole).any() else "none"
    mesh = None
    for i, axes in enumerate(grid):
        if i >= count:
            axes.set_visible(False)
            continue
        shown = np.ma.masked_invalid(values[:, :, i].T)
        mesh = axes.pcolormesh(
            cell_edges(x.values, x.log), cell_edges(y.values, y.log), shown, cmap=colours, vmin=low, vmax=high
        )
        scale(axes.xaxis, x.log)
        scale(axes.yaxis, y.log)
        if count > 1:
            axes.set_title(f"{parameter_label(panel.name)} = {number(float(panel.values[i]))}", fontsize=9)
        tidy(axes)
        if min(values.shape[:2]) >= FINE and high - low > 1e-4 * max(abs(low), abs(high)):
            _contours(axes, x.values, y.values, whole[:, :, i], levels)
        _hatch(axes, cell_edges(x.values, x.log), cell_edges(y.values, y.log), failed[:, :, i], face)
        if best is not None and best[2] == i:
            spot = (float(x.values[best[0]]), float(y.values[best[1]]))
            axes.plot(*spot, marker="*", markersize=13, color="white", markeredgecolor="black", markeredgewidth=0.9)
        if i + columns >= count:
            axes.set_xlabel(parameter_label(x.name, x.unit))
            axes.tick_params(labelbottom=True)
        if i % columns == 0:
            axes.set_ylabel(parameter_label(y.name, y.unit))
    assert mesh is not None
    bar = figure.colorbar(mesh, ax=grid, fraction=0.05, pad=0.02)
    bar.set_label(label(name, unit))
    bar.ax.tick_params(labelsize=8)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]  # a spine, whatever its type says
    marks = [text for text, shown in (("★ best", best is not None), ("hatched: failed", failed.any())) if shown]
    heading(figure, (title or label(name)) + (f"  ({', '.join(marks)})" if marks else ""))
    return figure, grid[:count]


def _contours(axes: Axes, x: np.ndarray, y: np.ndarray, values: np.ndarray, levels: np.ndarray) -> None:
    """Lines of equal value between the finite ones, with numbers."""
    shown = np.ma.masked_invalid(values.T)
    if shown.count() < 3 or shown.max() <= levels[0] or shown.min() >= levels[-1]:
        return
    lines = axes.contour(x, y, shown, levels, colors="white", linewidths=0.9, alpha=0.85)
    axes.clabel(lines, fontsize=6.5, fmt=number, colors="white", inline_spacing=2)


def _hatch(axes: Axes, x: np.ndarray, y: np.ndarray, marked: np.ndarray, face: str) -> None:
    """Hatches the marked cells between edges x and y, over their colour (all failed) or in place of it."""
    corners = [[(x[i], y[j]), (x[i + 1], y[j]), (x[i + 1], y[j + 1]), (x[i], y[j + 1])] for i, j in np.argwhere(marked)]
    if corners:
        pale = PolyCollection(corners, facecolor=face, edgecolor=FAILED_LINE, hatch="////", linewidth=0)
        pale.set_gid(FAILED)
        axes.add_collection(pale, autolim=False)


def curve(
    values: Float[np.ndarray, "value"],
    x: GridAxis,
    name: str,
    unit: str = "",
    better: str = "",
    title: str = "",
    axes: Axes | None = None,
) -> tuple[Figure, Axes]:
    """A metric over one parameter; the best value is marked by a star."""
    figure, axes = _axes(axes)
    axes.plot(x.values, values, marker="o", markersize=4, color=BEST)
    best = best_cell(values, better)
    if best is not None:
        axes.plot(x.values[best], values[best], marker="*", markersize=13, color="white", markeredgecolor="black")
    scale(axes.xaxis, x.log)
    axes.set_xlabel(parameter_label(x.name, x.unit))
    axes.set_ylabel(label(name, unit))
    low, high = finite_range(values)
    if high - low < 1e-4 * max(abs(low), abs(high)):  # do not magnify rounding errors
        middle = (low + high) / 2
        axes.set_ylim(middle - 0.5 * max(abs(middle), 1e-9), middle + 0.5 * max(abs(middle), 1e-9))
    axes.grid(alpha=0.3)
    tidy(axes)
    heading(figure, title)
    return figure, axes


def sample_map(
    values: Float[np.ndarray, "sample"],
    x: GridAxis,
    y: GridAxis,
    name: str,
    unit: str = "",
    better: str = "",
    title: str = "",
    feasible: Bool[np.ndarray, "sample"] | None = None,
    axes: Axes | None = None,
) -> tuple[Figure, Axes]:
    """A metric at sampled settings, over two of their parameters; failed settings are light grey."""
    figure, axes = _axes(axes)
    good = np.isfinite(values) if feasible is None else feasible & np.isfinite(values)
    axes.scatter(x.values[~good], y.values[~good], s=16, color=INFEASIBLE, label="failed")
    low, high = finite_range(values[good])
    points = axes.scatter(x.values[good], y.values[good], c=values[good], s=24, cmap=COLOUR_MAP, vmin=low, vmax=high)
    best = best_cell(np.where(good, values, np.nan), better)
    if best is not None:
        axes.plot(x.values[best], y.values[best], marker="*", markersize=14, color="none", markeredgecolor="black")
    scale(axes.xaxis, x.log)
    scale(axes.yaxis, y.log)
    axes.set_xlabel(parameter_label(x.name, x.unit))
    axes.set_ylabel(parameter_label(y.name, y.unit))
    figure.colorbar(points, ax=axes, label=label(name, unit))
    tidy(axes)
    heading(figure, title)
    return figure, axes


def _axes(axes: Axes | None) -> tuple[Figure, Axes]:
    if axes is not None:
        figure = axes.get_figure(root=True)
        assert figure is not None
        return figure, axes
    figure = new_figure(6.0, 4.2)
    return figure, figure.subplots()
