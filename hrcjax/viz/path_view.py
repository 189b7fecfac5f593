"""Paths among obstacles and a person, in plan and in three dimensions."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from hrcjax.viz.style import BEST, GOAL, OBSTACLE, PERSON, START, TEXT, heading, new_figure, tidy

SPHERE, COLUMN, BOX = 0, 1, 2


class Obstacles(NamedTuple):
    """Obstacles of a scene, in arrays of fixed capacity."""

    kind: Int[np.ndarray, "obstacle"]
    """0 sphere, 1 column, 2 box."""
    center: Float[np.ndarray, "obstacle 3"]
    """Centre [m]."""
    size: Float[np.ndarray, "obstacle 3"]
    """Half extents; the radius of spheres and columns comes first, half the height of columns last [m]."""
    yaw: Float[np.ndarray, "obstacle"]
    """Rotation about the vertical axis [rad]."""
    mask: Bool[np.ndarray, "obstacle"]
    """True where an obstacle exists."""


class PersonPoses(NamedTuple):
    """Capsules of a person at several times."""

    a: Float[np.ndarray, "time capsule 3"]
    """One end [m]."""
    b: Float[np.ndarray, "time capsule 3"]
    """Other end [m]."""
    radius: Float[np.ndarray, "capsule"]
    """Radius; zero or negative: no capsule [m]."""
    times: Float[np.ndarray, "time"]
    """Time of each pose [s]."""


class PathLine(NamedTuple):
    """One path to draw."""

    points: Float[np.ndarray, "point 3"]
    """Positions [m]."""
    name: str
    colour: str = BEST
    dashed: bool = False


def capsule_outline(
    a: Float[np.ndarray, "2"], b: Float[np.ndarray, "2"], radius: float, arc: int = 16
) -> Float[np.ndarray, "corner 2"]:
    """Outline of a capsule projected along one axis: two half circles joined by straight lines [m]."""
    along = b - a
    angle = float(np.arctan2(along[1], along[0])) if np.linalg.norm(along) > 1e-9 else 0.0
    turn = np.linspace(-np.pi / 2, np.pi / 2, arc)
    cap = lambda shift: radius * np.stack([np.cos(angle + shift + turn), np.sin(angle + shift + turn)], axis=1)  # noqa: E731
    return np.concatenate([b + cap(0.0), a + cap(np.pi)])


def _shades(count: int) -> Float[np.ndarray, "time"]:
    """Opacity of poses, increasing with time."""
    return np.linspace(0.08, 0.22, count) if count > 1 else np.array([0.2])


def plan_view(
    paths: Sequence[PathLine],
    obstacles: Obstacles | None = None,
    person: PersonPoses | None = None,
    start: Float[np.ndarray, "3"] | None = None,
    goal: Float[np.ndarray, "3"] | None = None,
    title: str = "",
    axes: Axes | None = None,
) -> tuple[Figure, Axes]:
    """View from above, x to the right and y up; earlier poses of the person are more transparent."""
    if axes is None:
        figure = new_figure(6.4, 6.0)
        axes = figure.subplots()
    else:
        figure = axes.get_figure(root=True)
        assert figure is not None
    if person is not None:
        draw_person(axes, person)
    if obstacles is not None:
        draw_obstacles(axes, obstacles)
        axes.add_patch(Rectangle((0, 0), 0, 0, color=OBSTACLE, label="obstacle"))
    for path in paths:
        style = "--" if path.dashed else "-"
        axes.plot(path.points[:, 0], path.points[:, 1], style, color=path.colour, lw=2, label=path.name, zorder=5)
    draw_ends(axes, start, goal)
    low, high = window(paths, obstacles, start, goal, person)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.grid(alpha=0.25)
    tidy(axes)
    axes.legend(fontsize=8, framealpha=0.9, loc="best")
    if title:
        axes.set_title(title, fontsize=10, color=TEXT)
    return figure, axes


def draw_obstacles(axes: Axes, obstacles: Obstacles) -> None:
    """Obstacles from above."""
    for i in np.flatnonzero(obstacles.mask):
        axes.add_patch(_footprint(obstacles, int(i)))


def draw_person(axes: Axes, person: PersonPoses) -> None:
    """The person's capsules from above at every time, with one entry in the legend."""
    for a, b, alpha in zip(person.a, person.b, _shades(len(person.times)), strict=True):
        for k in np.flatnonzero(person.radius > 0):
            outline = capsule_outline(a[k, :2], b[k, :2], float(person.radius[k]))
            axes.add_patch(Polygon(outline, facecolor=PERSON, edgecolor="none", alpha=float(alpha), zorder=2))
    when = ", ".join(f"{time:.1f}" for time in person.times)
    axes.add_patch(Rectangle((0, 0), 0, 0, color=PERSON, alpha=0.5, label=f"person at {when} s"))


def _footprint(obstacles: Obstacles, i: int) -> Circle | Rectangle:
    x, y = obstacles.center[i, :2]
    half = obstacles.size[i]
    if obstacles.kind[i] == BOX:
        corner, turn = (x - half[0], y - half[1]), float(np.degrees(obstacles.yaw[i]))
        return Rectangle(
            corner, 2 * half[0], 2 * half[1], angle=turn, rotation_point="center", color=OBSTACLE, zorder=3
        )
    return Circle((x, y), half[0], color=OBSTACLE, zorder=3)


def draw_ends(axes: Axes, start: np.ndarray | None, goal: np.ndarray | None, size: float = 8.0) -> None:
    """Start and goal, in plan or in three dimensions; size of the marks in [pt]."""
    for spot, colour, marker, name in ((start, START, "o", "start"), (goal, GOAL, "X", "goal")):
        if spot is not None:
            at = [[value] for value in (spot if isinstance(axes, Axes3D) else spot[:2])]
            axes.plot(*at, marker, color=colour, markersize=size, markeredgecolor="white", label=name, zorder=6)


def window(
    paths: Sequence[PathLine],
    obstacles: Obstacles | None,
    start: np.ndarray | None,
    goal: np.ndarray | None,
    person: PersonPoses | None,
    margin: float = 0.12,
    aside: float = 0.35,
) -> tuple[np.ndarray, np.ndarray]:
    """A box around the paths, the obstacles and the parts of the person near them [m].

    Args:
        margin: around all [m].
        aside: largest room for the person beyond that [m].
    """
    corners = [path.points[np.isfinite(path.points).all(axis=1)] for path in paths]
    corners += [spot[None] for spot in (start, goal) if spot is not None]
    if obstacles is not None and obstacles.mask.any():
        reach = np.maximum(obstacles.size[obstacles.mask], obstacles.size[obstacles.mask][:, :1])
        center = obstacles.center[obstacles.mask]
        corners += [center - reach, center + reach]
    points = np.concatenate(corners) if corners else np.zeros((1, 3))
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    if person is not None and (person.radius > 0).any():
        there = person.radius > 0
        ends = np.concatenate([person.a[:, there].reshape(-1, 3), person.b[:, there].reshape(-1, 3)])
        room = np.array([aside, aside, 0.5])
        low = np.minimum(low, np.maximum(ends.min(axis=0) - margin, low - room))
        high = np.maximum(high, np.minimum(ends.max(axis=0) + margin, high + room))
    low[2] = max(low[2], 0.0)
    return low, high


def _capsule_surface(a: np.ndarray, b: np.ndarray, radius: float, rings: int = 4, sides: int = 14) -> np.ndarray:
    """Corners of a capsule's surface, one ring after the other, shape (ring, side, 3) [m]."""
    along = b - a
    length = float(np.linalg.norm(along))
    w = along / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
    helper = np.array([1.0, 0.0, 0.0]) if abs(w[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    u = np.cross(w, helper)
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    around = np.linspace(0, 2 * np.pi, sides)
    ring = np.cos(around)[:, None] * u + np.sin(around)[:, None] * v
    up = np.linspace(0, np.pi / 2, rings)
    lower = [a + radius * (np.cos(t) * ring - np.sin(t) * w) for t in up[::-1]]
    upper = [b + radius * (np.cos(t) * ring + np.sin(t) * w) for t in up]
    return np.stack(lower + upper)


def _solid(obstacles: Obstacles, i: int) -> list[np.ndarray]:
    """Faces of an obstacle as polygons [m]."""
    center, half = obstacles.center[i], obstacles.size[i]
    if obstacles.kind[i] == SPHERE:
        return _quads(_capsule_surface(center, center, float(half[0]), 8, 20))
    if obstacles.kind[i] == COLUMN:
        around = np.linspace(0, 2 * np.pi, 25)
        outline = half[0] * np.stack([np.cos(around), np.sin(around)], axis=1)
    else:
        c, s = np.cos(obstacles.yaw[i]), np.sin(obstacles.yaw[i])
        signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
        outline = (signs * half[:2]) @ np.array([[c, s], [-s, c]])
    rings = [center + np.column_stack([outline, np.full(len(outline), z)]) for z in (-half[2], half[2])]
    return [*_quads(np.stack(rings)), rings[0], rings[1]]


def _quads(surface: np.ndarray) -> list[np.ndarray]:
    """The faces between neighbouring corners of a surface (row, column, 3)."""
    a, b, c, d = surface[:-1, :-1], surface[1:, :-1], surface[1:, 1:], surface[:-1, 1:]
    return list(np.stack([a, b, c, d], axis=2).reshape(-1, 4, 3))


def _add_faces(
    axes: Axes3D, faces: list[np.ndarray], colour: str, alpha: float, low: np.ndarray, high: np.ndarray
) -> None:
    """Adds the faces whose centre is inside the window, as 3-D axes do not clip."""
    inside = [face for face in faces if (low <= face.mean(axis=0)).all() and (face.mean(axis=0) <= high).all()]
    if inside:
        body = Poly3DCollection(inside, facecolor=colour, edgecolor="none", alpha=alpha)
        axes.add_collection3d(body, autolim=False)  # automatic limits of polygons of unequal size are not finite


def view_3d(
    paths: Sequence[PathLine],
    obstacles: Obstacles | None = None,
    person: PersonPoses | None = None,
    start: Float[np.ndarray, "3"] | None = None,
    goal: Float[np.ndarray, "3"] | None = None,
    title: str = "",
    axes: Axes3D | None = None,
    elevation: float = 28.0,
    azimuth: float = -115.0,
) -> tuple[Figure, Axes3D]:
    """Paths, obstacles and the person's capsules in perspective, from `elevation` and `azimuth` [deg]."""
    if axes is None:
        figure = new_figure(7.0, 6.2)
        axes = figure.add_subplot(projection="3d")
    else:
        figure = axes.get_figure(root=True)
        assert figure is not None
    low, high = window(paths, obstacles, start, goal, person)
    if person is not None:
        for a, b, alpha in zip(person.a, person.b, _shades(len(person.times)), strict=True):
            capsules = [(a[k], b[k], float(person.radius[k])) for k in np.flatnonzero(person.radius > 0)]
            faces = [face for capsule in capsules for face in _quads(_capsule_surface(*capsule))]
            _add_faces(axes, faces, PERSON, float(alpha) / 2, low, high)
    if obstacles is not None:
        faces = [face for i in np.flatnonzero(obstacles.mask) for face in _solid(obstacles, int(i))]
        _add_faces(axes, faces, OBSTACLE, 0.45, low, high)
    for path in paths:
        axes.plot(*path.points.T, "--" if path.dashed else "-", color=path.colour, lw=2, label=path.name, zorder=5)
        shadow = np.column_stack([path.points[:, :2], np.zeros(len(path.points))])
        axes.plot(*shadow.T, color=path.colour, lw=0.8, alpha=0.35)
    draw_ends(axes, start, goal)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.view_init(elev=elevation, azim=azimuth)
    axes.tick_params(labelsize=7)
    if title:
        axes.set_title(title, fontsize=10, color=TEXT)
    return figure, axes


def path_views(
    paths: Sequence[PathLine],
    obstacles: Obstacles | None = None,
    person: PersonPoses | None = None,
    start: Float[np.ndarray, "3"] | None = None,
    goal: Float[np.ndarray, "3"] | None = None,
    title: str = "",
) -> tuple[Figure, list[Axes]]:
    """The view from above and the 3-D view side by side."""
    figure = new_figure(13.0, 6.2)
    flat = figure.add_subplot(1, 2, 1)
    deep = figure.add_subplot(1, 2, 2, projection="3d")
    plan_view(paths, obstacles, person, start, goal, axes=flat)
    view_3d(paths, obstacles, person, start, goal, axes=deep)
    legend = flat.get_legend()
    if legend is not None:
        legend.remove()
    figure.legend(*flat.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    heading(figure, title)
    return figure, [flat, deep]
