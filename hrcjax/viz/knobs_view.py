"""Small multiples: how the path from above and the speed over time change along each swept parameter."""

from collections.abc import Sequence
from textwrap import fill
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from hrcjax.viz.path_view import Obstacles, PathLine, PersonPoses, capsule_outline, draw_ends, draw_obstacles, window
from hrcjax.viz.style import BEST, COLOUR_MAP, OBSTACLE, TEXT, WORST, heading, new_figure, number, tidy

BASE = "#a3a8b0"
"""The path and the speed of the setting from which every row starts."""
PERSON = "#efdcea"
"""The person, opaque, so that capsules that overlap look like one body."""
MARGIN, ASIDE = 0.06, 0.16
"""Around the paths, and beyond that on the side of the person [m]."""


class KnobRow(NamedTuple):
    """Settings that differ in one parameter alone, in ascending order."""

    symbol: str
    meaning: str
    """In a few words."""
    values: Float[np.ndarray, "column"]
    tool: Float[np.ndarray, "column time 3"]
    """Ways of the tool [m]."""
    speed: Float[np.ndarray, "column time"]
    """[m/s]."""
    arrival: Float[np.ndarray, "column"]
    """Time to the goal [s]."""
    fault: Sequence[str]
    """Why a setting failed; empty where it succeeded."""
    base: int
    """The column that all rows have in common."""
    notes: Sequence[str] = ()
    """A few words below each value; empty: none."""


def knobs_view(
    rows: Sequence[KnobRow],
    time: Float[np.ndarray, "time"],
    obstacles: Obstacles | None = None,
    person: PersonPoses | None = None,
    start: Float[np.ndarray, "3"] | None = None,
    goal: Float[np.ndarray, "3"] | None = None,
    title: str = "",
) -> tuple[Figure, list[list[Axes]]]:
    """For each parameter a row of paths from above, coloured by speed, and below it the speed over time.

    The common setting is drawn thin and grey behind all others.

    Args:
        person: drawn where they are at the given times.

    Returns:
        The figure, and for each parameter its axes: those of the paths, then those of the speeds.
    """
    columns = max(len(row.values) for row in rows)
    low, high = window(
        [PathLine(way, "") for row in rows for way in row.tool], obstacles, start, goal, person, MARGIN, ASIDE
    )
    shape = (high[1] - low[1]) / (high[0] - low[0])
    width = 2.25
    figure = new_figure(width * columns + 2.2, len(rows) * (width * shape + 1.35) + 1.0)
    grid = figure.subplots(
        2 * len(rows), columns, squeeze=False, gridspec_kw={"height_ratios": [width * shape, 0.8] * len(rows)}
    )
    fastest = max(float(np.nanmax(row.speed)) for row in rows)
    norm = Normalize(0, fastest)
    last = max(float(row.arrival.max()) for row in rows)
    drawn = []
    for r, row in enumerate(rows):
        upper, lower = list(grid[2 * r]), list(grid[2 * r + 1])
        for c in range(columns):
            if c >= len(row.values):
                upper[c].set_visible(False)
                lower[c].set_visible(False)
                continue
            _paths(upper[c], row, c, norm, obstacles, person, start, goal)
            upper[c].set_xlim(low[0], high[0])
            upper[c].set_ylim(low[1], high[1])
            _speeds(lower[c], row, c, time)
            lower[c].set_xlim(0, 1.04 * last)
            lower[c].set_ylim(0, 1.18 * fastest)
            if c > 0:
                upper[c].tick_params(labelleft=False)
                lower[c].tick_params(labelleft=False)
        upper[0].set_xlabel("x [m]", fontsize=8, labelpad=1)
        upper[0].set_ylabel("y [m]", fontsize=8)
        size = 20 if len(row.symbol) < 3 or row.symbol.startswith("$") else 12
        for text, height, points, side in (
            (fill(row.symbol, 14), 0.56, size, "bottom"),
            (fill(row.meaning, 18), 0.5, 8.5, "top"),
        ):
            upper[0].annotate(
                text, (-0.34, height), xycoords="axes fraction", ha="right", va=side, fontsize=points, color=TEXT
            )
        lower[0].set_ylabel("speed [m/s]", fontsize=8)
        drawn.append(upper[: len(row.values)] + lower[: len(row.values)])
    for axes in drawn[-1][len(rows[-1].values) :]:
        axes.set_xlabel("time [s]", fontsize=8)
    bar = figure.colorbar(_mappable(norm), ax=grid.ravel().tolist(), fraction=0.012, pad=0.01, aspect=40)
    bar.set_label("speed of the tool [m/s]", fontsize=9)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]  # a spine, whatever its type says
    figure.legend(handles=_legend(obstacles, person), loc="outside lower center", ncols=6, frameon=False, fontsize=9)
    heading(figure, title)
    return figure, drawn


def _mappable(norm: Normalize) -> LineCollection:
    return LineCollection([], cmap=colormaps[COLOUR_MAP], norm=norm)


def _legend(obstacles: Obstacles | None, person: PersonPoses | None) -> list[Line2D]:
    marks = [Line2D([], [], color=BASE, lw=1.5, label="the setting that all rows share")]
    if obstacles is not None:
        marks.append(Line2D([], [], color=OBSTACLE, marker="o", ls="", markersize=9, label="obstacle"))
    if person is not None:
        when = ", ".join(f"{time:.1f}" for time in person.times)
        marks.append(Line2D([], [], color=PERSON, marker="o", ls="", markersize=9, label=f"person at {when} s"))
    return marks


def _paths(
    axes: Axes,
    row: KnobRow,
    column: int,
    norm: Normalize,
    obstacles: Obstacles | None,
    person: PersonPoses | None,
    start: np.ndarray | None,
    goal: np.ndarray | None,
) -> None:
    """One path among obstacles and the person."""
    if person is not None:
        for a, b in zip(person.a, person.b, strict=True):
            for k in np.flatnonzero(person.radius > 0):
                outline = capsule_outline(a[k, :2], b[k, :2], float(person.radius[k]))
                axes.add_patch(Polygon(outline, facecolor=PERSON, edgecolor="none", zorder=1))
    if obstacles is not None:
        draw_obstacles(axes, obstacles)
    base, way = row.tool[row.base], row.tool[column]
    axes.plot(base[:, 0], base[:, 1], color=BASE, lw=1.5, zorder=4)
    axes.plot(way[:, 0], way[:, 1], color=TEXT, lw=4.2, solid_capstyle="round", zorder=5)
    pieces = np.stack([way[:-1, :2], way[1:, :2]], axis=1)
    colours = LineCollection(list(pieces), cmap=colormaps[COLOUR_MAP], norm=norm, linewidths=3.0, zorder=6)
    colours.set_array((row.speed[column][:-1] + row.speed[column][1:]) / 2)
    axes.add_collection(colours, autolim=False)
    draw_ends(axes, start, goal, 6.0)
    axes.set_aspect("equal")
    fault = row.fault[column]
    star = "★ " if column == row.base else ""
    axes.set_title(f"{star}{row.symbol} = {number(float(row.values[column]))}", fontsize=10, pad=15 if row.notes else 6)
    if row.notes:
        axes.text(
            0.5, 1.02, row.notes[column], transform=axes.transAxes, fontsize=7.5, color=TEXT, ha="center", va="bottom"
        )
    tidy(axes)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.2)
    if column == row.base:
        axes.title.set_fontweight("bold")
    if fault:
        box = {"facecolor": "white", "edgecolor": WORST, "alpha": 0.9, "pad": 1.5, "linewidth": 0.6}
        axes.text(
            0.97,
            0.96,
            fill(fault, 24),
            transform=axes.transAxes,
            fontsize=7,
            color=WORST,
            ha="right",
            va="top",
            zorder=9,
            bbox=box,
        )


def _speeds(axes: Axes, row: KnobRow, column: int, time: np.ndarray) -> None:
    """The speed over time, with the time of arrival."""
    axes.plot(time, row.speed[row.base], color=BASE, lw=1.2)
    axes.fill_between(time, row.speed[column], color=BEST, alpha=0.15, linewidth=0)
    axes.plot(time, row.speed[column], color=BEST, lw=1.5)
    if not row.fault[column]:
        when = float(row.arrival[column])
        axes.axvline(when, color=TEXT, lw=0.9, ls=":")
        axes.annotate(
            f"{when:.1f} s", (when, 0.98), (-3, 0), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha="right", va="top", fontsize=7.5, color=TEXT,
        )  # fmt: skip
    tidy(axes)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.2)
