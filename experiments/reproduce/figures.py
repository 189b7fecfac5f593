"""Figures of a run, from its stored cases: the content of the paper's figures 6 to 11 and 13 to 17."""

import functools
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.lab.atomic import replace_file
from hrcjax.plan import PotentialParams, potential
from hrcjax.plan.baseline import plain_potential
from hrcjax.viz.path_view import Obstacles, PathLine, plan_view
from hrcjax.viz.style import (
    BEST,
    COLOUR_MAP,
    GRID,
    KNOB_COLOURS,
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
)  # fmt: skip
from hrcjax.viz.zones_view import zones_view
from hrcjax.world.scene import Scene, obstacle_distances

from .episode import DT, arrival
from .fair import ARRIVAL, COMMON_SPEED, common_paths, fair_rows
from .paths import BENDING_WEIGHTS, DEFAULT, POINTS, SCENE, ZETAS, even, measured
from .printed import PATHS, TIMES, TIMES_CAPTION, TimeRow
from .readings import row_scene
from .rows import Cases, fair_of, our_times, told
from .rrt_star import STAGES
from .scores import scores_of
from .times import gradient_params, improved_params

COLOURS = {
    "straight": TEXT, "gda": WORST, "iapf": BEST, "damped": KNOB_COLOURS[3], "planned": KNOB_COLOURS[2], "planned_zeta": KNOB_COLOURS[4], "rrt": PERSON,
}  # fmt: skip
"""Of the planners."""
JUMP = 2.0
"""The person's nearest point is drawn as moving up to this speed; faster, another part of the body is nearest [m/s]."""
HEIGHT = 0.12
"""Of the slices through the field [m]."""


def solids(scene: Scene) -> Obstacles:
    """The obstacles of a scene for a figure."""
    return Obstacles(*(np.asarray(x) for x in (scene.kind, scene.center, scene.size, scene.yaw, scene.mask)))


def _ends(scene: Scene) -> tuple[NDArray, NDArray]:
    return np.asarray(scene.start), np.asarray(scene.goal)


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
        plan_view(lines, solids(scene), None, *_ends(scene), "", axes)
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
        plan_view(lines, solids(scene), None, *_ends(scene), "", axes)
        axes.set_xlim(0.05, 0.75)
        axes.set_ylim(0.15, 0.75)
        axes.legend(handles=list(axes.lines[: len(lines)]), fontsize=7, loc="upper right")
        axes.set_title(f"table {table}: {TIMES_CAPTION[table].split(';')[0]}", fontsize=9, color=TEXT)
    heading(figure, f"Unit steps of the improved field, {reading} (obstacles of each table's last row), from above")
    return figure


def _slice(
    params: PotentialParams, scene: Scene, radius: jax.Array, scaled: bool
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """x, y [m], the potential over that of the start [1], and its force's direction, in the slice; indexed (y, x)."""
    x, y = np.linspace(0.0, 0.8, 161), np.linspace(0.1, 0.8, 141)
    points = np.stack([*np.meshgrid(x, y), np.full((len(y), len(x)), HEIGHT)], axis=-1)

    with jax.enable_x64(True):
        found, slope = _field()(params, scene, radius, jnp.asarray(points.reshape(-1, 3)), scaled)
        start, _ = _field()(params, scene, radius, scene.start[None], scaled)
    shape = len(y), len(x)
    return x, y, np.asarray(found / start).reshape(shape), -np.asarray(slope).reshape(*shape, 3)


@functools.cache
def _field() -> Any:
    """The potential and its slope at many points, compiled once for each field and number of points."""

    def all_of(params: PotentialParams, scene: Scene, radius: jax.Array, points: jax.Array, scaled: bool) -> Any:
        def value(q: jax.Array) -> jax.Array:
            return potential(params, q, scene.goal, lambda p: obstacle_distances(scene, p), radius, scaled)

        return jax.vmap(jax.value_and_grad(value))(points)

    return jax.jit(all_of, static_argnums=4)


def field_figure(cases: Cases, reading: str) -> Figure:
    """The potential in a slice, streamlines of its force, and the path: improved field and gradient descent, of little and much repulsion."""
    figure = new_figure(12.0, 10.2)
    rows = [one for one in TIMES if one.table == "VI"]
    shown: list[tuple[str, TimeRow, bool]] = [
        (f"improved field, $K_{{rep}}$ {one.k_rep:g} cm²", one, True) for one in (rows[0], rows[-1])
    ]
    shown += [(f"gradient descent, $K_{{rep}}$ {one.gda_k_rep:g} cm⁴", one, False) for one in (rows[0], rows[-1])]
    times = cases[f"times/{reading}"]
    all_axes = as_row(figure.subplots(2, 2))
    for axes, (title, one, improved) in zip(all_axes, shown, strict=True):
        scene, k = row_scene(reading, one), TIMES.index(one)
        with jax.enable_x64(True):
            params = improved_params(one) if improved else plain_potential(gradient_params(one))
            radius = scene.radius if improved else jnp.ones_like(scene.radius)
        x, y, level, way = _slice(params, scene, radius, improved)
        name = "iapf" if improved else "gda"
        axes.pcolormesh(x, y, np.clip(level, 1e-3, 10), norm=LogNorm(1e-3, 10), cmap=COLOUR_MAP, rasterized=True)
        size = np.maximum(np.linalg.norm(way[..., :2], axis=-1, keepdims=True), 1e-12)
        axes.streamplot(
            x, y, *np.moveaxis(way[..., :2] / size, -1, 0), color="white", linewidth=0.5, density=1.3, arrowsize=0.6
        )
        path = times[f"{name}_path"][k][: int(times[f"{name}_steps"][k]) + 1]
        plan_view([PathLine(path, "path", WORST)], None, None, *_ends(scene), "", axes)
        axes.set(xlim=(0.0, 0.8), ylim=(0.1, 0.8), title=title)
        axes.title.set(fontsize=10, color=TEXT)
        axes.grid(False)
    bar = figure.colorbar(all_axes[0].collections[0], ax=all_axes, shrink=0.7, extend="both")
    bar.set_label("potential over that of the start [1]", fontsize=9)
    heading(figure, f"Potential and streamlines of its force at z = {100 * HEIGHT:.0f} cm, {reading}; paths from above")
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
        [PathLine(path, name, colour) for name, path, colour in lines], solids(scene), None, *_ends(scene), "", above
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


def scores_figure(cases: Cases, reading: str) -> Figure:
    """The score of table VIII over length and bending energy, with the candidates: the paper's and ours."""
    figure = new_figure(11.5, 4.8)
    paths, scene = cases[f"paths/{reading}"], row_scene(reading, SCENE)
    ours = [measured(path, scene) for path in paths["planned"][-1]]
    groups = [
        ("the paper's candidates", [(one.name, one.length, one.bending) for one in PATHS]),
        (f"planned, {ZETAS[-1]:g} radii, {reading}", [(rf"$\omega_2$ {weight:g} m", 100 * one.length, one.bending / 100) for weight, one in zip(BENDING_WEIGHTS, ours, strict=True)]),
    ]  # fmt: skip
    all_axes = as_row(figure.subplots(1, 2))
    for axes, (title, some) in zip(all_axes, groups, strict=True):
        length, bending = (np.array([one[k] for one in some]) for k in (1, 2))
        spans = [(v.min() - 0.15 * np.ptp(v), v.max() + 0.35 * np.ptp(v)) for v in (length, bending)]
        x, y = (np.linspace(*span, 60) for span in spans)
        unit = [
            (grid - v.min()) / max(np.ptp(v), 1e-9)
            for grid, v in zip(np.meshgrid(x, y), (length, bending), strict=True)
        ]
        axes.pcolormesh(x, y, 0.5 * unit[0] + 0.5 * unit[1], cmap=COLOUR_MAP, vmin=0, vmax=1.3, rasterized=True)
        lines = axes.contour(
            x, y, 0.5 * unit[0] + 0.5 * unit[1], levels=np.arange(0.1, 1.3, 0.1), colors="white", linewidths=0.6
        )
        axes.clabel(lines, fontsize=6.5, fmt="%.1f")
        for (name, a, b), score in zip(some, scores_of(length, bending), strict=True):
            axes.plot(a, b, "o", color=WORST, mec="white", ms=8)
            axes.annotate(f" {name}: {score:.2f}", (a, b), fontsize=8, color="white", fontweight="bold", va="bottom")
        axes.set(xlabel="length [cm]", ylabel="bending energy [1/cm]", title=title)
        tidy(axes)
    bar = figure.colorbar(all_axes[0].collections[0], ax=all_axes)
    bar.set_label("score, the lower the better [1]", fontsize=9)
    heading(figure, r"Score of table VIII, $\omega_1 = \omega_2 = 0.5$")
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
    if "rrt-long" in cases:
        best = 100 * cases["rrt-long"]["best"]
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


def motion_figure(case: Mapping[str, NDArray]) -> Figure:
    """The tool's position, speed and acceleration, and the person's nearest point, without and with zones; zones in the background."""
    figure = new_figure(13.0, 9.5)
    time, ends = case["time"], [arrival(case, run) for run in (0, 1)]
    last = min(max(end for end in ends if np.isfinite(end)) + 0.5 if any(np.isfinite(ends)) else time[-1], time[-1])
    kept = time <= last
    grid = figure.subplots(4, 2, sharex=True, sharey="row")
    for run, title in enumerate(("without zones", "with zones")):
        moved = np.linalg.norm(np.gradient(case["person"][run], DT, axis=0), axis=1)
        moved = np.where(moved < JUMP, moved, np.nan)
        curves = (
            (("tool x", case["tool"][run, :, 0]), ("y", case["tool"][run, :, 1]), ("z", case["tool"][run, :, 2])),
            (("speed of the tool", case["speed"][run]), ("person's nearest point", moved)),
            (("acceleration of the tool", case["acceleration"][run]),),
            (("tool to person", case["separation"][run]),),
        )
        for axes, some, label in zip(
            grid[:, run], curves, ("position [m]", "speed [m/s]", "acceleration [m/s²]", "distance [m]"), strict=True
        ):
            _shade(axes, time[kept], case["zone"][run][kept])
            for (name, values), colour in zip(
                some, (BEST, WORST, KNOB_COLOURS[2]) if len(some) == 3 else (BEST, PERSON), strict=False
            ):
                axes.plot(time[kept], values[kept], color=colour, lw=1.4, label=name)
            if np.isfinite(ends[run]):
                axes.axvline(ends[run], color=TEXT, lw=0.8, ls=":")
            axes.grid(color=GRID, lw=0.5)
            tidy(axes)
            axes.legend(fontsize=7, loc="upper right")
            if run == 0:
                axes.set_ylabel(label, fontsize=9)
        grid[0, run].set_title(f"{title}: {ends[run]:.2f} s to the goal", fontsize=10, color=TEXT)
        grid[-1, run].set_xlabel("time [s]")
    grid[0, 0].set_xlim(0, last)
    heading(
        figure,
        f"A tool on its path beside a hand that reaches in ({case['reading']}); zones of the distance in their colours",
    )
    return figure


def _shade(axes: Axes, time: NDArray, zone: NDArray) -> None:
    """Zones as coloured stretches of time."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(zone)) + 1, [len(zone)]])
    for a, b in pairwise(edges):
        axes.axvspan(
            float(time[a]), float(time[min(b, len(time) - 1)]), color=ZONE_COLOURS[int(zone[a])], alpha=0.16, lw=0
        )


def zones_figure(case: Mapping[str, NDArray]) -> Figure:
    """Zones, distance and speed of both runs."""
    stop, yellow, green = case["thresholds"]
    ends = [arrival(case, run) for run in (0, 1)]
    kept = case["time"] <= min(max(ends) + 0.5, case["time"][-1])
    return zones_view(
        case["time"][kept], case["zone"][:, kept], case["separation"][:, kept], case["speed"][:, kept], ("no zones", "zones"), (WORST, BEST),
        {ZONE_NAMES[2]: float(yellow), ZONE_NAMES[1]: float(green), ZONE_NAMES[3]: float(stop)}, "Zones, distance of the tool to the person, and its speed along the path",
    )[0]  # fmt: skip


def draw(folder: Path, cases: Cases, readings: Sequence[str]) -> Sequence[str]:
    """Draws all figures into a folder.

    Returns:
        name and content of each figure.
    """
    folder.mkdir(exist_ok=True)
    reading, said = told(readings), []

    def keep(name: str, figure: Figure, text: str) -> None:
        replace_file(folder / name, lambda there: figure.savefig(there, dpi=130, format="png"))
        said.append(f"`{name}`: {text}")

    keep("times.png", times_figure(cases, readings), "printed and computed times of the improved field, row by row")
    keep(
        "speed.png",
        speed_figure(cases, readings),
        "printed times beside those at one speed (the paper's figure 9), and RRT* over its iterations",
    )
    keep(
        "paths.png",
        paths_figure(cases, readings),
        "paths of every planner from above, in every reading (figures 6 to 8)",
    )
    keep(
        "variants.png",
        variants_figure(cases, reading),
        "the improved field's path under each table's variations (figures 6 to 8, 10, 11)",
    )
    keep(
        "field.png",
        field_figure(cases, reading),
        "potential, streamlines and path of both fields, of little and much repulsion (figure 10)",
    )
    keep(
        "optimised.png",
        optimised_figure(cases, reading),
        "the descent and planned paths, with their squared curvature (figure 13)",
    )
    keep(
        "scores.png",
        scores_figure(cases, reading),
        "the score of table VIII over length and bending energy (figure 14)",
    )
    keep(
        "motion.png",
        motion_figure(cases["episode"]),
        "tool and person over time, without and with zones (figures 15 to 17)",
    )
    keep("zones.png", zones_figure(cases["episode"]), "zones, distance and speed of both runs")
    return said
