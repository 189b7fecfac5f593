"""Figures of a run, from its stored cases."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hrcjax.lab.atomic import replace_file
from hrcjax.safety import SafetyParams, zone_thresholds
from hrcjax.viz.style import (
    BEST,
    GRID,
    OBSTACLE,
    PERSON,
    PLAN,
    TEXT,
    WORST,
    ZONE_COLOURS,
    ZONE_NAMES,
    as_row,
    heading,
    new_figure,
    tidy,
)

from .lost_time import lost_by_zone
from .rows import MAIN, TOWARDS, beside, joined, most, of
from .variants import VARIANTS

Case = Mapping[str, NDArray]
SHOWN = "reach_in"
"""The person of the figure over time."""
TELLS = {
    "zones": "zones",
    "off": "no safety layer",
    "tool": "tool's distance alone",
    "contact_stop": "stop before contact",
    "pfl": "power and force limiting",
    "pfl_reflected": "the same, reflected mass",
}
COORDINATES = (("x", BEST), ("y", WORST), ("z", PLAN))


def _shade(axes: Axes, t: NDArray, zone: NDArray) -> None:
    edges = np.flatnonzero(np.diff(zone, prepend=-1, append=-1))
    for first, last in zip(edges[:-1], edges[1:], strict=True):  # noqa: RUF007  # pairs of edges
        axes.axvspan(
            float(t[first]), float(t[min(last, len(t) - 1)]), color=ZONE_COLOURS[int(zone[first])], alpha=0.22, lw=0
        )


def zones_figure(case: Case, dt: float, safety: SafetyParams) -> Figure:
    """Position and speed of the tool, distance and hand of the person over time, without and with zones."""
    figure = new_figure(11, 9)
    grid = figure.subplots(4, 2, sharex=True, sharey="row")
    limits = zone_thresholds(safety)
    for column, (variant, words) in enumerate((("off", "without zones"), ("zones", "with zones"))):
        k = VARIANTS.index(variant)
        count = int(case["counts"][k].sum())
        t, zone, tool = dt * np.arange(count), case["zone"][k][:count], case["tool"][k][:count]
        speed = np.linalg.norm(np.gradient(tool, dt, axis=0), axis=1)
        rows = [axes for axes in grid[:, column]]
        for axes, values in ((rows[0], tool), (rows[3], case["hand"][:count])):
            for number, (name, colour) in enumerate(COORDINATES):
                axes.plot(t, values[:, number], color=colour, lw=1.6, label=name)
        rows[1].plot(t, speed, color=TEXT, lw=1.4, label="tool")
        if variant == "zones":
            rows[1].plot(
                t,
                np.minimum(case["speed_limit"][k][:count], 0.5),
                color=PERSON,
                lw=1.2,
                ls="--",
                label="limit of the nearest point (cut at 0.5)",
            )
        rows[2].plot(t, case["separation"][k][:count], color=PERSON, lw=1.8)
        for name, colour in zip(
            ("green", "yellow", "stop"), (ZONE_COLOURS[0], ZONE_COLOURS[1], ZONE_COLOURS[3]), strict=True
        ):
            rows[2].axhline(float(getattr(limits, name)), color=colour, lw=1.2, ls=":")
        rows[0].set_title(
            f"{words}: {float(case['time_to_goal'][k]):.2f} s, closest {100 * case['separation'][k][:count].min():.0f} cm",
            fontsize=10,
        )
        for axes in rows:
            if variant == "zones":
                _shade(axes, t, zone)
            axes.grid(color=GRID, lw=0.5)
            tidy(axes)
        rows[3].set_xlabel("time [s]")
    for axes, text in zip(
        grid[:, 0], ("tool [m]", "speed of the tool [m/s]", "distance to the person [m]", "left hand [m]"), strict=True
    ):
        axes.set_ylabel(text)
    grid[0, 0].legend(fontsize=8, loc="center right")
    grid[1, 1].legend(fontsize=8, loc="upper right", bbox_to_anchor=(1.0, 0.8))
    patches = [
        Patch(color=colour, alpha=0.4, label=name) for colour, name in zip(ZONE_COLOURS, ZONE_NAMES, strict=True)
    ]
    grid[3, 1].legend(handles=patches, ncols=4, fontsize=8, loc="upper right", bbox_to_anchor=(1.0, 0.9))
    heading(figure, f"Beside a person: {case['person']} in {case['scene']}")
    return figure


def productivity_figure(cases: Mapping[str, Case], dt: float) -> Figure:
    """Time lost to safety by zone, for every person and scene."""
    every = beside(cases, MAIN)
    figure = new_figure(10, 1.6 + 0.3 * len(every))
    axes = figure.subplots()
    off, k = VARIANTS.index("off"), VARIANTS.index("zones")
    place = np.arange(len(every))
    left, right = np.zeros(len(every)), np.zeros(len(every))
    lost = np.array([lost_by_zone(case, k, off, dt)[0] for case in every])
    for zone, name in enumerate(ZONE_NAMES):
        width = lost[:, zone]
        axes.barh(
            place, width, left=np.where(width >= 0, right, left), color=ZONE_COLOURS[zone], height=0.7, label=name
        )
        right, left = right + np.maximum(width, 0), left + np.minimum(width, 0)
    names = [
        f"{str(c['person']).removesuffix('.bvh')}, {c['scene']} {int(c['seed'])}{'' if c['success'][k] else ' (never arrives)'}"
        for c in every
    ]
    axes.set_yticks(place, names, fontsize=8)
    axes.invert_yaxis()
    axes.axvline(0, color=TEXT, lw=1)
    axes.set_xlabel("time lost against the run without zones [s]; negative: won")
    axes.grid(axis="x", color=GRID, lw=0.5)
    axes.legend(fontsize=8, title="zone", title_fontsize=8)
    tidy(axes)
    heading(figure, "Productivity lost to safety, by zone")
    return figure


def variants_figure(cases: Mapping[str, Case]) -> Figure:
    """Measures of all variants, a point for each episode."""
    every = beside(cases, MAIN)
    shown = (
        ("time to the goal [s]", lambda c, k: float(c["time_to_goal"][k])),
        ("paper's score [%]", lambda c, k: float(c["score_overall"][k])),
        ("paper's safety [%]", lambda c, k: float(c["score_safety"][k])),
        ("paper's efficiency [%]", lambda c, k: float(c["score_efficiency"][k])),
        ("sound score [1]", lambda c, k: float(c["score_sound"][k])),
        ("closest [m]", lambda c, k: float(c["separation"][k][c["counts"][k]].min())),
        ("excess of speed [m/s]", lambda c, k: most(c, "excess", k)),
        ("time below $S_p$ [s]", lambda c, k: float(c["time_below_sp"][k])),
    )
    figure = new_figure(13, 6.5)
    colours = (BEST, WORST, PLAN, PERSON, TEXT, OBSTACLE)
    for axes, (text, value) in zip(as_row(figure.subplots(2, 4)), shown, strict=True):
        for k, variant in enumerate(VARIANTS):
            found = np.array([value(case, k) for case in every])
            at = k + np.linspace(-0.25, 0.25, len(found))
            axes.plot(at, found, "o", ms=3, color=colours[k], alpha=0.7)
            axes.hlines(found.mean(), k - 0.35, k + 0.35, color=colours[k], lw=2)
            del variant
        if "excess" in text:
            axes.axhline(TOWARDS, color=TEXT, lw=0.8, ls=":")
            axes.set_ylim(-0.3, None)
        axes.set_xticks(range(len(VARIANTS)), [TELLS[v] for v in VARIANTS], rotation=35, ha="right", fontsize=7)
        axes.set_ylabel(text, fontsize=9)
        axes.grid(axis="y", color=GRID, lw=0.5)
        tidy(axes)
    heading(figure, "Every episode in six variants; lines: means")
    return figure


def chance_figure(cases: Mapping[str, Case]) -> Figure:
    """How near episodes by chance come to a violation."""
    parts = of(cases, "chance")
    excess, short, apart = (joined(parts, name) for name in ("excess", "short", "separation"))
    figure = new_figure(12, 3.8)
    left, middle, right = as_row(figure.subplots(1, 3))
    left.hist(np.clip(excess, -0.5, None), 80, color=BEST)
    left.axvline(TOWARDS, color=WORST, lw=1.5, label="violation from here on")
    left.set(xlabel="largest excess of speed in an episode [m/s]", ylabel="episodes")
    middle.hist(100 * np.clip(-short, None, 1.0), 80, color=BEST)
    middle.axvline(0, color=WORST, lw=1.5, label="no way to stop before C")
    middle.set(xlabel="least spare way to stop [cm]", ylabel="episodes")
    right.plot(apart, excess, ".", ms=2, color=BEST, alpha=0.5)
    right.axhline(TOWARDS, color=WORST, lw=1.5)
    right.set(
        xlabel="closest in the episode [m]", ylabel="largest excess of speed [m/s]", ylim=(-0.5, None), xlim=(None, 1.5)
    )
    for axes in (left, middle):
        axes.set_yscale("log")
        axes.legend(fontsize=8)
    for axes in (left, middle, right):
        axes.grid(color=GRID, lw=0.5)
        tidy(axes)
    heading(figure, f"{len(excess):,} episodes by chance")
    return figure


def draw(folder: Path, cases: Mapping[str, Case], dt: float, safety: SafetyParams) -> list[str]:
    """Draws what the cases tell; one line for each file."""
    folder.mkdir(parents=True, exist_ok=True)
    made: dict[str, tuple[Figure, str]] = {}
    every = beside(cases, MAIN)
    if every:
        chosen = next((case for case in every if str(case["person"]) == SHOWN), every[0])
        made["zones"] = (
            zones_figure(chosen, dt, safety),
            "position and speed of the tool, distance and hand of the person over time, without and with zones",
        )
        made["productivity"] = productivity_figure(cases, dt), "time lost to safety by zone, for every episode"
        made["variants"] = variants_figure(cases), "measures of every episode in six variants"
    if of(cases, "chance"):
        made["chance"] = chance_figure(cases), "how near episodes by chance come to a violation"
    lines = []
    for name, (figure, words) in made.items():
        replace_file(folder / f"{name}.png", lambda path, figure=figure: figure.savefig(path, dpi=110, format="png"))
        lines.append(f"`{name}.png`: {words}")
    return lines
