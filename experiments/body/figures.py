"""Figures: wrists over time with their uncertainty, and errors by person."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from hrcjax.lab.atomic import replace_file
from hrcjax.lab.case_store import Case
from hrcjax.viz.style import BEST, TEXT, WORST, heading, new_figure, tidy

from .rows import errors

WRISTS = {"left wrist": 7, "right wrist": 8}


def track_figure(name: str, case: Case) -> Figure:
    """Height of both wrists, exact and fitted, with the error of the fit and what it says of itself."""
    figure = new_figure(9.0, 5.0)
    heading(figure, f"Wrists of {name}: exact, and as fitted to the points")
    above, below = figure.subplots(2, 1, sharex=True)
    t, tracked = case["stamps"], case["tracked"].astype(bool)
    for (word, joint), colour in zip(WRISTS.items(), (BEST, WORST), strict=True):
        fitted = np.where(tracked, case["joints"][:, joint, 1], np.nan)
        above.plot(t, case["true_joints"][:, joint, 1], color=TEXT, linewidth=0.8, linestyle=":")
        above.plot(t, fitted, color=colour, linewidth=1, label=word)
        off = np.linalg.norm(case["joints"][:, joint] - case["true_joints"][:, joint], axis=-1)
        below.plot(t, 100 * np.where(tracked, off, np.nan), color=colour, linewidth=1)
        spread = np.where(tracked, case["place_deviation"][:, joint], np.nan)
        below.plot(t, 100 * spread, color=colour, linewidth=0.8, linestyle="--")
    above.set_ylabel("distance before the base [m]")
    above.legend(frameon=False, fontsize=8)
    below.set(xlabel="time [s]", ylabel="error, dashed: its\nstandard deviation [cm]", yscale="log")
    tidy(above)
    tidy(below)
    return figure


def error_figure(cases: Mapping[str, Case]) -> Figure:
    """Median and 95th percentile of the errors of arms and hands, by person."""
    figure = new_figure(8.0, 0.4 * len(cases) + 1.6)
    heading(figure, "Surfaces of arms and hands: visible places")
    axes = figure.add_subplot()
    for k, case in enumerate(cases.values()):
        some = 100 * errors(case, "visible")
        if len(some):
            low, middle, high = np.percentile(some, [5, 50, 95])
            axes.plot([low, high], [k, k], color=BEST, linewidth=2)
            axes.plot(middle, k, "o", color=WORST)
    axes.set_yticks(range(len(cases)), list(cases))
    axes.axvline(2.5, color=TEXT, linewidth=0.8, linestyle=":")
    axes.axvline(6.0, color=TEXT, linewidth=0.8, linestyle="--")
    axes.set(xscale="log", xlabel="distance to the fitted surface: median, 5 to 95 %; bars at 2.5 and 6 [cm]")
    tidy(axes)
    return figure


def draw(folder: Path, cases: Mapping[str, Case]) -> list[str]:
    """Figures into the folder; their names."""
    folder.mkdir(parents=True, exist_ok=True)
    name, case = next(iter(cases.items()))
    figures = {"track.png": track_figure(name, case), "errors.png": error_figure(cases)}
    for file, figure in figures.items():
        replace_file(folder / file, lambda path, figure=figure: figure.savefig(path, dpi=110, format="png"))
    return list(figures)
