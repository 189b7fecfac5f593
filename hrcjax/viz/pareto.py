"""The Pareto front of settings as a figure."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcjax.viz.front import pareto_mask
from hrcjax.viz.style import BEST, COLOUR_MAP, INFEASIBLE, WORST, as_row, finite_range, heading, label, new_figure, tidy


def pareto_figure(
    values: Float[np.ndarray, "n 3"],
    names: Sequence[str],
    units: Sequence[str],
    better: Sequence[str],
    feasible: Bool[np.ndarray, "n"],
    marks: Mapping[str, int] | None = None,
    title: str = "",
) -> tuple[Figure, list[Axes]]:
    """Three metrics two by two. The third one colours the front; dominated settings are pale, failed ones light grey.

    Args:
        marks: settings to highlight, by label: {"best": 17, "worst": 3}.
    """
    usable = feasible & np.isfinite(values).all(axis=1)
    front = np.zeros(len(values), bool)
    front[usable] = pareto_mask(values[usable], better)
    figure = new_figure(13.0, 4.6)
    panels = as_row(figure.subplots(1, 3))
    for axes, (i, j, k) in zip(panels, [(0, 1, 2), (0, 2, 1), (1, 2, 0)], strict=True):
        shown = ~feasible & np.isfinite(values).all(axis=1)
        axes.scatter(values[shown, i], values[shown, j], s=12, color=INFEASIBLE, label="failed", zorder=1)
        rest = usable & ~front
        axes.scatter(values[rest, i], values[rest, j], s=12, color="#9db4cc", alpha=0.6, label="beaten", zorder=2)
        low, high = finite_range(values[front, k])
        points = axes.scatter(
            values[front, i],
            values[front, j],
            c=values[front, k],
            cmap=COLOUR_MAP,
            vmin=low,
            vmax=high,
            s=34,
            edgecolor="black",
            linewidth=0.5,
            label="Pareto front",
            zorder=3,
        )
        for n, (text, at) in enumerate((marks or {}).items()):
            spot, colour = (values[at, i], values[at, j]), (BEST, WORST)[n % 2]
            axes.plot(*spot, "o", markersize=12, markerfacecolor="none", markeredgecolor=colour, markeredgewidth=2)
            axes.plot([], [], "o", markersize=9, markerfacecolor="none", markeredgecolor=colour, label=text)
        for axis, column in ((axes.xaxis, i), (axes.yaxis, j)):
            arrow = "lower" if better[column] == "low" else "higher"
            axis.set_label_text(f"{label(names[column], units[column])} ({arrow} is better)", fontsize=9)
        bar = figure.colorbar(points, ax=axes, location="top", fraction=0.05, pad=0.02, aspect=40)
        bar.set_label(f"{label(names[k], units[k])} of the front", fontsize=8)
        bar.ax.tick_params(labelsize=7)
        axes.grid(alpha=0.25)
        tidy(axes)
    handles, texts = panels[0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    heading(figure, title or f"{int(front.sum())} of {int(usable.sum())} settings are Pareto-optimal")
    return figure, panels
