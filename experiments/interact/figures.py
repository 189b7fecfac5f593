"""Figures: tool and hand over time, distance and zone of one run of every function, beside the function switched off."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.viz.style import BEST, OBSTACLE, PERSON, WORST, ZONE_COLOURS, ZONE_NAMES, new_figure, tidy

from .bench import POSE, VARIANTS
from .measures import Case, errors, limited, steps, wanted, way_back
from .people import GIVES_UP

AXES = ("x", "y", "z")


def times(case: Case, dt: float) -> NDArray:
    """(tick) [s]"""
    return np.arange(len(case["tool"])) * dt


def zones(axes: Axes, case: Case, dt: float, level: float, height: float) -> None:
    """The zones of the safety layer as a coloured band."""
    t, zone = times(case, dt), case["zone"]
    cuts = np.flatnonzero(np.diff(zone)) + 1
    for a, b in zip([0, *cuts], [*cuts, len(zone)], strict=True):
        axes.fill_between(
            [t[a], t[min(b, len(t) - 1)]], level, level + height, color=ZONE_COLOURS[int(zone[a])], linewidth=0
        )


def tool_over_time(axes: Axes, case: Case, where: NDArray, dt: float, what: str) -> None:
    """The tool's coordinates, and where it should be."""
    t = times(case, dt)
    for k, colour in enumerate((BEST, WORST, ZONE_COLOURS[0])):
        axes.plot(t, case["tool"][:, k], color=colour, linewidth=1.3, label=f"tool {AXES[k]}")
        axes.plot(t, where[:, k], "--", color=colour, linewidth=0.9, label=f"{what} {AXES[k]}")
    axes.set(xlabel="t [s]", ylabel="position [m]")
    axes.legend(fontsize=7, ncols=3, loc="upper left", bbox_to_anchor=(0, 1.28), frameon=False)
    tidy(axes)


def distances(axes: Axes, on: Case, off: Case | None, dt: float, of: Callable[[Case], NDArray], name: str, line: float | None) -> None:  # fmt: skip
    """A distance with the function on and off, the zones of both as bands below."""
    t, top = times(on, dt), 1.2
    for case, colour, text, level in ((on, BEST, "on", -0.06), (off, OBSTACLE, "off", -0.12)):
        if case is not None:
            axes.plot(t, np.minimum(of(case), top), color=colour, linewidth=1.3, label=text)
            zones(axes, case, dt, level, 0.05)
    if line is not None:
        axes.axhline(line, color=PERSON, linewidth=1, linestyle="--", label="set")
    for zone_name, colour in zip(ZONE_NAMES, ZONE_COLOURS, strict=True):
        axes.fill_between([], [], color=colour, label=zone_name)
    axes.axhline(0, color=ZONE_COLOURS[2], linewidth=0.8)
    axes.set(xlabel="t [s]", ylabel=f"{name} [m]", ylim=(-0.14, top))
    axes.legend(fontsize=7, ncols=4, loc="upper left", bbox_to_anchor=(0, 1.28), frameon=False)
    tidy(axes)


def error_over_time(axes: Axes, on: Case, direction: NDArray, dt: float, name: str, bar: float, top: float) -> None:
    """The error beside the true hand."""
    axes.plot(times(on, dt), np.minimum(100 * errors(name, on, direction), top), color=BEST, linewidth=1.3)
    axes.axhline(bar, color=WORST, linewidth=1, linestyle="--")
    axes.set(xlabel="t [s]", ylabel="error of the tool [cm]", ylim=(0, top))
    tidy(axes)


def hand_figure(
    name: str, cases: Mapping[str, Mapping[str, Case]], person: str, direction: NDArray, dt: float
) -> Figure:
    """Follow or hand over beside one hand."""
    on, off = cases[name][person], cases.get(f"{VARIANTS[name].function}_off", {}).get(person)
    figure = new_figure(14.0, 3.8)
    left, middle, right = figure.subplots(1, 3)
    tool_over_time(left, on, wanted(name, on, direction), dt, "place")
    distances(
        middle, on, off, dt, lambda case: case["separation_true"], "exact distance of the arm", VARIANTS[name].distance
    )
    bar, top = (3.0, 12.0) if VARIANTS[name].function == "follow" else (2.0, 12.0)
    error_over_time(right, on, direction, dt, name, bar, top)
    if VARIANTS[name].function == "hand_over":
        right.axvline(GIVES_UP, color=PERSON, linewidth=1, linestyle=":")
        right.text(GIVES_UP, top, " the hand goes", fontsize=7, va="top", color=PERSON)
    return figure


def give_way_figure(cases: Mapping[str, Mapping[str, Case]], person: str, dt: float) -> Figure:
    """The task and its resume."""
    on, off = cases["give_way"][person], cases.get("give_way_off", {}).get(person)
    figure = new_figure(14.0, 3.8)
    left, middle, right = figure.subplots(1, 3)
    tool_over_time(left, on, on["goal"], dt, "goal")
    distances(middle, on, off, dt, lambda case: case["separation_true"], "exact distance of the arm", None)
    middle.plot(times(on, dt), on["active"], color=WORST, linewidth=0.9, linestyle=":")
    middle.text(
        times(on, dt)[-1], on["active"][-1], "share of\nthe refuge", fontsize=7, color=WORST, ha="right", va="bottom"
    )
    for case, colour, text in ((off, OBSTACLE, "off"), (on, BEST, "on")):
        if case is not None:
            t, a, back = times(case, dt), steps(case, dt)[0] / dt, way_back(case) & ~limited(case)
            right.plot(t, np.maximum(a, 1e-3), color=colour, linewidth=0.7, label=f"{text}, all")
            right.plot(t[back], np.maximum(a, 1e-3)[back], ".", color=colour, markersize=3, label=f"{text}, way back")
    right.set(xlabel="t [s]", ylabel="acceleration of the tool [m/s²]", yscale="log")
    right.axhline(1.0, color=WORST, linewidth=1, linestyle="--")
    right.legend(fontsize=7, ncols=2, loc="upper left", bbox_to_anchor=(0, 1.2), frameon=False)
    tidy(right)
    return figure


def keep_away_figure(cases: Mapping[str, Mapping[str, Case]], person: str, kept: float, dt: float) -> Figure:
    """The tool's distance and place."""
    on, off = cases["keep_away"][person], cases.get("keep_away_off", {}).get(person)
    figure = new_figure(14.0, 3.8)
    left, middle, right = figure.subplots(1, 3)
    tool_over_time(left, on, np.broadcast_to(np.asarray(POSE), on["tool"].shape), dt, "pose")
    distances(middle, on, off, dt, lambda case: case["tool_distance"], "exact distance of the tool", kept)
    for case, colour, text in ((off, OBSTACLE, "off"), (on, BEST, "on")):
        if case is not None:
            right.plot(times(case, dt), 100 * np.linalg.norm(case["tool"] - np.asarray(POSE), axis=1), color=colour, linewidth=1.3, label=text)  # fmt: skip
    right.set(xlabel="t [s]", ylabel="distance of the tool from its pose [cm]")
    right.legend(fontsize=7)
    tidy(right)
    return figure


def draw(
    folder: Path, cases: Mapping[str, Mapping[str, Case]], directions: Mapping[str, NDArray], dt: float
) -> list[str]:
    """Draws a figure of every variant that is on, of its first person; their names."""
    from hrcjax.interact import KeepDistanceParams

    folder.mkdir(parents=True, exist_ok=True)
    names = []
    for name, runs in cases.items():
        if not VARIANTS[name].on or not runs:
            continue
        person, function = next(iter(runs)), VARIANTS[name].function
        if function == "give_way":
            figure = give_way_figure(cases, person, dt)
        elif function == "keep_away":
            figure = keep_away_figure(cases, person, KeepDistanceParams().distance, dt)
        else:
            figure = hand_figure(name, cases, person, directions[name], dt)
        figure.savefig(folder / f"{name}.png", dpi=90)
        names.append(f"{name}.png")
    return names
