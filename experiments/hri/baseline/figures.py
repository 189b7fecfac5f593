"""Figures of a run: the tool's way, and its speed and distances over time."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from hrcjax.viz.style import COLOUR_MAP, new_figure, tidy

from .episode import Trace

MARKS = {"stop": "tab:red", "start": "tab:green", "arrived": "black", "failed": "tab:orange", "outdated": "tab:purple"}
"""Colours of events."""


def run_figure(trace: Trace, title: str) -> Figure:
    """The tool's way from above and from the front, coloured by time; over time its speed, the exact distance to the person, and
    that to the octree, with the events."""
    figure = new_figure(13, 6.5)
    parts = figure.subplot_mosaic([["above", "speed"], ["front", "distance"]], width_ratios=[1, 2])
    for name, (i, j), labels in (("above", (0, 1), ("x [m]", "y [m]")), ("front", (0, 2), ("x [m]", "z [m]"))):
        drawn = parts[name].scatter(trace.tool[:, i], trace.tool[:, j], c=trace.t, s=3, cmap=COLOUR_MAP)
        parts[name].set(xlabel=labels[0], ylabel=labels[1], aspect="equal")
        figure.colorbar(drawn, ax=parts[name], label="t [s]")
    speed = np.linalg.norm(np.gradient(trace.tool, trace.dt, axis=0), axis=1)
    parts["speed"].plot(trace.t, speed)
    parts["speed"].set(ylabel="speed of the tool [m/s]", title=title)
    parts["distance"].plot(trace.t, trace.separation, label="exact, to the person")
    parts["distance"].plot(trace.t, trace.known, label="known, to the octree")
    parts["distance"].set(xlabel="t [s]", ylabel="distance of the arm [m]", ylim=(-0.05, 0.8))
    for what, colour in MARKS.items():
        times = [event.t for event in trace.events if event.what == what]
        for part in ("speed", "distance"):
            top = parts[part].get_ylim()[1]
            parts[part].plot(times, np.full(len(times), 0.97 * top), "|", color=colour, markersize=12, label=what)
    for part in parts.values():
        tidy(part)
    parts["distance"].legend(loc="upper right", ncols=2, fontsize="small")
    return figure


def save_run(trace: Trace, title: str, file: Path) -> None:
    """Draws `run_figure` into a file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    run_figure(trace, title).savefig(file, dpi=90)
