"""Figures of a run: the best true training score over compute, and the scores in the held-out worlds."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.lab.atomic import replace_file
from hrcjax.viz.style import BEST, GOAL, GRID, KNOB_COLOURS, PERSON, PLAN, heading, new_figure, tidy

from .compare import known, ranked
from .results import Found

COLOURS = {
    "gradient": BEST, "quasi_newton": PLAN, "random": KNOB_COLOURS[4], "cma_es": KNOB_COLOURS[1], "sweep": KNOB_COLOURS[2],
    "defaults": GOAL, "random_smooth": PERSON, "cma_smooth": KNOB_COLOURS[3],
}  # fmt: skip


def best_so_far(ways: Sequence[NDArray], spent: NDArray) -> NDArray:
    """Best score (seed, point) at given compute; NaN before the first one."""
    rows = []
    for at, score in ways:
        place = np.searchsorted(at, spent, side="right") - 1
        rows.append(np.where(place >= 0, score[np.maximum(place, 0)], np.nan))
    return np.stack(rows)


def progress_figure(found: Found) -> Figure:
    """Best true training score so far over compute: median over seeds, and their range."""
    figure = new_figure(9.0, 5.5)
    axes = figure.subplots()
    for method in ranked(found.scores):
        ways = [one.way for one in found.entries[method]]
        colour = COLOURS.get(method, GOAL)
        if method == "defaults":
            axes.axhline(float(ways[0][1][-1]), color=colour, lw=1, ls=":", label=method)
            continue
        spent = np.unique(np.concatenate([way[0] for way in ways]))
        scores = best_so_far(ways, spent)
        spent, scores = spent[np.isfinite(scores).all(axis=0)], scores[:, np.isfinite(scores).all(axis=0)]
        if len(spent):
            axes.step(spent, np.median(scores, axis=0), where="post", color=colour, lw=1.8, label=method)
            axes.fill_between(spent, scores.min(axis=0), scores.max(axis=0), step="post", color=colour, alpha=0.15, lw=0)  # fmt: skip
    axes.set(xscale="log", xlabel="compute spent [forward episodes]", ylabel="best true training score so far [1]")
    axes.grid(color=GRID, lw=0.5)
    axes.legend(fontsize=8)
    tidy(axes)
    heading(figure, "Training score over compute: median and range over seeds")
    return figure


def held_out_figure(found: Found) -> Figure:
    """Held-out score of every method in every world, mean over seeds."""
    order = ranked(found.scores)
    figure = new_figure(9.0, 1.8 + 0.3 * len(found.worlds))
    axes = figure.subplots()
    place = np.arange(len(found.worlds))
    for k, method in enumerate(order):
        shift = 0.6 * (k / max(len(order) - 1, 1) - 0.5)
        scores = known(found.scores[method]).mean(axis=0)
        axes.plot(scores, place - shift, "o", ms=5, color=COLOURS.get(method, GOAL), label=method)
    axes.set_yticks(place, found.worlds, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("score in a held-out world [1]")
    axes.grid(color=GRID, lw=0.5)
    axes.legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False)
    tidy(axes)
    heading(figure, "Held-out worlds, mean over seeds of the method")
    return figure


def draw(folder: Path, found: Found) -> list[str]:
    """Both figures as PNG files; name and content of each."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in (("progress.png", progress_figure(found)), ("held_out.png", held_out_figure(found))):
        replace_file(folder / name, lambda path, f=figure: f.savefig(path, dpi=130, format="png"))
    return [
        "`progress.png`, best true training score so far over compute (methods on the smooth loss did not know it on their way: "
        "some of their settings are measured for the figure, outside of their compute)",
        "`held_out.png`, scores in every held-out world",
    ]
