"""What each swept parameter does to each metric: bars of Sobol indices, and line ranges as a table."""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from hrcjax.viz.style import KNOB_COLOURS, TEXT, as_row, heading, label, new_figure, parameter_label, tidy

STRONG = 0.1
"""Line range from which on it is printed in bold [1]."""


def sensitivity_bars(
    first: Float[np.ndarray, "knob metric"],
    total: Float[np.ndarray, "knob metric"],
    knobs: Sequence[str],
    metrics: Sequence[str],
    title: str = "",
) -> tuple[Figure, list[Axes]]:
    """A panel per metric with a bar per knob: dark is the knob alone, pale what it does together with others.

    Args:
        first, total: Sobol indices; NaN where not known [1].
    """
    columns = min(4, len(metrics))
    rows = -(-len(metrics) // columns)
    figure = new_figure(2.7 * columns + 0.8, (0.33 * len(knobs) + 0.75) * rows + 1.1)
    panels = as_row(figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False))
    places = np.arange(len(knobs))
    colours = [KNOB_COLOURS[k % len(KNOB_COLOURS)] for k in places]
    for m, axes in enumerate(panels):
        if m >= len(metrics):
            axes.set_visible(False)
            continue
        axes.barh(places, np.nan_to_num(total[:, m]), color=colours, alpha=0.3, height=0.72)
        axes.barh(places, np.nan_to_num(first[:, m]), color=colours, height=0.72)
        for k in places:
            known = np.isfinite(total[k, m])
            text = f"{first[k, m]:.2f} / {total[k, m]:.2f}" if known else "not known"
            axes.annotate(
                text, (np.nan_to_num(total[k, m]), k), (4, 0), textcoords="offset points", va="center", fontsize=7.5
            )
        axes.set_title(label(metrics[m]), fontsize=9)
        axes.set_xlim(0, 1.42)
        axes.set_xticks([0, 0.5, 1])
        axes.set_yticks(places, [parameter_label(name) for name in knobs])
        axes.tick_params(labelbottom=m + columns >= len(metrics))
        tidy(axes)
        axes.tick_params(axis="y", labelsize=10, length=0)
    panels[0].invert_yaxis()
    figure.supxlabel("share of the variance (1: this knob alone decides)", fontsize=9, color=TEXT)
    patches = [Patch(color="#555555", label="alone (first order)"), Patch(color="#555555", alpha=0.3, label="with others (total)")]  # fmt: skip
    figure.legend(handles=patches, loc="outside upper right", ncols=2, frameon=False, fontsize=8)
    heading(figure, title)
    return figure, panels[: len(metrics)]


def range_table(
    ranges: Float[np.ndarray, "knob metric"],
    knobs: Sequence[str],
    metrics: Sequence[str],
    title: str = "",
) -> tuple[Figure, Axes]:
    """A cell per knob and metric: how much of the metric's range over all settings a knob covers on its own.

    Args:
        ranges: NaN where not known [1].
    """
    figure = new_figure(1.15 * len(metrics) + 1.8, 0.62 * len(knobs) + 1.6)
    axes = figure.subplots()
    mesh = axes.imshow(np.ma.masked_invalid(ranges), cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for (k, m), value in np.ndenumerate(ranges):
        text, strong = (f"{value:.2f}", value >= STRONG) if np.isfinite(value) else ("–", False)
        colour = "white" if np.isfinite(value) and value > 0.55 else TEXT
        axes.text(m, k, text, ha="center", va="center", color=colour, fontweight="bold" if strong else "normal")
    axes.set_xticks(np.arange(len(metrics)), [fill(label(name), 12) for name in metrics], fontsize=8.5)
    axes.set_yticks(np.arange(len(knobs)), [parameter_label(name) for name in knobs], fontsize=12)
    axes.xaxis.tick_top()
    axes.tick_params(length=0, labelcolor=TEXT)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("range along the knob's lines / range over all settings (median)", fontsize=9, color=TEXT)
    bar = figure.colorbar(mesh, ax=axes, fraction=0.05, pad=0.02)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]  # a spine, whatever its type says
    bar.ax.tick_params(labelsize=8)
    heading(figure, title)
    return figure, axes
