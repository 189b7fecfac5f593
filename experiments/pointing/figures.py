"""Figures: trials of a scene from above with the ellipses that were told, and errors by the way to the place."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, Polygon
from numpy.typing import NDArray

from hrcjax.viz.style import BEST, GOAL, OBSTACLE, PLAN, START, WORST, new_figure, tidy

from .rows import BARS, Case, errors, told

SHOWN = 12
"""Trials of a kind in a view from above."""
TITLES = {"tip": "finger on a surface", "finger": "along the index finger", "arm": "along the arm"}
COLOURS = {"tip": START, "finger": BEST, "arm": WORST}
TALLEST = 60.0
"""Larger errors are drawn at the border [cm]."""


def solids(axes: Axes, case: Case) -> None:
    """Table and obstacles from above."""
    lower, upper = case["scene_table_lower"], case["scene_table_upper"]
    corners = [lower, (upper[0], lower[1]), upper, (lower[0], upper[1])]
    axes.add_patch(Polygon(np.asarray(corners), closed=True, facecolor="#f4f2ee", edgecolor=OBSTACLE, linewidth=0.8))
    for k in np.flatnonzero(case["scene_mask"]):
        (x, y, _), (a, b, _), yaw = case["scene_center"][k], case["scene_size"][k], case["scene_yaw"][k]
        if case["scene_kind"][k] == 2:
            turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
            box = np.array([(-a, -b), (a, -b), (a, b), (-a, b)]) @ turn.T + (x, y)
            axes.add_patch(Polygon(box, closed=True, facecolor=OBSTACLE, alpha=0.6))
        else:
            axes.add_patch(Circle((x, y), a, facecolor=OBSTACLE, alpha=0.6))
    axes.add_patch(Circle((0, 0), 0.07, facecolor=GOAL, alpha=0.7))
    axes.text(0, -0.1, "robot", fontsize=7, ha="center", va="top")


def ellipse(center: NDArray, covariance: NDArray) -> Ellipse:
    """Two standard deviations, seen from above."""
    values, axes = np.linalg.eigh(covariance[:2, :2])
    width, height = 4 * np.sqrt(np.maximum(values[::-1], 0))
    angle = np.degrees(np.arctan2(axes[1, 1], axes[0, 1]))
    return Ellipse((center[0], center[1]), width, height, angle=angle, facecolor=PLAN, edgecolor=BEST, alpha=0.35)


def above(axes: Axes, case: Case, title: str) -> None:
    """Some trials from above."""
    solids(axes, case)
    there = np.flatnonzero(case["chosen"] & case["map_found"])[:SHOWN]
    for k in there:
        true, found, tip = case["place"][k], case["map_place"][k], case["line"][k, -1]
        axes.add_patch(ellipse(found, np.asarray(case["map_covariance"][k], float)))
        axes.plot([tip[0], true[0]], [tip[1], true[1]], color=OBSTACLE, linewidth=0.6, linestyle=":")
        axes.plot([true[0], found[0]], [true[1], found[1]], color=WORST, linewidth=0.9)
        axes.plot(*true[:2], "+", color=GOAL, markersize=7, label="true" if k == there[0] else None)
        axes.plot(*found[:2], ".", color=BEST, markersize=6, label="found" if k == there[0] else None)
        chain = case["hand"][k][[0, 5, 6, 7, 8]]
        axes.plot(chain[:, 0], chain[:, 1], color=START, linewidth=1.4, label="hand" if k == there[0] else None)
    lower, upper = case["scene_table_lower"], case["scene_table_upper"]
    axes.set(xlim=(lower[0] - 0.1, upper[0] + 0.1), ylim=(lower[1] - 0.1, upper[1] + 0.5), aspect="equal")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_title(title, fontsize=10)
    axes.legend(fontsize=7, loc="lower left")
    tidy(axes)


def above_figure(by_kind: Mapping[str, Case]) -> Figure:
    """A view of each kind, of one scene."""
    kinds = [kind for kind in TITLES if kind in by_kind]
    figure = new_figure(5.2 * len(kinds), 4.8)
    for axes, kind in zip(np.atleast_1d(figure.subplots(1, len(kinds))), kinds, strict=True):
        above(axes, by_kind[kind], TITLES[kind])
    return figure


def by_way(axes: Axes, case: Case) -> None:
    """Errors of fingers by the way, of line and map as found, and of the detector's model."""
    way = case["way"]
    shown = (
        ("world", OBSTACLE, "model in space"),
        ("map", BEST, "by pixels in two cameras"),
        ("true", START, "true line, by the map"),
    )
    for of, colour, text in shown:
        e = 100 * errors(case, of)
        axes.plot(way, np.minimum(e, TALLEST), ".", color=colour, markersize=4, alpha=0.7, label=text)
        edges = np.linspace(0.3, 1.2, 7)
        parts = [e[(way >= a) & (way <= b)] for a, b in pairwise(edges)]
        middles = [np.nanmedian(part) if np.isfinite(part).any() else np.nan for part in parts]
        axes.plot((edges[:-1] + edges[1:]) / 2, np.minimum(middles, TALLEST), color=colour, linewidth=1.5)
    axes.hlines(BARS["ray_p50_1m"][1], 0.8, 1.2, color=WORST, linewidth=1.2, linestyle="--", label="bar")
    axes.set(xlabel="way from the tip to the place [m]", ylabel="error of the place [cm]", ylim=(0, TALLEST))
    axes.legend(fontsize=7, loc="upper left")
    axes.set_title("index finger; lines: medians", fontsize=10)
    tidy(axes)


def shares(axes: Axes, by_kind: Mapping[str, Case]) -> None:
    """Share of trials with an error below a value, by kind."""
    for kind, text in TITLES.items():
        if kind in by_kind:
            e = np.sort(100 * errors(by_kind[kind]))
            e = e[np.isfinite(e)]
            axes.step(
                np.minimum(e, TALLEST),
                (np.arange(len(e)) + 1) / max(len(e), 1),
                color=COLOURS[kind],
                label=text,
                where="post",
            )
    axes.set(xlabel="error of the place [cm]", ylabel="share of trials", xlim=(0.3, TALLEST), ylim=(0, 1), xscale="log")
    axes.legend(fontsize=7, loc="upper left")
    tidy(axes)


def told_and_true(axes: Axes, by_kind: Mapping[str, Case]) -> None:
    """The error along the worst direction against what was told."""
    top = 0.2
    for kind, text in TITLES.items():
        if kind in by_kind:
            deviation, along = told(by_kind[kind])
            axes.plot(100 * deviation, 100 * np.minimum(along, 3), ".", color=COLOURS[kind], markersize=4, label=text)
            top = max(top, float(np.nanmax(100 * deviation, initial=top)))
    axes.plot([0.1, top], [0.2, 2 * top], color=GOAL, linewidth=0.9, linestyle="--", label="two deviations")
    axes.set(
        xlabel="standard deviation told [cm]", ylabel="error along that direction [cm]", xscale="log", yscale="log"
    )
    axes.set_ylim(0.01, None)
    axes.legend(fontsize=7, loc="lower right")
    tidy(axes)


def error_figure(by_kind: Mapping[str, Case]) -> Figure:
    """Errors by the way, their shares, and what was told of them."""
    figure = new_figure(14.5, 4.2)
    left, middle, right = figure.subplots(1, 3)
    if "finger" in by_kind:
        by_way(left, by_kind["finger"])
    shares(middle, by_kind)
    told_and_true(right, by_kind)
    return figure


def draw(folder: Path, first: Mapping[str, Case], by_kind: Mapping[str, Case]) -> list[str]:
    """Draws all figures; their names.

    Args:
        first: cases of the first scene, by kind.
        by_kind: trials of all scenes.
    """
    if not any(kind in by_kind for kind in TITLES):
        return []
    folder.mkdir(parents=True, exist_ok=True)
    above_figure(first).savefig(folder / "above.png", dpi=90)
    error_figure(by_kind).savefig(folder / "errors.png", dpi=90)
    return ["above.png", "errors.png"]
