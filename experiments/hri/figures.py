"""Figures of a run: the tool's ways, speed and distances of pairs, the measures of all pairs, and the film of one."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcjax.lab.atomic import write_bytes
from hrcjax.lab.case_store import Case
from hrcjax.viz.style import new_figure, tidy

from . import film
from .animation import RATE, pictures
from .case import trace_of
from .config import HriConfig
from .rows import Pair, ratio
from .systems import Bench
from .trace import Trace

COLOURS = {
    "ours": "#1f5fa8", "nearest": "#7a4fa3", "path": "#8a8f98", "ours_free": "#2a9d5c", "baseline": "#d0702e",
    "baseline_guarded": "#8c3b1f", "baseline_slow": "#e0b080",
}  # fmt: skip
"""Colour of every system."""
SHOWN = ("msj", "curvature", "msj_si", "curvature_si", "cycle_time", "min_separation")
"""Measures of the figure, with a logarithmic scale but for the last two."""
TITLES = {
    "msj": "mean squared jerk\n[m²/sample⁶]", "curvature": "curvature change\n[1/m]", "msj_si": "mean squared jerk\n[m²/s⁶]",
    "curvature_si": "curvature change\n[1/(m s)]", "cycle_time": "cycle time\n[s]", "min_separation": "least separation\n[m]",
}  # fmt: skip


def trajectories(traces: Mapping[str, Mapping[str, Trace]]) -> Figure:
    """For some people (a row each): the tool's way of every system from above and from the front; over time the tool's speed and the
    exact distance of the arm to the person."""
    figure = new_figure(15.0, 3.6 * len(traces))
    grid = figure.subplots(len(traces), 4, squeeze=False, width_ratios=[1, 1, 1.5, 1.5])
    for line, (person, systems) in enumerate(traces.items()):
        for name, trace in systems.items():
            colour, (x, y, z) = COLOURS[name], trace.tool.T
            speed = np.linalg.norm(np.gradient(trace.tool, trace.dt, axis=0), axis=1)
            drawn = ((x, y), (x, z), (trace.t, speed), (trace.t, np.minimum(trace.separation, 1.0)))
            for part, (u, v) in zip(grid[line], drawn, strict=True):
                part.plot(u, v, color=colour, linewidth=1.0, label=name)
        labels = (
            ("x [m]", "y [m]"),
            ("x [m]", "z [m]"),
            ("t [s]", "speed of the tool [m/s]"),
            ("t [s]", "separation [m]"),
        )
        for part, (horizontal, vertical) in zip(grid[line], labels, strict=True):
            part.set(xlabel=horizontal, ylabel=vertical)
            tidy(part)
        for part in grid[line, :2]:
            part.set_aspect("equal", adjustable="datalim")
        grid[line, 3].axhline(0, color="#d9534f", linewidth=1)
        grid[line, 2].set_title(person, loc="left")
    grid[0, 3].legend(fontsize="small", loc="upper right")
    return figure


def measures(pairs: Sequence[Pair], systems: Sequence[str]) -> Figure:
    """A column for every system, a dot for every run, its median as a line; grey lines join ours and the baseline of a pair."""
    figure = new_figure(15.0, 4.6)
    for part, measure in zip(figure.subplots(1, len(SHOWN)), SHOWN, strict=True):
        places = {name: k for k, name in enumerate(systems)}
        values = {name: np.array([getattr(pair.by[name], measure) for pair in pairs], float) for name in systems}
        if {"ours", "baseline"} <= set(systems):
            for a, b in zip(values["ours"], values["baseline"], strict=True):
                part.plot([places["ours"], places["baseline"]], [a, b], color="#cccccc", linewidth=0.6, zorder=0)
        for name, found in values.items():
            if measure == "min_separation":
                found = np.minimum(found, 1.0)
            shift = np.linspace(-0.2, 0.2, len(found)) if len(found) > 1 else 0.0
            part.plot(places[name] + shift, found, ".", color=COLOURS[name], markersize=4)
            if np.isfinite(found).any():
                part.plot(
                    places[name] + np.array([-0.35, 0.35]), 2 * [np.nanmedian(found)], color=COLOURS[name], linewidth=2
                )
        part.set_xticks(list(places.values()), list(places), rotation=60, ha="right", fontsize="small")
        part.set_title(TITLES[measure], fontsize="medium")
        if measure not in ("cycle_time", "min_separation"):
            part.set_yscale("log")
        if measure == "min_separation":
            part.axhline(0, color="#d9534f", linewidth=1)
        tidy(part)
    return figure


def trade(pairs: Sequence[Pair], systems: Sequence[str]) -> Figure:
    """Jerk against cycle time of every run, in SI units: smoothness at one time is what compares."""
    figure = new_figure(7.0, 4.6)
    part: Axes = figure.subplots()
    for name in systems:
        cycle, jerk = (np.array([getattr(pair.by[name], m) for pair in pairs]) for m in ("cycle_time", "msj_si"))
        part.plot(cycle, jerk, ".", color=COLOURS[name], label=name)
        part.plot(np.median(cycle), np.median(jerk), "+", color=COLOURS[name], markersize=16, markeredgewidth=3)
    time = np.array(part.get_xlim())
    time = np.linspace(max(time[0], 3.0), time[1], 100)
    way = 0.7286  # between the waypoints [m]
    part.plot(time, 720 * way**2 / (time / 2) ** 6, "--", color="#555555", linewidth=1, label="least of a straight leg from rest to rest")  # fmt: skip
    part.set(xscale="log", yscale="log", xlabel="cycle time [s]", ylabel="mean squared jerk [m²/s⁶]")
    part.legend(fontsize="small")
    tidy(part)
    return figure


def roughest(pairs: Sequence[Pair]) -> list[int]:
    """Pairs to draw: those in the middle and at the low end by the ratio of jerks, else the first."""
    if not all({"ours", "baseline"} <= set(pair.by) for pair in pairs):
        return [0]
    order = np.argsort([ratio(pair.by["baseline"].msj, pair.by["ours"].msj) for pair in pairs])
    return list(dict.fromkeys([int(order[len(order) // 2]), int(order[0]), int(order[-1])]))


def draw(folder: Path, config: HriConfig, bench: Bench, cases: Mapping[str, Case], pairs: Sequence[Pair]) -> list[str]:
    """Draws all figures into a folder; their names."""
    folder.mkdir(parents=True, exist_ok=True)
    systems = config.systems

    def traces(pair: Pair) -> dict[str, Trace]:
        person, seed = pair.person.rsplit(" ", 1)
        return {system: trace_of(cases[f"{system}/{person}/{seed}"]) for system in systems}

    drawn = {
        "trajectories.png": trajectories({pairs[k].person: traces(pairs[k]) for k in roughest(pairs)}),
        "measures.png": measures(pairs, systems),
        "trade.png": trade(pairs, systems),
    }
    for name, figure in drawn.items():
        figure.savefig(folder / name, dpi=90)
    shown = [name for name in ("ours", "baseline") if name in systems] or list(systems[:2])
    person, seed = filmed(pairs).rsplit(" ", 1)
    by_stem = {Path(name).stem: name for name in _names(config)}
    film_of = pictures(
        bench.cell, bench.person(by_stem[person], int(seed)),
        {system: trace_of(cases[f"{system}/{person}/{seed}"]) for system in shown},
    )  # fmt: skip
    write_bytes(folder / "pair.gif", film.gif(film_of, RATE))
    names = [*drawn, "pair.gif"]
    if film.save_mp4(film_of, RATE, folder / "pair.mp4"):
        names.append("pair.mp4")
    return names


def _names(config: HriConfig) -> tuple[str, ...]:
    from hrcjax.cells.people import with_recordings

    return with_recordings(config.people, config.recordings)


def filmed(pairs: Sequence[Pair]) -> str:
    """The pair of the film: the first in which somebody reaches in and stays, else the first."""
    return next((pair.person for pair in pairs if pair.person.startswith("reach_and_stay")), pairs[0].person)
