"""Zones, separation and speed over time."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from hrcjax.viz.style import BEST, TEXT, WORST, ZONE_COLOURS, ZONE_NAMES, heading, new_figure, tidy


def zones_view(
    time: Float[np.ndarray, "time"],
    zone: Int[np.ndarray, "run time"],
    separation: Float[np.ndarray, "run time"],
    speed: Float[np.ndarray, "run time"],
    names: Sequence[str],
    colours: Sequence[str] = (BEST, WORST),
    thresholds: Mapping[str, float] | None = None,
    title: str = "",
) -> tuple[Figure, list[Axes]]:
    """A strip of zones for each run, and below them the distance to the person and the speed of the tool.

    Values that are not finite are omitted from the curves.

    Args:
        names: of the runs, one for each row of the arrays.
        thresholds: zone -> distance at which it begins [m].

    Raises:
        ValueError: not one name for each run.
    """
    if len(names) != len(zone):
        raise ValueError(f"{len(names)} names for {len(zone)} runs; one for each is needed")
    figure = new_figure(9.5, 5.0 + 0.35 * len(names))
    strips, upper, lower = figure.subplots(
        3, 1, sharex=True, gridspec_kw={"height_ratios": [0.35 * len(names) + 0.1, 2, 1.6]}
    )
    colour_map = ListedColormap(ZONE_COLOURS)
    norm = BoundaryNorm(np.arange(-0.5, len(ZONE_COLOURS)), len(ZONE_COLOURS))
    step = float(time[1] - time[0]) if len(time) > 1 else 1.0
    edges = np.append(time, time[-1] + step)
    strips.pcolormesh(edges, np.arange(len(names) + 1), zone, cmap=colour_map, norm=norm)
    strips.hlines(np.arange(1, len(names)), time[0], edges[-1], color="white", lw=3)
    strips.set_yticks(np.arange(len(names)) + 0.5, names, fontsize=8)
    strips.invert_yaxis()
    strips.tick_params(length=0)
    strips.spines[:].set_visible(False)
    patches = [Patch(color=colour, label=name) for colour, name in zip(ZONE_COLOURS, ZONE_NAMES, strict=True)]
    strips.legend(handles=patches, ncols=4, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)
    strips.set_title("zone", fontsize=9, loc="left", color=TEXT)
    for axes, curves, text in ((upper, separation, "separation [m]"), (lower, speed, "speed [m/s]")):
        for n, name in enumerate(names):
            style = "-" if n < len(colours) else "--"
            shown = np.where(np.isfinite(curves[n]), curves[n], np.nan)
            axes.plot(time, shown, style, color=colours[n % len(colours)], lw=1.6, label=name)
        axes.set_ylabel(text)
        lowest = np.min(curves[np.isfinite(curves)], initial=0.0)
        axes.set_ylim(bottom=1.1 * lowest if lowest < 0 else 0)
        if lowest < 0:
            axes.axhline(0, color=TEXT, lw=0.8)
        axes.grid(alpha=0.25)
        tidy(axes)
    for name, distance in (thresholds or {}).items():
        colour = ZONE_COLOURS[ZONE_NAMES.index(name)] if name in ZONE_NAMES else TEXT
        upper.axhline(distance, color=colour, lw=1.0, ls=":")
        upper.annotate(name, (edges[-1], distance), fontsize=7, color=colour, va="bottom", ha="right")
    upper.legend(fontsize=8, loc="best", framealpha=0.9)
    lower.set_xlabel("time [s]")
    lower.set_xlim(time[0], edges[-1])
    heading(figure, title)
    return figure, [strips, upper, lower]
