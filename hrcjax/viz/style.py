"""Common style of all figures: each colour has one meaning, every axis has its unit."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, NullLocator

ZONE_COLOURS = ("#4daf7c", "#f2b632", "#d9534f", "#3b3b46")
"""Green, yellow, red, stop."""
ZONE_NAMES = ("green", "yellow", "red", "stop")
OBSTACLE = "#8a8f98"
PERSON = "#c77dba"
PLAN = "#7fb2e5"
BEST = "#1f5fa8"
WORST = "#d0702e"
START = "#2a9d5c"
GOAL = "#222222"
INFEASIBLE = "#d5d7db"
MISSING = "#eeeeee"
GRID = "#dddddd"
TEXT = "#30343b"
STATIC_POINT = "#5f656f"
DYNAMIC_POINT = "#d55e00"
NEW_POINT = "#0072b2"
"""Points of a map: grey, vermilion and blue, distinguishable with any colour vision."""
KNOB_COLOURS = ("#1f5fa8", "#d0702e", "#2a9d5c", "#7a4fa3", "#8a8f98")
"""Swept parameters in order."""
COLOUR_MAP = "viridis"
"""Sequential, perceptually uniform, readable with any colour vision."""


def new_figure(width: float, height: float) -> Figure:
    """An empty figure without window or global state; sizes in [inch]."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def label(name: str, unit: str = "") -> str:
    """Name and unit of an axis: "length [m]"; the unit "1" is omitted."""
    readable = name.replace("_", " ")
    return readable if unit in ("", "1") else f"{readable} [{unit}]"


def parameter_label(name: str, unit: str = "") -> str:
    """Symbol of a swept parameter, as the papers write it, or its name."""
    symbols = {"k_att": r"$K_{att}$", "k_rep": r"$K_{rep}$", "zeta": r"$\zeta$"}
    return symbols[name] if name in symbols else label(name, unit)


def scale(axis: Axis, log: bool) -> None:
    """A linear or a logarithmic axis; of less than two decades with ticks at 1, 2 and 5 as plain numbers, which do not overlap."""
    axis.axes.set(**{f"{axis.axis_name}scale": "log" if log else "linear"})  # pyright: ignore[reportAttributeAccessIssue]
    low, high = axis.get_view_interval()
    if log and 0 < low < high < 100 * low:
        decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
        shown = np.outer(decades, (1.0, 2.0, 5.0)).ravel()
        few = np.sum((shown >= low) & (shown <= high)) < 2
        axis.set_major_locator(MaxNLocator(4) if few else LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_formatter(NullFormatter())
        if few:
            axis.set_minor_locator(NullLocator())


def tidy(axes: Axes) -> None:
    """A thin frame without the top and right spines."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8, colors=TEXT)
    axes.title.set_color(TEXT)


def heading(figure: Figure, text: str) -> None:
    """Sets the title of a figure."""
    if text:
        figure.suptitle(text, fontsize=12, color=TEXT, fontweight="bold")


def finite_range(values: Any) -> tuple[float, float]:
    """Smallest and largest finite value, made distinct; (0, 1) if there is none."""
    array = np.asarray(values, dtype=float)
    array = array[np.isfinite(array)]
    if array.size == 0:
        return 0.0, 1.0
    low, high = float(array.min()), float(array.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def number(value: float) -> str:
    """A number formatted for figures."""
    return f"{value:.3g}"


def as_row(axes: Any) -> list[Axes]:
    """Axes from `Figure.subplots` as one flat list, row after row."""
    return list(np.atleast_1d(axes).ravel())
