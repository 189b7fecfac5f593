"""Figures of times: printed beside computed row by row, and all planners at one speed."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from hrcjax.viz.style import (
    BEST,
    GRID,
    KNOB_COLOURS,
    PLAN,
    TEXT,
    as_row,
    heading,
    new_figure,
    tidy,
)  # fmt: skip

from .fair import ARRIVAL, COMMON_SPEED
from .path_figures import COLOURS
from .paths import SCENE
from .printed import TIMES
from .rows import Cases, fair_of, our_times, told
from .rrt_star import STAGES


def times_figure(cases: Cases, readings: Sequence[str]) -> Figure:
    """Printed and computed times to goal of the improved field, row by row."""
    figure = new_figure(9.5, 8.2)
    axes = figure.subplots()
    place, ticks, names, last = 0.0, [], [], ""
    for one in TIMES:
        place += 0.6 if one.table != last else 0.0
        last = one.table
        axes.plot(one.iapf, place, "|", color=TEXT, ms=15, mew=2, label="printed" if not ticks else None)
        for k, reading in enumerate(readings):
            ours = our_times(cases, reading, one)["iapf"]
            axes.plot(
                np.nan if ours is None else ours,
                place,
                "o",
                color=KNOB_COLOURS[k],
                ms=5,
                label=reading if not ticks else None,
            )
        ticks.append(place)
        names.append(f"{one.table}: {one.label.split(';')[0]}")
        place += 1.0
    axes.set_yticks(ticks, names, fontsize=7.5)
    axes.invert_yaxis()
    axes.set_xlabel("time to goal of the improved field [s]")
    axes.grid(color=GRID, lw=0.5, axis="x")
    tidy(axes)
    axes.legend(fontsize=8, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    heading(figure, "Tables I to VII: printed and computed, in three readings of the obstacles")
    return figure


def speed_figure(cases: Cases, readings: Sequence[str]) -> Figure:
    """Printed times beside those at one speed, and RRT* over its iterations."""
    reading = told(readings)
    found = {one.key: one for one in fair_of(cases, reading)}
    printed = {"gda": SCENE.gda, "iapf": SCENE.iapf, "rrt": SCENE.rrt}
    figure = new_figure(12.0, 4.8)
    left, right = as_row(figure.subplots(1, 2, gridspec_kw={"width_ratios": [3, 2]}))
    names = [key for key in found if key in found]
    place = np.arange(len(names))
    left.barh(
        place + 0.2,
        [printed.get(key) or np.nan for key in names],
        0.36,
        color=PLAN,
        label="printed (table I, 4 obstacles)",
    )
    left.barh(place - 0.2, [found[key].time for key in names], 0.36, color=BEST, label="our path, at one speed")
    for at, key in zip(place, names, strict=True):
        left.text(found[key].time, at - 0.2, f" {found[key].time:.2f}", va="center", fontsize=7, color=TEXT)
        if printed.get(key):
            left.text(printed[key] or 0, at + 0.2, f" {printed[key]:.2f}", va="center", fontsize=7, color=TEXT)
    left.set_yticks(place, [found[key].name for key in names], fontsize=8)
    left.invert_yaxis()
    left.set_xlabel("time to goal [s]")
    left.legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=2, frameon=False)
    if f"rrt-long/{reading}" in cases:
        best = 100 * cases[f"rrt-long/{reading}"]["best"]
        for one in best:
            right.semilogx(STAGES, np.where(np.isfinite(one), one, np.nan), ".-", color=COLOURS["rrt"], lw=1, alpha=0.6)
        right.semilogx([], [], ".-", color=COLOURS["rrt"], label="RRT*, one search")
        right.axhline(100 * found["planned"].length, color=COLOURS["planned"], lw=1.5, label="planned")
        right.axhspan(
            *(100 * length for length in _printed_rrt()),
            color=PLAN,
            alpha=0.25,
            lw=0,
            label="printed times at one speed",
        )
        right.set(xlabel="iterations [1]", ylabel="length of the path [cm]")
        right.legend(fontsize=8)
    else:
        right.axis("off")
    for axes in (left, right):
        axes.grid(color=GRID, lw=0.5)
        axes.set_axisbelow(True)
        tidy(axes)
    heading(figure, f"Printed times measure the step; the paths at one speed, {reading}")
    return figure


def _printed_rrt() -> tuple[float, float]:
    """Lengths that the printed times of RRT* mean at the common speed [m]."""
    times = [one.rrt for one in TIMES if one.rrt is not None]
    return min(times) * COMMON_SPEED + ARRIVAL, max(times) * COMMON_SPEED + ARRIVAL
