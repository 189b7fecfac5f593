"""Figures of a tuning: losses, parameters, gradients, slices, before and after."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.lab.atomic import replace_file
from hrcjax.viz.style import (
    BEST,
    COLOUR_MAP,
    GRID,
    KNOB_COLOURS,
    START,
    TEXT,
    WORST,
    as_row,
    finite_range,
    heading,
    label,
    new_figure,
    tidy,
)  # fmt: skip

from .optimiser import History
from .problem import Problem
from .slices import Slices, parameter_units

COLUMNS = 3


def _colour(k: int) -> str:
    return KNOB_COLOURS[k % len(KNOB_COLOURS)]


def _grid(count: int, height: float = 2.8) -> tuple[Figure, list]:
    rows = -(-count // COLUMNS)
    figure = new_figure(12.0, max(height * rows, 3.2))
    axes = as_row(figure.subplots(rows, min(count, COLUMNS), squeeze=False))
    for unused in axes[count:]:
        unused.set_visible(False)
    return figure, axes[:count]


def losses_figure(history: History, problem: Problem, best: int) -> Figure:
    """The loss of every start and the terms of the best one, by step."""
    figure, axes = _grid(1 + len(problem.losses))
    for k in range(history["loss"].shape[1]):
        axes[0].plot(
            history["loss"][:, k], color=BEST if k == best else GRID, lw=2 if k == best else 1, label=f"start {k}"
        )
    axes[0].set(ylabel="loss [1]", title="weighted sum, minibatch")
    for n, loss in enumerate(problem.losses):
        axes[n + 1].plot(history["terms"][:, best, n], color=_colour(n))
        axes[n + 1].set(ylabel=f"{loss.name} [{loss.unit}]", title=f"weight {problem.weights[n]:g}")
    return _finished(figure, axes, "Loss and its terms")


def parameters_figure(history: History, problem: Problem, best: int) -> Figure:
    """Every parameter by step, of every start."""
    figure, axes = _grid(len(problem.chosen.names))
    for n, name in enumerate(problem.chosen.names):
        for k in range(history["values"].shape[1]):
            axes[n].plot(history["values"][:, k, n], color=BEST if k == best else GRID, lw=2 if k == best else 1)
        axes[n].set(ylabel=name, yscale=_scale(problem, n))
    return _finished(figure, axes, "Parameters, the chosen start in blue")


def gradients_figure(history: History) -> Figure:
    """The norm of the gradient by step."""
    figure, axes = _grid(1)
    norms = np.linalg.norm(history["gradient"], axis=-1)
    for k in range(norms.shape[1]):
        axes[0].plot(norms[:, k], color=_colour(k), label=f"start {k}")
    if (norms > 0).any():
        axes[0].set_yscale("log")
    axes[0].set(ylabel="norm of the gradient [1]")
    axes[0].legend(fontsize=8)
    return _finished(figure, axes, "Gradient of the loss by the coordinates")


def before_after_figure(metrics: Mapping[str, Mapping[str, NDArray]], problem: Problem) -> Figure:
    """Every metric in every world, before and after; a point each world."""
    figure, axes = _grid(len(problem.units))
    for axis, (name, (unit, better)) in zip(axes, problem.units.items(), strict=True):
        for (section, found), colour in zip(metrics.items(), (BEST, WORST), strict=False):
            axis.plot(found[name][0], found[name][1], "o", color=colour, ms=5, alpha=0.8, label=section)
        ends = np.array([axis.get_xlim(), axis.get_ylim()])
        span = (ends.min(), ends.max())
        axis.plot(span, span, color=TEXT, lw=0.8, ls=":")
        axis.set(xlabel="before", ylabel="after", title=f"{name} [{unit}], {better} is better")
        axis.title.set_fontsize(9)
    axes[0].legend(fontsize=8)
    return _finished(figure, axes, "Before and after, a point each world", steps=False)


def slices_figure(slices: Slices, problem: Problem) -> Figure:
    """Loss and exact score along each parameter alone, the start and the tuned value marked."""
    count, rows = len(problem.chosen.names), _known((slices.loss, "loss [1]"), (slices.score, "sound score [1]"))
    figure = new_figure(4.0 * max(count, 2), 2.8 * len(rows) + 0.4)
    axes = figure.subplots(len(rows), count, squeeze=False)
    labels = _parameter_labels(problem)
    for row, (values, what) in enumerate(rows):
        for n, axis in enumerate(axes[row]):
            axis.plot(slices.values[n], values[n], "o-", color=_colour(n), ms=3)
            axis.axvline(slices.start[n], color=START, ls="--", lw=1, label="start")
            axis.axvline(slices.values[n, slices.values.shape[1] // 2], color=BEST, lw=1, label="tuned")
            axis.set(xlabel=labels[n], ylabel=what, xscale=_ratio_scale(slices.values[n]))
        axes[row, 0].legend(fontsize=8)
    title = "One parameter changed, the others tuned"
    return _finished(figure, list(axes.flat), title, steps=False)


def map_figure(slices: Slices, problem: Problem) -> Figure:
    """Loss and exact score over the two parameters along whose slices the loss changes most."""
    panels = _known((slices.map_loss, "loss [1]"), (slices.map_score, "sound score [1]"))
    figure = new_figure(5.6 * len(panels) + 0.8, 4.6)
    axes = as_row(figure.subplots(1, len(panels), squeeze=False))
    labels, (i, k), middle = _parameter_labels(problem), slices.pair, slices.sides.shape[1] // 2
    for axis, (values, what) in zip(axes, panels, strict=True):
        low, high = finite_range(values)
        shown = axis.pcolormesh(*slices.sides, values.T, cmap=COLOUR_MAP, vmin=low, vmax=high, shading="nearest")
        figure.colorbar(shown, ax=axis, label=what)
        axis.plot(slices.start[i], slices.start[k], "o", color=START, mec="white", label="start")
        axis.plot(*slices.sides[:, middle], "*", color="white", mec=TEXT, ms=12, label="tuned")
        scales = [_ratio_scale(side) for side in slices.sides]
        axis.set(xlabel=labels[i], ylabel=labels[k], xscale=scales[0], yscale=scales[1])
    axes[0].legend(fontsize=8)
    title = "Two parameters changed, the others tuned"
    return _finished(figure, list(axes), title, steps=False)


def _known(*panels: tuple[NDArray, str]) -> list[tuple[NDArray, str]]:
    """The first panel, and those with any finite value."""
    return [panel for k, panel in enumerate(panels) if k == 0 or np.isfinite(panel[0]).any()]


def _parameter_labels(problem: Problem) -> list[str]:
    return [label(name, unit) for name, unit in zip(problem.chosen.names, parameter_units(problem), strict=True)]


def _scale(problem: Problem, n: int) -> str:
    bounds = problem.chosen.bounds[n]
    return "log" if bounds.low > 0 and bounds.high > 10 * bounds.low else "linear"


def _ratio_scale(x: NDArray) -> str:
    return "log" if x[0] > 0 and x[-1] > 10 * x[0] else "linear"


def _finished(figure: Figure, axes: list, title: str, steps: bool = True) -> Figure:
    for axis in axes:
        if steps:
            axis.set_xlabel("step")
        axis.grid(color=GRID, lw=0.5)
        tidy(axis)
    heading(figure, title)
    return figure


def draw(
    folder: Path,
    history: History,
    metrics: Mapping[str, Mapping[str, NDArray]],
    problem: Problem,
    best: int,
    slices: Slices | None = None,
) -> None:
    """All figures as PNG files."""
    folder.mkdir(parents=True, exist_ok=True)
    made = {"before_after": before_after_figure(metrics, problem)}
    if history:
        made |= {
            "losses": losses_figure(history, problem, best),
            "parameters": parameters_figure(history, problem, best),
            "gradients": gradients_figure(history),
        }
    if slices is not None:
        made["slices"] = slices_figure(slices, problem)
        if slices.map_loss.size:
            made["map"] = map_figure(slices, problem)
    for name, figure in made.items():
        replace_file(folder / f"{name}.png", lambda path, f=figure: f.savefig(path, dpi=120, format="png"))
