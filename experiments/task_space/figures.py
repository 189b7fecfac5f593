"""Figures: a table from above as it is and as it was found, true against found sizes; a recorded frame with its plane and things."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray
from PIL import Image

from hrcjax.lab.atomic import replace_file
from hrcjax.lab.case_store import Case
from hrcjax.task_space import POINTS, Instance, ObstacleGrid, TaskSpace, View
from hrcjax.task_space.view import in_image, points
from hrcjax.viz.style import OBSTACLE, label, new_figure, tidy
from hrcjax.world.scene import BOX
from hrcjax.world.scenes import Obstacle

COLOURS = ("#1f5fa8", "#d0702e", "#2a9d5c", "#7a4fa3", "#c77dba", "#a08000", "#008b8b", "#b03060")
KINDS = {-1: "points", 0: "sphere", 1: "column", 2: "box"}


def _footprint(axes: Axes, kind: int, center: NDArray, size: NDArray, yaw: float, **style: object) -> None:
    if kind in (BOX, POINTS):
        corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * size[:2]
        c, s = np.cos(yaw), np.sin(yaw)
        axes.add_patch(Polygon(corners @ np.array([[c, s], [-s, c]]) + center[:2], **style))  # pyright: ignore[reportArgumentType]  # keywords of a patch
    else:
        axes.add_patch(Circle((float(center[0]), float(center[1])), float(size[0]), **style))  # pyright: ignore[reportArgumentType]


def grid_image(grid: ObstacleGrid) -> Image.Image:
    """The grid as a picture, a pixel a cell, y upwards: white where an obstacle stands, black elsewhere."""
    return Image.fromarray((255 * grid.cells.T[::-1]).astype(np.uint8))


def write_grid(folder: Path, grid: ObstacleGrid, name: str = "grid") -> None:
    """Writes the grid as NAME.png and NAME.npz, with its corner and edge in metres."""
    replace_file(folder / f"{name}.png", lambda path: grid_image(grid).save(path, format="PNG"))

    def arrays(path: Path) -> None:
        with open(path, "wb") as file:
            np.savez_compressed(file, cells=grid.cells, seen=grid.seen, lower=grid.lower, edge=grid.edge)

    replace_file(folder / f"{name}.npz", arrays)


def table_figure(path: Path, things: list[Obstacle], found: TaskSpace, grid: ObstacleGrid) -> None:
    """A table from above: what stands there and what was found; and the obstacle grid."""
    figure = new_figure(10, 4.2)
    left, right = figure.subplots(1, 2)
    for o in things:
        _footprint(left, o.kind, np.array(o.center), np.array(o.size), o.yaw, facecolor=OBSTACLE, alpha=0.4, edgecolor="none")  # fmt: skip
    for k, one in enumerate(found.instances):
        colour = COLOURS[k % len(COLOURS)]
        left.plot(*one.points[:: max(1, len(one.points) // 300), :2].T, ".", ms=1.5, color=colour)
        _footprint(left, one.kind, one.center, one.size, one.yaw, fill=False, edgecolor=colour, lw=1.5)
    low, high = grid.lower, grid.lower + np.array(grid.cells.shape) * grid.edge
    right.imshow(grid.cells.T, origin="lower", cmap="gray", extent=(low[0], high[0], low[1], high[1]))
    left.set_title("grey: what stands there; lines: what was found")
    right.set_title(f"obstacle grid: 1 white, 0 black, cells of {100 * grid.edge:g} cm")
    for axes in (left, right):
        axes.set(xlabel=label("x", "m"), ylabel=label("y", "m"), xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")  # fmt: skip
        tidy(axes)
    replace_file(path, lambda file: figure.savefig(file, dpi=120, format="png"))


def size_figure(path: Path, cases: list[Case]) -> None:
    """Errors of centre and size over the true size of things."""
    figure = new_figure(9, 3.4)
    both = figure.subplots(1, 2, sharey=True)
    for axes, name in zip(both, ("centre_error", "size_error"), strict=True):
        for kind in (0, 1, 2):
            x = np.concatenate([2 * case["size"].max(1)[case["kind"] == kind] for case in cases])
            y = np.concatenate([case[name][case["kind"] == kind] for case in cases])
            axes.semilogy(100 * x, 1e3 * np.maximum(y, 1e-5), ".", color=COLOURS[kind], label=KINDS[kind])
        axes.axhline(10, color="#999999", lw=0.8)
        axes.set(xlabel=label("largest edge or diameter", "cm"), title=name.replace("_", " "))
        tidy(axes)
    both[0].set_ylabel(label("error", "mm"))
    both[0].legend(fontsize=8)
    replace_file(path, lambda file: figure.savefig(file, dpi=120, format="png"))


def outline(one: Instance) -> list[NDArray]:
    """Lines on the surface of an instance, in the table's frame [m]."""
    turn = np.linspace(0, 2 * np.pi, 41)
    ring = np.stack([np.cos(turn), np.sin(turn)], -1)
    if one.kind == 0:
        r = one.size[0]
        flat = np.zeros((len(ring), 3))
        lines = []
        for a, b in ((0, 1), (0, 2), (1, 2)):
            line = flat.copy()
            line[:, a], line[:, b] = r * ring[:, 0], r * ring[:, 1]
            lines.append(line + one.center)
        return lines
    if one.kind == 1:
        ends = [np.column_stack([one.size[0] * ring, np.full(len(ring), z)]) for z in (-one.size[2], one.size[2])]
        sides = [np.stack([ends[0][k], ends[1][k]]) for k in range(0, 40, 10)]
    else:
        c, s = np.cos(one.yaw), np.sin(one.yaw)
        corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]) * one.size[:2] @ np.array([[c, s], [-s, c]])
        ends = [np.column_stack([corners, np.full(5, z)]) for z in (-one.size[2], one.size[2])]
        sides = [np.stack([ends[0][k], ends[1][k]]) for k in range(4)]
    return [line + one.center for line in (*ends, *sides)]


def _dense(line: NDArray) -> NDArray:
    at = np.linspace(0, len(line) - 1, 8 * (len(line) - 1) + 1)
    return np.stack([np.interp(at, np.arange(len(line)), line[:, a]) for a in range(3)], -1)


def frame_figure(path: Path, found: TaskSpace, view: View, title: str, grid: ObstacleGrid) -> None:
    """A recorded frame: its picture with the things drawn in; heights over the plane; the grid.

    Args:
        view: in the table's frame.
    """
    figure = new_figure(15, 4.6)
    left, middle, right = figure.subplots(1, 3)
    shape = view.depth.shape
    picture = np.where(view.depth > 0, view.depth, np.nan) if view.colour is None else view.colour
    height = np.where(view.depth > 0, points(view)[..., 2], np.nan)
    left.imshow(picture)
    shown = middle.imshow(height, cmap="coolwarm", vmin=-0.5, vmax=0.5)
    middle.contour(np.nan_to_num(np.abs(height), nan=1.0) < 0.02, [0.5], colors="k", linewidths=0.5)
    figure.colorbar(shown, ax=middle, label=label("height over the plane", "m"), shrink=0.7)
    for k, one in enumerate(found.instances):
        colour = COLOURS[k % len(COLOURS)]
        for axes in (left, middle):
            for line in outline(one):
                at, z = in_image(view, _dense(line))
                at[z <= 0.05] = np.nan
                axes.plot(*at.T, color=colour, lw=1.2)
        at, _ = in_image(view, one.center)
        left.text(*at, f"{k + 1} {KINDS[one.kind]}", color="white", fontsize=7, clip_on=True, bbox={"facecolor": colour, "pad": 1, "lw": 0})  # fmt: skip
    for axes in (left, middle):
        axes.set(xlim=(0, shape[1]), ylim=(shape[0], 0), xticks=[], yticks=[])
    low, high = grid.lower, grid.lower + np.array(grid.cells.shape) * grid.edge
    right.imshow(grid.cells.T + 0.3 * grid.seen.T * (grid.cells.T == 0), vmin=0, vmax=1, origin="lower", cmap="gray", extent=(low[0], high[0], low[1], high[1]))  # fmt: skip
    right.set(xlabel=label("x", "m"), ylabel=label("y", "m"), title="1 white; 0 dark: grey seen, black not seen")
    left.set_title(title)
    middle.set_title("black line: within 2 cm of the plane")
    replace_file(path, lambda file: figure.savefig(file, dpi=90, format="png"))
