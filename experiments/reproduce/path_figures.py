"""Figures of paths: every planner in every reading, variations of the tables, planned paths with their curvature."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.viz.path_view import Obstacles, PathLine, plan_view
from hrcjax.viz.style import (
    BEST,
    GRID,
    KNOB_COLOURS,
    PERSON,
    PLAN,
    TEXT,
    WORST,
    as_row,
    heading,
    new_figure,
    tidy,
)  # fmt: skip
from hrcjax.world.scene import Scene

from .fair import common_paths, fair_rows
from .paths import DEFAULT, POINTS, SCENE, ZETAS, even, measured
from .printed import TIMES, TIMES_CAPTION
from .readings import row_scene
from .rows import Cases

COLOURS = {
    "straight": TEXT, "gda": WORST, "iapf": BEST, "damped": KNOB_COLOURS[3], "planned": KNOB_COLOURS[2], "planned_zeta": KNOB_COLOURS[4], "rrt": PERSON,
}  # fmt: skip
"""Of the planners."""


def solids(scene: Scene) -> Obstacles:
    """The obstacles of a scene for a figure."""
    return Obstacles(*(np.asarray(x) for x in (scene.kind, scene.center, scene.size, scene.yaw, scene.mask)))


def ends(scene: Scene) -> tuple[NDArray, NDArray]:
    return np.asarray(scene.start), np.asarray(scene.goal)


def paths_figure(cases: Cases, readings: Sequence[str]) -> Figure:
    """Every planner's path among the four obstacles, a panel for each reading."""
    figure = new_figure(4.9 * len(readings), 7.0)
    for axes, reading in zip(as_row(figure.subplots(1, len(readings))), readings, strict=True):
        scene = row_scene(reading, SCENE)
        rrt = cases.get(f"rrt/{reading}-{SCENE.key}")
        shown = common_paths(cases[f"times/{reading}"], cases[f"paths/{reading}"], rrt)
        if reading == "clearance":
            del shown["planned_zeta"]
        lengths = {
            one.key: one.length for one in fair_rows(reading, cases[f"times/{reading}"], cases[f"paths/{reading}"], rrt)
        }
        lines = [
            PathLine(path, f"{name}, {100 * lengths[key]:.1f} cm", COLOURS[key], key == "straight")
            for key, (name, path, _) in shown.items()
        ]
        plan_view(lines, solids(scene), None, *ends(scene), "", axes)
        axes.legend(
            handles=list(axes.lines[: len(lines)]),
            fontsize=7,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.11),
            frameon=False,
        )
        axes.set(xlim=(0.0, 0.8), ylim=(0.05, 0.8))
        axes.set_title(reading, fontsize=10, color=TEXT)
    heading(figure, "Paths of every planner among four obstacles of 3 cm, from above; balls are passed below")
    return figure


def variants_figure(cases: Cases, reading: str) -> Figure:
    """The improved field's path under each table's variations."""
    times, figure = cases[f"times/{reading}"], new_figure(13.5, 9.0)
    tables = ("I", "II", "III", "V", "VI", "VII")
    for axes, table in zip(as_row(figure.subplots(2, 3)), tables, strict=True):
        lines = []
        rows = [(k, one) for k, one in enumerate(TIMES) if one.table == table]
        for colour, (k, one) in zip(KNOB_COLOURS, rows, strict=False):
            path = times["iapf_path"][k][: int(times["iapf_steps"][k]) + 1]
            label = (
                one.label.split(";")[0]
                .replace("K_att", "$K_{att}$")
                .replace("K_rep", "$K_{rep}$")
                .replace("zeta", r"$\zeta$")
            )
            lines.append(PathLine(path, f"{label}: {float(times['iapf'][k]):.2f} s", colour))
        scene = row_scene(reading, rows[-1][1])
        plan_view(lines, solids(scene), None, *ends(scene), "", axes)
        axes.set_xlim(0.05, 0.75)
        axes.set_ylim(0.15, 0.75)
        axes.legend(handles=list(axes.lines[: len(lines)]), fontsize=7, loc="upper right")
        axes.set_title(f"table {table}: {TIMES_CAPTION[table].split(';')[0]}", fontsize=9, color=TEXT)
    heading(figure, f"Unit steps of the improved field, {reading} (obstacles of each table's last row), from above")
    return figure


def _curvature(path: NDArray) -> tuple[NDArray, NDArray]:
    """Length travelled [m] and squared curvature [1/m^2] of equally spaced points."""
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    way = np.diff(path, axis=0) / step[:, None]
    bend = np.linalg.norm(np.diff(way, axis=0), axis=1) / ((step[1:] + step[:-1]) / 2)
    return np.cumsum(step)[:-1], bend**2


def optimised_figure(cases: Cases, reading: str) -> Figure:
    """The descent beside planned paths: from above, from the side, and the squared curvature along them."""
    paths, scene = cases[f"paths/{reading}"], row_scene(reading, SCENE)
    lines = [("descent of the field", paths["damped"], WORST)]
    for k, zeta in enumerate(ZETAS):
        lines.append(
            (
                f"planned, {zeta:g} {'radius' if zeta == 1 else 'radii'}",
                paths["planned"][k, DEFAULT],
                (BEST, PLAN, KNOB_COLOURS[2], KNOB_COLOURS[3])[k % 4],
            )
        )
    figure = new_figure(13.5, 5.4)
    above, side, bend = as_row(figure.subplots(1, 3))
    plan_view(
        [PathLine(path, name, colour) for name, path, colour in lines], solids(scene), None, *ends(scene), "", above
    )
    above.legend(fontsize=7)
    above.set_title("from above", fontsize=9, color=TEXT)
    for name, path, colour in lines:
        found, points = measured(path, scene), even(path, POINTS)
        side.plot(path[:, 0], path[:, 2], color=colour, lw=1.8)
        words = f"{name}: {100 * found.length:.1f} cm, {found.bending / 100:.3f} /cm"
        way, squared = _curvature(points)
        bend.semilogy(100 * way, np.maximum(squared / 1e4, 1e-8), color=colour, lw=1.5, label=words)
    side.set(xlabel="x [m]", ylabel="z [m]", title="from the front")
    bend.set(
        xlabel="length travelled [cm]",
        ylabel="squared curvature [1/cm²]",
        ylim=(1e-7, 10),
        title="its integral is the bending energy",
    )
    for axes in (side, bend):
        axes.grid(color=GRID, lw=0.5)
        tidy(axes)
        axes.title.set_fontsize(9)
    bend.legend(fontsize=7, loc="upper right")
    heading(figure, f"The descent and planned paths that keep some radii from axes and centres, {reading}")
    return figure
