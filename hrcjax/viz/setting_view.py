"""One setting beside another: the paths from above; speed, separation and clearance over time."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcjax.viz.path_view import Obstacles, PathLine, PersonPoses, plan_view
from hrcjax.viz.style import BEST, heading, label, new_figure, tidy

OTHER = "#a3a8b0"


def setting_view(
    tool: Float[np.ndarray, "time 3"],
    other: Float[np.ndarray, "time 3"],
    curves: Mapping[tuple[str, str], tuple[Float[np.ndarray, "time"], Float[np.ndarray, "time"]]],
    time: Float[np.ndarray, "time"],
    names: tuple[str, str],
    obstacles: Obstacles | None = None,
    person: PersonPoses | None = None,
    start: Float[np.ndarray, "3"] | None = None,
    goal: Float[np.ndarray, "3"] | None = None,
    title: str = "",
) -> tuple[Figure, list[Axes]]:
    """The way of the tool in blue, that of the other setting thin and grey; beside it the curves of both.

    Args:
        tool, other: [m].
        curves: name and unit -> values of this and of the other setting over time; not finite: not drawn.
        names: of this and of the other setting.
    """
    figure = new_figure(11.5, 4.8)
    grid = figure.add_gridspec(max(len(curves), 1), 2, width_ratios=[1.0, 1.15])
    above = figure.add_subplot(grid[:, 0])
    lines = [PathLine(other, names[1], OTHER), PathLine(tool, names[0], BEST)]
    plan_view(lines, obstacles, person, start, goal, axes=above)
    above.legend(fontsize=7.5, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.12), frameon=False)
    panels: list[Axes] = []
    for k, ((name, unit), (values, others)) in enumerate(curves.items()):
        axes = figure.add_subplot(grid[k, 1], sharex=panels[0] if panels else None)
        for numbers, colour, width in ((others, OTHER, 1.2), (values, BEST, 1.8)):
            axes.plot(time, np.where(np.isfinite(numbers), numbers, np.nan), color=colour, lw=width)
        axes.set_ylabel(label(name, unit), fontsize=8)
        axes.axhline(0, color="#30343b", lw=0.6)
        axes.grid(alpha=0.25)
        axes.tick_params(labelbottom=k == len(curves) - 1)
        tidy(axes)
        panels.append(axes)
    if panels:
        panels[-1].set_xlabel("time [s]")
    heading(figure, title)
    return figure, [above, *panels]
