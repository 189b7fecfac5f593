"""Figures of a run, from its stored objects."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcjax.grasp.arm_motion import CLOSE, RATE
from hrcjax.grasp.gripper import Gripper
from hrcjax.lab.atomic import replace_file, write_bytes
from hrcjax.lab.case_store import Case
from hrcjax.viz.style import BEST, OBSTACLE, TEXT, WORST, as_row, heading, new_figure, tidy

from .animation import lift_gif
from .case import EACH
from .objects import shape_named
from .picture import Viewpoint, picture
from .rows import by_shape, came, errors
from .scene import make_scene

WORDS = {"hessian": "Hessian of the field", "pca": "plane through 16 points", "nearest": "nearest point"}
COLOURS = {"hessian": BEST, "pca": WORST, "nearest": OBSTACLE}
SHOWN = 10
"""Candidates drawn on an object beside the chosen one."""
EYE = np.array([0.3, -0.36, 0.33])
"""Of the pictures, from the object [m]."""


def _glyph(R: NDArray, p: NDArray, opening: float, gripper: Gripper) -> NDArray:
    """The gripper as one line: tip, finger, palm, finger, tip (point, 3) [m]."""
    y, z = R[:, 1] * opening / 2, R[:, 2]
    tip, palm = p + gripper.pad[1] * z, p - gripper.length * z
    return np.array([tip + y, palm + y, palm - y, tip - y])


def _draw_candidates(axes: Axes, name: str, case: Case, way: str = "hessian") -> None:
    """Candidates on the picture of an object: the chosen one thick, its contacts as dots, others thin."""
    gripper = Gripper()
    scene = make_scene(shape_named(name), (case["place"], float(case["yaw"]), int(case["rest"])), gripper)
    middle = np.array([*case["place"], 0.06])
    view = Viewpoint(middle + EYE, middle, 340, 320, 820.0)
    axes.imshow(picture(scene, view), interpolation="bilinear")
    free, taken = np.flatnonzero(case[f"{way}_free"]), int(case[f"{way}_taken"])
    some = free[np.unique(np.linspace(0, len(free) - 1, min(SHOWN, len(free))).astype(int))] if len(free) else free
    for g in [*some, *([taken] if taken >= 0 else [])]:
        glyph = _glyph(case[f"{way}_R"][g], case[f"{way}_p"][g], float(case[f"{way}_opening"][g]), gripper)
        line = view.project(glyph)
        chosen = g == taken
        axes.plot(*line.T, color=BEST if chosen else "#555555", linewidth=2.4 if chosen else 0.7, alpha=1 if chosen else 0.55)  # fmt: skip
    if taken >= 0:
        touched = case["points"][case[f"{way}_contact"][taken]]
        axes.scatter(*view.project(touched).T, color="#c0182b", s=14, zorder=5)
    axes.set_xlim(0, view.width)
    axes.set_ylim(view.height, 0)
    axes.set_axis_off()
    axes.set_title(f"{name.replace('_', ' ')}: {len(free)} free", fontsize=9, color=TEXT)


def candidates_figure(cases: Mapping[str, Case]) -> Figure:
    """Candidates on one object of each shape."""
    firsts: dict[str, Case] = {}
    for name, case in cases.items():
        firsts.setdefault(name.split("/")[0], case)
    columns = min(5, len(firsts))
    figure = new_figure(2.6 * columns, 2.7 * -(-len(firsts) // columns) + 0.3)
    panels = as_row(figure.subplots(-(-len(firsts) // columns), columns))
    for axes in panels:
        axes.set_axis_off()
    for axes, (name, case) in zip(panels, firsts.items(), strict=False):
        _draw_candidates(axes, name, case)
    heading(figure, "Grasps by Hessian normals; thick: chosen, dots: its contacts")
    return figure


def normals_figure(cases: Mapping[str, Case]) -> Figure:
    """How many normals are off by less than an angle; medians by shape."""
    objects = list(cases.values())
    figure = new_figure(11, 3.8)
    left, right = as_row(figure.subplots(1, 2))
    for way, words in WORDS.items():
        off = np.sort(errors(objects, way))
        left.plot(off, np.arange(1, len(off) + 1) / len(off), color=COLOURS[way], label=f"{words} ({len(off) / len(objects):.0f} places)")  # fmt: skip
    for way, style in (("hessian", ":"), ("pca", ":")):
        off = np.sort(errors(objects, way, same=True))
        left.plot(off, np.arange(1, len(off) + 1) / len(off), style, color=COLOURS[way], linewidth=1)
    left.set(xlim=(0, 40), ylim=(0, 1), xlabel="error of the normal [deg]", ylabel="share of places that may be used")
    left.legend(fontsize=7, frameon=False, title="dotted: where both may be used", title_fontsize=7)
    shapes = list(dict.fromkeys(name.split("/")[0] for name in cases))
    for k, way in enumerate(WORDS):
        for which, mark in ((50, "o"), (95, "_")):
            off = [errors([c for n, c in cases.items() if n.startswith(f"{shape}/")], way) for shape in shapes]
            values = [np.percentile(one, which) if len(one) else np.nan for one in off]
            right.plot(np.arange(len(shapes)) + 0.2 * (k - 1), values, mark, color=COLOURS[way], markersize=5)
    right.set_xticks(range(len(shapes)), [s.replace("_", "\n") for s in shapes], fontsize=7)
    right.set(ylabel="error [deg]", ylim=(0, None))
    right.set_title("median (dot) and 95th percentile (bar)", fontsize=8)
    for axes in (left, right):
        tidy(axes)
    heading(figure, "Normals against the exact ones")
    return figure


def lifted_figure(cases: Mapping[str, Case], frictions: Sequence[float]) -> Figure:
    """Share lifted by shape and by friction of the pads, and how well the chosen grasps close."""
    figure = new_figure(12, 3.6)
    left, middle, right = as_row(figure.subplots(1, 3, width_ratios=(1.5, 1, 1)))
    for k, (way, words) in enumerate(WORDS.items()):
        shares = by_shape(cases, way)
        left.bar(np.arange(len(shares)) + 0.27 * (k - 1), list(shares.values()), 0.25, color=COLOURS[way], label=words)
        left.set_xticks(range(len(shares)), [s.replace("_", "\n") for s in shares], fontsize=6)
        lifted = np.mean([case[f"{way}_lifted"] for case in cases.values()], axis=0)
        middle.plot(frictions, lifted, "o-", color=COLOURS[way], markersize=4)
        angle = np.sort(np.rad2deg([float(case[f"{way}_true_angle"]) for case in cases.values() if case[f"{way}_taken"] >= 0]))  # fmt: skip
        right.plot(angle, np.arange(1, len(angle) + 1) / len(cases), drawstyle="steps-post", color=COLOURS[way])
    left.axhline(0.8, color=TEXT, linewidth=0.8, linestyle="--")
    left.set(ylabel="share lifted", ylim=(0, 1.25))
    left.set_title(f"pads with a friction of {frictions[0]:g}; dashed: the bar over all", fontsize=8)
    left.legend(fontsize=7, frameon=False, ncols=3, loc="upper center")
    middle.set(xlabel="coefficient of friction of the pads", ylabel="share lifted", ylim=(0, 1.05))
    right.set(xlabel="closing axis off the exact normals [deg]", ylabel="share of objects", ylim=(0, 1.05), xlim=(0, None))  # fmt: skip
    for axes in (left, middle, right):
        tidy(axes)
    return figure


def reach_figure(cases: Mapping[str, Case]) -> Figure | None:
    """The tool points from above and from the side, and their distances from the grasps over time."""
    some = [case for case in cases.values() if "moved_p" in case]
    if not some:
        return None
    figure = new_figure(12, 3.8)
    above, side, time = as_row(figure.subplots(1, 3))
    for case in some:
        p, good = case["moved_p"], came(case)
        colour, goal = BEST if good else WORST, case["hessian_p"][int(case["hessian_taken"])]
        above.plot(p[:, 0], p[:, 1], color=colour, linewidth=0.7, alpha=0.6)
        side.plot(p[:, 1], p[:, 2], color=colour, linewidth=0.7, alpha=0.6)
        above.plot(*goal[:2], ".", color=colour, markersize=3)
        side.plot(*goal[1:], ".", color=colour, markersize=3)
        seconds = np.arange(len(p)) * EACH / RATE
        time.plot(seconds, np.maximum(1e3 * np.linalg.norm(p - goal, axis=1), 0.05), color=colour, linewidth=0.7, alpha=0.6)  # fmt: skip
    time.axhline(1e3 * CLOSE, color=TEXT, linewidth=0.8, linestyle="--")
    time.set(yscale="log", xlabel="time [s]", ylabel="tool point to grasp [mm]")
    above.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    side.set(xlabel="y [m]", ylabel="z [m]", aspect="equal")
    for axes in (above, side, time):
        tidy(axes)
    heading(figure, "The tool point on its way from home to the grasps; red: not within 5 mm and 3 degrees, or touched")
    return figure


def _upward(case: Case) -> float:
    """How little the chosen approach goes straight down, with sides that face the picture first [1]."""
    R = case["hessian_R"][int(case["hessian_taken"])]
    return float(R[2, 2] - 0.5 * abs(R[:, 1] @ [0.8, 0.6, 0.0]))


def draw(folder: Path, cases: Mapping[str, Case], frictions: Sequence[float]) -> list[str]:
    """Draws all figures into a folder; their names."""
    folder.mkdir(exist_ok=True)
    figures = {
        "candidates.png": candidates_figure(cases),
        "normals.png": normals_figure(cases),
        "lifted.png": lifted_figure(cases, frictions),
    }
    way = reach_figure(cases)
    if way is not None:
        figures["reach.png"] = way
    for name, figure in figures.items():
        replace_file(folder / name, lambda path, figure=figure: figure.savefig(path, dpi=110, format="png"))
    lifted = [name for name, case in cases.items() if case["hessian_lifted"][0]]
    if not lifted:
        return list(figures)
    shown = min(lifted, key=lambda name: _upward(cases[name]))
    write_bytes(folder / "lift.gif", lift_gif(shown.split("/")[0], cases[shown]))
    return [*figures, "lift.gif"]
