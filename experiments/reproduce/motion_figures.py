"""Figures of the tool beside a person: motion over time, and zones."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.viz.style import (
    BEST,
    GRID,
    KNOB_COLOURS,
    PERSON,
    TEXT,
    WORST,
    ZONE_COLOURS,
    ZONE_NAMES,
    heading,
    new_figure,
    tidy,
)  # fmt: skip
from hrcjax.viz.zones_view import zones_view

from .episode import DT, arrival

JUMP = 2.0
"""The person's nearest point is drawn as moving up to this speed; faster, another part of the body is nearest [m/s]."""


def motion_figure(case: Mapping[str, NDArray]) -> Figure:
    """The tool's position, speed and acceleration, and the person's nearest point, without and with zones; zones in the background."""
    figure = new_figure(13.0, 9.5)
    time, ends = case["time"], [arrival(case, run) for run in (0, 1)]
    last = min(max(end for end in ends if np.isfinite(end)) + 0.5 if any(np.isfinite(ends)) else time[-1], time[-1])
    kept = time <= last
    grid = figure.subplots(4, 2, sharex=True, sharey="row")
    for run, title in enumerate(("without zones", "with zones")):
        moved = np.linalg.norm(np.gradient(case["person"][run], DT, axis=0), axis=1)
        moved = np.where(moved < JUMP, moved, np.nan)
        curves = (
            (("tool x", case["tool"][run, :, 0]), ("y", case["tool"][run, :, 1]), ("z", case["tool"][run, :, 2])),
            (("speed of the tool", case["speed"][run]), ("person's nearest point", moved)),
            (("acceleration of the tool", case["acceleration"][run]),),
            (("tool to person", case["separation"][run]),),
        )
        for axes, some, label in zip(
            grid[:, run], curves, ("position [m]", "speed [m/s]", "acceleration [m/s²]", "distance [m]"), strict=True
        ):
            _shade(axes, time[kept], case["zone"][run][kept])
            for (name, values), colour in zip(
                some, (BEST, WORST, KNOB_COLOURS[2]) if len(some) == 3 else (BEST, PERSON), strict=False
            ):
                axes.plot(time[kept], values[kept], color=colour, lw=1.4, label=name)
            if np.isfinite(ends[run]):
                axes.axvline(ends[run], color=TEXT, lw=0.8, ls=":")
            axes.grid(color=GRID, lw=0.5)
            tidy(axes)
            axes.legend(fontsize=7, loc="upper right")
            if run == 0:
                axes.set_ylabel(label, fontsize=9)
        grid[0, run].set_title(f"{title}: {ends[run]:.2f} s to the goal", fontsize=10, color=TEXT)
        grid[-1, run].set_xlabel("time [s]")
    grid[0, 0].set_xlim(0, last)
    heading(
        figure,
        f"A tool on its path beside a hand that reaches in ({case['reading']}); zones of the distance in their colours",
    )
    return figure


def _shade(axes: Axes, time: NDArray, zone: NDArray) -> None:
    """Zones as coloured stretches of time."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(zone)) + 1, [len(zone)]])
    for a, b in pairwise(edges):
        axes.axvspan(
            float(time[a]), float(time[min(b, len(time) - 1)]), color=ZONE_COLOURS[int(zone[a])], alpha=0.16, lw=0
        )


def zones_figure(case: Mapping[str, NDArray]) -> Figure:
    """Zones, distance and speed of both runs."""
    stop, yellow, green = case["thresholds"]
    ends = [arrival(case, run) for run in (0, 1)]
    kept = case["time"] <= min(max(ends) + 0.5, case["time"][-1])
    return zones_view(
        case["time"][kept], case["zone"][:, kept], case["separation"][:, kept], case["speed"][:, kept], ("no zones", "zones"), (WORST, BEST),
        {ZONE_NAMES[2]: float(yellow), ZONE_NAMES[1]: float(green), ZONE_NAMES[3]: float(stop)}, "Zones, distance of the tool to the person, and its speed along the path",
    )[0]  # fmt: skip
