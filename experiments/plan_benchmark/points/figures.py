"""Figures of the comparison: success and time, length over bending energy, and two scenes with all paths."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from hrcjax.lab.atomic import replace_file
from hrcjax.viz.path_view import Obstacles, PathLine, plan_view, view_3d
from hrcjax.viz.style import (
    BEST,
    GRID,
    INFEASIBLE,
    KNOB_COLOURS,
    PERSON,
    PLAN,
    TEXT,
    WORST,
    as_row,
    heading,
    new_figure,
    tidy,
)

from .measures import MINE
from .scenes import PointScene

Case = Mapping[str, NDArray]
COLOURS = {
    "gradient_descent": KNOB_COLOURS[4], "plain_apf": "#b8a04a", "iapf": PERSON, "iapf_optimised": PLAN, "multi_start": BEST,
    "multi_start_slack": "#0b2e57", "rrt_star": WORST, "informed_rrt_star": KNOB_COLOURS[3], "bfmt_star": KNOB_COLOURS[2],
}  # fmt: skip
NAMES = {
    "gradient_descent": "gradient descent", "plain_apf": "plain APF", "iapf": "IAPF", "iapf_optimised": "IAPF + optimiser",
    "multi_start": "multi-start", "multi_start_slack": "multi-start, 1 % slack", "rrt_star": "RRT*",
    "informed_rrt_star": "Informed RRT*", "bfmt_star": "BFMT*",
}  # fmt: skip


def bars_figure(rows: Mapping[str, Mapping[str, Any]], names: Sequence[str]) -> Figure:
    """Success, travel time and planning time of every planner with 95 % intervals."""
    figure = new_figure(12.0, 1.4 + 0.42 * len(names))
    panels = (("success", "success [1]", False), ("travel", "travel time [s]", False), ("planning", "planning time [s]", True))  # fmt: skip
    place = np.arange(len(names))
    for axes, (measure, words, log) in zip(as_row(figure.subplots(1, 3, sharey=True)), panels, strict=True):
        found = [rows.get(f"point_{measure}_{name}") for name in names]
        value, low, high = (
            np.array([np.nan if r is None else r[key] for r in found], float) for key in ("value", "low", "high")
        )
        colours = [COLOURS[name] for name in names]
        axes.barh(place, np.nan_to_num(value), color=colours, height=0.7)
        axes.errorbar(value, place, xerr=np.maximum(np.stack([value - low, high - value]), 0), fmt="none", ecolor=TEXT, capsize=3, lw=1)  # fmt: skip
        axes.set_yticks(place, [NAMES[name] for name in names], fontsize=8)
        if log:
            axes.set_xscale("log")
        axes.set_xlabel(words)
        axes.grid(color=GRID, lw=0.5, axis="x")
        tidy(axes)
    as_row(figure.axes)[0].invert_yaxis()
    heading(figure, "Planners of a point: success, and medians over the scenes each solves, with 95 % intervals")
    return figure


def scatter_figure(cases: Mapping[str, Sequence[Case]]) -> Figure:
    """Length and bending energy over those of multi-start, a point for each scene in which both succeed."""
    names = [name for name in cases if name != MINE]
    across = 4
    down = -(-len(names) // across)
    figure = new_figure(12.5, 0.8 + 3.0 * down)
    panels = as_row(figure.subplots(down, across, sharex="row", sharey="row", squeeze=False))
    for axes in panels[len(names) :]:
        axes.set_visible(False)
    for axes, name in zip(panels, names, strict=False):
        pairs = [(a, b) for a, b in zip(cases[name], cases[MINE], strict=True) if bool(a["success"]) and bool(b["success"])]  # fmt: skip
        long = np.array([float(a["length"] / b["length"]) for a, b in pairs])
        bent = np.array([float(a["bending"] / b["bending"]) for a, b in pairs])
        axes.axhline(1, color=TEXT, lw=0.8)
        axes.axvline(1, color=TEXT, lw=0.8)
        drawn = np.isfinite(bent) & (bent > 0)
        axes.scatter(long[drawn], bent[drawn], s=12, color=COLOURS[name], alpha=0.6, lw=0)
        corners = f", {int((~drawn).sum())} with corners" if (~drawn).any() else ""
        axes.set_title(f"{NAMES[name]}: {len(pairs)} scenes{corners}", fontsize=9, color=TEXT)
        axes.set(yscale="log")
        axes.grid(color=GRID, lw=0.5)
        tidy(axes)
    figure.supxlabel("length over that of multi-start [1]", fontsize=9)
    figure.supylabel("bending energy over that of multi-start [1]", fontsize=9)
    heading(figure, "Length and bending energy; above and to the right of the lines multi-start is better")
    return figure


def _obstacles(scene: PointScene) -> Obstacles:
    return Obstacles(scene.kind, scene.center, scene.size, scene.yaw, np.ones(len(scene.kind), bool))


def paths_figure(scenes: Mapping[int, PointScene], cases: Mapping[str, Sequence[Case]]) -> Figure:
    """All paths in two scenes, from above and in perspective; those that fail are grey and dashed."""
    figure = new_figure(13.0, 11.0)
    for line, k in enumerate(shown(scenes, cases)):
        seed = list(scenes)[k]
        scene = scenes[seed]
        lines = []
        for name, some in cases.items():
            good, curve = bool(some[k]["success"]), np.asarray(some[k]["curve"])
            inside: NDArray = np.all((curve >= scene.lower - 0.02) & (curve <= scene.upper + 0.02), axis=1)
            curve = np.where(inside[:, None], curve, np.nan)
            lines.append(PathLine(curve, NAMES[name], COLOURS[name] if good else INFEASIBLE, not good))
        lines.sort(key=lambda path: not path.dashed)  # failures below the others
        flat = figure.add_subplot(2, 2, 2 * line + 1)
        deep: Any = figure.add_subplot(2, 2, 2 * line + 2, projection="3d")
        failed = [NAMES[name] for name, some in cases.items() if not bool(some[k]["success"])]
        plan_view(lines, _obstacles(scene), None, scene.start, scene.goal, "", flat)
        view_3d(lines, _obstacles(scene), None, scene.start, scene.goal, "", deep)
        legend = flat.get_legend()
        if legend is not None:
            legend.remove()
        flat.set_title(f"scene {seed}, {len(scene.kind)} obstacles; failed: {', '.join(failed) or 'none'}", fontsize=9, color=TEXT)  # fmt: skip
    handles = [Line2D([], [], color=COLOURS[name], lw=2, label=NAMES[name]) for name in cases]
    handles.append(Line2D([], [], color=INFEASIBLE, lw=2, ls="--", label="failed"))
    figure.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    heading(figure, "All paths in two scenes, from above and in perspective")
    return figure


def shown(scenes: Mapping[int, PointScene], cases: Mapping[str, Sequence[Case]]) -> list[int]:
    """Two scenes: the first with 3 obstacles or more that all planners solve, or most; and the first in which some fail."""
    solved = np.array([[bool(case["success"]) for case in some] for some in cases.values()]).sum(axis=0)
    many = np.array([len(scene.kind) >= 3 for scene in scenes.values()])
    order = np.arange(len(solved))
    first = int(min(order, key=lambda k: (-int(many[k]), -int(solved[k]), k)))
    rest = [k for k in order if k != first]
    if not rest:
        return [first]
    second = int(min(rest, key=lambda k: (-int(many[k]), abs(int(solved[k]) - len(cases) + 3), k)))
    return [first, second]


def draw(
    folder: Path,
    scenes: Mapping[int, PointScene],
    cases: Mapping[str, Sequence[Case]],
    rows: Mapping[str, Mapping[str, Any]],
) -> list[str]:
    """All figures as PNG files; name and content of each."""
    folder.mkdir(parents=True, exist_ok=True)
    made = {"success_and_time.png": bars_figure(rows, list(cases)), "paths.png": paths_figure(scenes, cases)}
    said = {"success_and_time.png": "success, travel time and planning time", "paths.png": "all paths in two scenes"}
    if MINE in cases and len(cases) > 1:
        made["length_and_bending.png"] = scatter_figure(cases)
        said["length_and_bending.png"] = "length and bending energy of every planner over those of multi-start"
    for name, figure in made.items():
        replace_file(folder / name, lambda path, f=figure: f.savefig(path, dpi=110, format="png"))
    return [f"`{name}`, {said[name]}" for name in made]
