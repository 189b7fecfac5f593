"""Random tables: one to eight spheres, upright cylinders and turned boxes of 3 to 15 cm, whose exact shapes are the truth."""

import numpy as np
from numpy.typing import NDArray

from hrcjax.world import Scene, robotica
from hrcjax.world.scene import BOX, COLUMN, SPHERE
from hrcjax.world.scenes import Obstacle, make_scene

LOWER, UPPER = np.array([-0.1, 0.15]), np.array([0.9, 0.75])
"""Where middles of things lie: about the middle of the Robotica paper's path, where both cameras look [m]."""
SMALL, LARGE = 0.03, 0.15
"""Least and greatest edge, height or diameter [m]."""
GAP = 0.002
"""Least gap between the upright cylinders about two things [m]."""
TOUCHING = 5
"""In every n-th table the second thing is put beside the first with this least gap."""
SAMPLES = 1500
"""Points on the surface of a thing, spread evenly by area."""


def hull(o: Obstacle) -> float:
    """Radius of the upright cylinder about an obstacle [m]."""
    return float(np.hypot(o.size[0], o.size[1])) if o.kind == BOX else o.size[0]


def _draw(draw: np.random.Generator) -> Obstacle:
    kind = int(draw.choice([SPHERE, COLUMN, BOX]))
    edges = draw.uniform(SMALL, LARGE, 3) / 2
    if kind == SPHERE:
        size = (edges[0],) * 3
    elif kind == COLUMN:
        size = (edges[0], edges[0], edges[2])
    else:
        size = tuple(edges)
    spot = draw.uniform(LOWER, UPPER)
    yaw = float(draw.uniform(0, np.pi / 2)) if kind == BOX else 0.0
    numbers = tuple(float(v) for v in size)
    return Obstacle(kind, (float(spot[0]), float(spot[1]), numbers[2]), numbers, yaw, numbers[0])  # pyright: ignore[reportArgumentType]  # three numbers


def table_of(seed: int) -> list[Obstacle]:
    """The things on the table of a seed."""
    draw = np.random.default_rng([2002, seed])
    count = int(draw.integers(1, 9))
    things: list[Obstacle] = []
    while len(things) < count:
        new = _draw(draw)
        if seed % TOUCHING == 0 and len(things) == 1:
            first, angle = things[0], draw.uniform(0, 2 * np.pi)
            away = hull(first) + hull(new) + GAP
            x, y = first.center[0] + away * np.cos(angle), first.center[1] + away * np.sin(angle)
            new = new._replace(center=(float(x), float(y), new.center[2]))
        if all(np.hypot(new.center[0] - o.center[0], new.center[1] - o.center[1]) >= hull(new) + hull(o) + GAP - 1e-9 for o in things):  # fmt: skip
            things.append(new)
    return things


def scene_of(things: list[Obstacle]) -> Scene:
    """A scene of these things, with the Robotica paper's task: its cameras look at the middle of the path."""
    like = robotica()
    return make_scene(things, *(np.asarray(v, float).tolist() for v in (like.start, like.goal, like.lower, like.upper)))


def surface(o: Obstacle, draw: np.random.Generator, count: int = SAMPLES) -> NDArray:
    """Points drawn evenly on the surface of an obstacle, its lower side too [m]."""
    if o.kind == SPHERE:
        way = draw.normal(size=(count, 3))
        return np.array(o.center) + o.size[0] * way / np.linalg.norm(way, axis=1, keepdims=True)
    u = draw.uniform(-1, 1, (count, 3))
    if o.kind == COLUMN:
        r, h = o.size[0], o.size[2]
        angle = np.pi * u[:, 0]
        mantle = draw.uniform(size=count) < 2 * h / (2 * h + r)
        far = np.where(mantle, r, r * np.sqrt(np.abs(u[:, 1])))
        z = np.where(mantle, h * u[:, 2], h * np.sign(u[:, 2]))
        return np.array(o.center) + np.stack([far * np.cos(angle), far * np.sin(angle), z], -1)
    a, b, c = o.size
    areas = np.array([b * c, a * c, a * b])
    axis = draw.choice(3, count, p=areas / areas.sum())
    u[np.arange(count), axis] = np.sign(u[np.arange(count), axis])
    local = u * o.size
    cos, sin = np.cos(o.yaw), np.sin(o.yaw)
    return np.array(o.center) + np.stack([cos * local[:, 0] - sin * local[:, 1], sin * local[:, 0] + cos * local[:, 1], local[:, 2]], -1)  # fmt: skip
