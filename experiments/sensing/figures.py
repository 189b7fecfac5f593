"""Figures of a run, from its stored cases."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hrcjax.lab.atomic import replace_file
from hrcjax.sense import HEALTH_REASONS
from hrcjax.viz.style import (
    BEST,
    DYNAMIC_POINT,
    GOAL,
    GRID,
    NEW_POINT,
    OBSTACLE,
    PERSON,
    PLAN,
    START,
    STATIC_POINT,
    TEXT,
    WORST,
    ZONE_COLOURS,
    ZONE_NAMES,
    as_row,
    heading,
    new_figure,
    tidy,
)

from .shapes import capsule, obstacles

Case = Mapping[str, NDArray]
VIEWS = (("from above", (0, 1), "x [m]", "y [m]"), ("from the side", (1, 2), "y [m]", "z [m]"))
SHOWN = 2.0
"""Distances beyond this are drawn here [m]."""
ON_BODY = 0.05
"""Moving points farther than this outside the person stand for hidden space [m]."""


def cloud_figure(case: Case, title: str) -> Figure:
    """The sensed points beside the exact shapes at one moment, from above and from the side."""
    figure = new_figure(11, 9)
    panels = figure.subplots(2, 2)
    moving, off = case["moving"], case["off"]
    measured = off <= ON_BODY
    for line, (name, view, right, up) in zip(panels, VIEWS, strict=True):
        for axes, what in zip(line, ("sensed", "exact"), strict=True):
            i, j = view
            if what == "sensed":
                for points, colour in (
                    (case["static"], STATIC_POINT),
                    (moving[~measured], NEW_POINT),
                    (moving[measured], DYNAMIC_POINT),
                ):
                    axes.scatter(points[:, i], points[:, j], s=6, color=colour, linewidths=0)
            else:
                obstacles(axes, case, view, facecolor=OBSTACLE, edgecolor="none")
            alpha, fill = (0.55, PERSON) if what == "exact" else (0.5, "none")
            for a, b, r in zip(case["person_a"], case["person_b"], case["person_radius"], strict=True):
                capsule(axes, a, b, float(r), view, facecolor=fill, edgecolor=PERSON, alpha=alpha, lw=0.8)
            for a, b, r in zip(case["arm_a"], case["arm_b"], case["arm_radius"], strict=True):
                capsule(axes, a, b, float(r), view, facecolor=PLAN, edgecolor="none", alpha=0.8)
            for place, colour in ((case["start"], START), (case["goal"], GOAL)):
                axes.plot(place[i], place[j], "x", color=colour, ms=6)
            axes.set(xlabel=right, ylabel=up, aspect="equal")
            axes.set_xlim(-1.3, 1.3) if i == 0 else axes.set_xlim(-0.7, 1.9)
            axes.set_ylim(-0.7, 1.9) if j == 1 else axes.set_ylim(-0.15, 1.5)
            axes.set_title(f"{what}, {name}", fontsize=9)
            axes.grid(color=GRID, lw=0.5)
            tidy(axes)
    handles: list[Any] = [
        Line2D([], [], ls="", marker="o", ms=5, color=colour, label=f"{label} ({count:,})")
        for label, colour, count in (
            ("map of what stands", STATIC_POINT, len(case["static"])),
            (f"moving, within {1e2 * ON_BODY:.0f} cm of the person", DYNAMIC_POINT, int(measured.sum())),
            ("moving, farther out: hidden or lost space", NEW_POINT, int((~measured).sum())),
        )
    ]
    handles += [Patch(color=PERSON, alpha=0.55, label="person"), Patch(color=PLAN, label="arm"), Patch(color=OBSTACLE, label="obstacle")]  # fmt: skip
    figure.legend(handles=handles, ncols=3, loc="outside lower center", frameon=False, fontsize=8)
    heading(figure, title)
    return figure


def _zones(axes: Axes, t: NDArray, zone: NDArray) -> None:
    """The zones as colours behind curves."""
    edges = np.flatnonzero(np.diff(zone)) + 1
    for first, last in zip([0, *edges], [*edges, len(t)], strict=True):
        end = t[last] if last < len(t) else t[-1]
        axes.axvspan(t[first], end, color=ZONE_COLOURS[int(zone[first])], alpha=0.25, lw=0)


def _distances(axes: Axes, case: Case) -> None:
    for name, colour, style in (("true_exposed", GOAL, ":"), ("true_now", GOAL, "-"), ("separation", WORST, "-")):
        axes.plot(case["t"], np.where(case[name] > SHOWN, np.nan, case[name]), style, color=colour, lw=1.3)
    axes.set_ylim(-0.3, SHOWN)
    axes.axhline(0, color=TEXT, lw=0.6)
    axes.set_ylabel("distance arm to person [m]")
    axes.grid(color=GRID, lw=0.5)
    tidy(axes)


def _zone_legend(figure: Figure, extra: list[Any]) -> None:
    patches = [Patch(color=c, alpha=0.4, label=f"zone {n}") for c, n in zip(ZONE_COLOURS, ZONE_NAMES, strict=True)]
    figure.legend(handles=[*extra, *patches], ncols=6, loc="outside lower center", frameon=False, fontsize=8)


CURVES = [
    Line2D([], [], color=GOAL, label="true"),
    Line2D([], [], color=GOAL, ls=":", label="true, person as exposed"),
    Line2D([], [], color=WORST, label="sensed, lower bound"),
]


def separation_figure(cases: Mapping[str, Case], title: str) -> Figure:
    """Sensed and true distance over time, one panel for each person."""
    figure = new_figure(9, 1.0 + 2.2 * len(cases))
    panels = as_row(figure.subplots(len(cases), 1, sharex=True))
    for axes, (name, case) in zip(panels, cases.items(), strict=True):
        _zones(axes, case["t"], case["zone"])
        _distances(axes, case)
        axes.set_title(name, fontsize=9, loc="left")
        axes.set_xlim(case["t"][0], case["t"][-1])
    panels[-1].set_xlabel("time [s]")
    _zone_legend(figure, CURVES)
    heading(figure, title)
    return figure


def unseen_figure(case: Case, title: str) -> Figure:
    """Space that no camera saw in the set-up: its height over every place, and its width beside every place."""
    figure = new_figure(11, 5.2)
    edge, unseen = float(case["edge"]), case["unseen"]
    for axes, (name, view, right, up) in zip(figure.subplots(1, 2), VIEWS, strict=True):
        i, j = view
        low, high = (-2.0, 0.0 if j == 2 else -2.0), (2.0, 1.4 if j == 2 else 2.0)
        bins = [np.arange(a, b + edge / 2, edge) for a, b in zip(low, high, strict=True)]
        count, _, _ = np.histogram2d(unseen[:, i], unseen[:, j], bins=bins)
        shown = axes.pcolormesh(*bins, np.where(count > 0, edge * count, np.nan).T, cmap="viridis", vmin=0)
        bar = figure.colorbar(shown, ax=axes, shrink=0.8)
        bar.set_label(("height" if j == 1 else "width along x") + " of unseen space [m]")
        obstacles(axes, case, view, facecolor="none", edgecolor=DYNAMIC_POINT, lw=1.0)
        turn = np.linspace(0, 2 * np.pi, 100)
        axes.plot(np.cos(turn), np.sin(turn), color=TEXT, lw=0.8, ls=":")
        axes.plot(case["cameras"][:, i], case["cameras"][:, j], "^", color=BEST, ms=7)
        axes.set(xlabel=right, ylabel=up, aspect="equal", title=name, xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        if j == 2:
            axes.set_ylim(0, 1.6)
        tidy(axes)
    handles: list[Any] = [
        Line2D([], [], ls="", marker="^", color=BEST, label="stationary camera"),
        Line2D([], [], ls=":", color=TEXT, label="1 m about the base"),
        Line2D([], [], color=DYNAMIC_POINT, label="obstacle"),
    ]
    figure.legend(handles=handles, ncols=3, loc="outside lower center", frameon=False, fontsize=8)
    heading(figure, title)
    return figure


def fault_figure(case: Case, title: str) -> Figure:
    """Distances and zones while cameras fail, and what each camera is said to suffer."""
    figure = new_figure(10, 6)
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [2.2, 1]})
    _zones(upper, case["t"], case["zone"])
    _distances(upper, case)
    count = case["faulty"].shape[1]
    t = case["t"]
    for c in range(count):
        bits = (case["cameras"] >> (8 * c)) & 255
        edges = np.flatnonzero(np.diff(bits)) + 1
        for first, last in zip([0, *edges], [*edges, len(t)], strict=True):
            if bits[first]:
                end = t[last] if last < len(t) else t[-1]
                lower.barh(c, end - t[first], left=t[first], height=0.32, color=DYNAMIC_POINT)
        for k in np.flatnonzero(case["faulty"][:, c]):
            begin, end = case["begin"][k], case["end"][k]
            lower.barh(c - 0.34, end - begin, left=begin, height=0.2, color=STATIC_POINT)
    lower.fill_between(t, count - 0.7, count - 0.4, where=case["guarded"].astype(bool), color=NEW_POINT, lw=0)
    lower.set_yticks([*range(count), count - 0.55], [*(f"camera {c}" for c in range(count)), "guarded"], fontsize=8)
    lower.set_ylim(-0.7, count - 0.2)
    lower.set(xlabel="time [s]", xlim=(t[0], t[-1]))
    lower.grid(color=GRID, lw=0.5, axis="x")
    tidy(lower)
    known = np.bitwise_or.reduce([(case["cameras"] >> (8 * c)) & 255 for c in range(count)], axis=None)
    said = "; ".join(text for bit, text in HEALTH_REASONS.items() if int(known) & bit) or "nothing"
    lower.set_title(f"named: {said}", fontsize=8, loc="left")
    extra = [*CURVES, Patch(color=STATIC_POINT, label="fault"), Patch(color=DYNAMIC_POINT, label="named"), Patch(color=NEW_POINT, label="guarded")]  # fmt: skip
    _zone_legend(figure, extra)
    heading(figure, title)
    return figure


def _save(figure: Figure, path: Path) -> None:
    replace_file(path, lambda there: figure.savefig(there, dpi=130, format="png"))


def draw(folder: Path, cases: Mapping[str, Case], scene: str) -> list[str]:
    """Draws what the cases allow into a folder.

    Returns:
        name and content of each figure.
    """
    folder.mkdir(exist_ok=True)
    said = []

    def keep(name: str, figure: Figure, text: str) -> None:
        _save(figure, folder / name)
        said.append(f"`{name}`: {text}")

    moment = cases.get(f"picture/{scene}-0")
    if moment is not None:
        title = f"{scene}: what is sensed, and what is there, at {float(moment['t']):.1f} s"
        keep("cloud.png", cloud_figure(moment, title), "sensed points beside the exact shapes at one moment, from above and from the side")  # fmt: skip
        keep("unseen.png", unseen_figure(moment, f"{scene}: space that no camera saw in the set-up"), "space that no camera saw in the set-up")  # fmt: skip
    start = f"episode/{scene}-0-"
    beside = {name.removeprefix(start): c for name, c in cases.items() if name.startswith(start) and not name.endswith("-nobody")}  # fmt: skip
    if beside:
        keep("separation.png", separation_figure(beside, f"{scene}: distance to people"), "sensed and true distance over time with the zones, one panel for each person")  # fmt: skip
    faulty = [name for kind in ("blocked", "frozen") for name in cases if name.startswith(f"fault/{kind}/")]
    if faulty:
        _, kind, where = faulty[0].split("/")
        keep("fault.png", fault_figure(cases[faulty[0]], f"{kind} cameras: {where}"), "an episode with faults: distances, zones, and what each camera is said to suffer")  # fmt: skip
    return said
