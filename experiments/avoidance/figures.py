"""Figures of a run, from its stored cases."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.lab.atomic import replace_file
from hrcjax.viz.path_view import Obstacles, PathLine, plan_view
from hrcjax.viz.style import BEST, GRID, PLAN, TEXT, WORST, as_row, heading, new_figure, tidy

from .rows import ENOUGH

Case = Mapping[str, NDArray]
SHOWN = 6
"""Scenes in a figure."""
LINES = {"off": (WORST, "avoidance off"), "on": (BEST, "avoiding")}


def _shown(cases: Mapping[str, Case]) -> dict[str, Case]:
    """Scenes in which the arm would touch something without avoidance, at first; as many as fit."""
    order = sorted(cases, key=lambda name: float(cases[name]["clearance_off"]) >= 0)
    return {name: cases[name] for name in order[:SHOWN]}


def paths_figure(cases: Mapping[str, Case]) -> Figure:
    """The tool's ways from above around unknown obstacles, with and without avoidance."""
    figure = new_figure(12, 8.4)
    for axes, (name, case) in zip(as_row(figure.subplots(2, 3)), _shown(cases).items(), strict=False):
        solids = Obstacles(*(np.asarray(case[key]) for key in ("kind", "center", "size", "yaw", "mask")))
        ways = [PathLine(case[f"tool_{k}"], words, colour) for k, (colour, words) in LINES.items()]
        gaps = ", ".join(f"{words} {1e3 * float(case[f'clearance_{k}']):.0f} mm" for k, (_, words) in LINES.items())
        plan_view(ways, solids, None, case["start"], case["goal"], "", axes)
        axes.set_title(f"scene {name.split('/')[-1]}, least clearance:\n{gaps}", fontsize=8, color=TEXT)
    heading(figure, "The tool's way around obstacles that the planner does not know, from above")
    return figure


def clearance_figure(cases: Mapping[str, Case], dt: float) -> Figure:
    """Exact clearance of the arm over time, with and without avoidance."""
    figure = new_figure(12, 6)
    for axes, (name, case) in zip(as_row(figure.subplots(2, 3, sharey=True)), _shown(cases).items(), strict=False):
        for key, (colour, words) in LINES.items():
            gap = case[f"clearance_t_{key}"]
            known = np.flatnonzero(np.isfinite(gap))
            axes.plot(known * dt, 1e3 * gap[known], color=colour, lw=1.5, label=words)
        axes.axhline(0, color=TEXT, lw=1)
        axes.axhline(1e3 * ENOUGH, color=TEXT, lw=0.8, ls=":", label=f"{1e3 * ENOUGH:.0f} mm")
        axes.axhspan(-100, 0, color=WORST, alpha=0.12, lw=0)
        axes.set(title=f"scene {name.split('/')[-1]}", xlabel="time [s]", ylabel="clearance [mm]", ylim=(-100, 250))
        axes.grid(color=GRID, lw=0.5)
        tidy(axes)
    as_row(figure.axes)[0].legend(fontsize=8)
    heading(figure, "Clearance of the whole arm to obstacles that the planner does not know")
    return figure


def times_figure(cases: Mapping[str, Case]) -> Figure:
    """Times to the goal in both ways to move."""
    names = sorted(cases)
    figure = new_figure(9, 1.4 + 0.34 * len(names))
    axes = figure.subplots()
    place = np.arange(len(names))
    for shift, mode, colour, words in (
        (0.2, "both", BEST, "may leave the path"),
        (-0.2, "path", PLAN, "stays on the path"),
    ):
        time = np.array([float(cases[name][f"time_{mode}"]) for name in names])
        there = np.array([bool(cases[name][f"arrived_{mode}"]) for name in names])
        bars = axes.barh(place + shift, time, 0.36, color=colour, label=words)
        for bar, arrived in zip(bars, there, strict=True):
            if not arrived:
                bar.set(hatch="////", edgecolor="white")
                axes.text(bar.get_width(), bar.get_y() + 0.05, " does not arrive", fontsize=7, color=TEXT)
    axes.set_yticks(place, [name.removeprefix("hand/") for name in names], fontsize=8)
    axes.set_xlabel("time to the goal [s]")
    axes.grid(color=GRID, lw=0.5, axis="x")
    tidy(axes)
    axes.legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
    heading(figure, "Time to the goal beside people")
    return figure


def draw(folder: Path, cases: Mapping[str, Case], dt: float) -> Sequence[str]:
    """Draws what the cases allow into a folder.

    Returns:
        name and content of each figure.
    """
    folder.mkdir(exist_ok=True)
    said = []

    def keep(name: str, figure: Figure, text: str) -> None:
        replace_file(folder / name, lambda there: figure.savefig(there, dpi=130, format="png"))
        said.append(f"`{name}`: {text}")

    obstacles = {name: case for name, case in cases.items() if name.startswith("obstacle/")}
    if obstacles:
        keep("paths.png", paths_figure(obstacles), "the tool's ways around unknown obstacles, from above, with and without avoidance")  # fmt: skip
        keep("clearance.png", clearance_figure(obstacles, dt), "exact clearance over time in the same scenes")
    hands = {name: case for name, case in cases.items() if name.startswith("hand/") and "time_path" in case}
    if hands:
        keep("times.png", times_figure(hands), "time to the goal beside people, in both ways to move")
    return said
