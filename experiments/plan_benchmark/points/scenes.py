"""Seeded scenes: obstacles on the straight line from start to goal, and a check that a way exists."""

from collections import Counter
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from hrcjax.reference.truth import solid_distance
from hrcjax.world import Scene
from hrcjax.world.scene import BOX, COLUMN, SPHERE
from hrcjax.world.scenes import Obstacle, make_scene

CLEARANCE = 0.03
"""Surface distance that every planner must keep to every obstacle [m]."""
LOWER, UPPER = np.array([-0.05, 0.1, 0.02]), np.array([0.85, 0.85, 0.6])
"""Bounds of all paths: those of the Robotica paper's scene [m]."""
MOST = 6
"""Obstacles in a scene: 1 to this many, drawn evenly."""
LEAST_WAY = 0.5
"""Least distance from start to goal [m]."""
ENDS_APART = CLEARANCE + 0.02
"""Least distance of start and goal from obstacles [m]."""
TRIES = 50
"""Draws of one obstacle before the scene is given up."""
CELL = 0.01
"""Edge of the grid that tells whether a way exists [m]."""


@dataclass(frozen=True)
class PointScene:
    """A scene in plain numbers."""

    start: NDArray
    """[m]"""
    goal: NDArray
    """[m]"""
    kind: NDArray
    """(obstacle) SPHERE, COLUMN or BOX"""
    center: NDArray
    """(obstacle 3) [m]"""
    size: NDArray
    """(obstacle 3) half extents [m]"""
    yaw: NDArray
    """(obstacle) [rad]"""
    lower: NDArray
    """Bounds of the path [m]."""
    upper: NDArray
    """Bounds of the path [m]."""

    def distances(self, x: NDArray) -> NDArray:
        """Signed distance of points (... 3) to every obstacle, (obstacle ...) [m]."""
        found = [solid_distance(*solid, x) for solid in zip(self.kind, self.center, self.size, self.yaw, strict=True)]
        return np.stack(found)

    def for_library(self, radius: float = CLEARANCE, dtype: Any = jnp.float32) -> Scene:
        """The same as the library's scene; all characteristic radii are `radius`, so that zeta asks for one distance."""
        solids = [
            Obstacle(int(kind), tuple(center.tolist()), tuple(size.tolist()), float(yaw), radius)
            for kind, center, size, yaw in zip(self.kind, self.center, self.size, self.yaw, strict=True)
        ]
        ends = (self.start.tolist(), self.goal.tolist(), self.lower.tolist(), self.upper.tolist())
        return make_scene(solids, *ends, dtype=dtype, capacity=max(MOST, len(solids)))


def _ends(draw: np.random.Generator) -> tuple[NDArray, NDArray]:
    low, high = LOWER + np.array([0.05, 0.05, 0.06]), np.array([UPPER[0] - 0.05, UPPER[1] - 0.05, 0.3])
    while True:
        start, goal = draw.uniform(low, high, (2, 3))
        if np.linalg.norm(goal - start) >= LEAST_WAY:
            return start, goal


def _obstacle(draw: np.random.Generator, start: NDArray, goal: NDArray) -> tuple[int, NDArray, NDArray, float]:
    """One that the straight line meets, or nearly: kind, centre, half extents, yaw."""
    kind = int(draw.choice([SPHERE, COLUMN, BOX]))
    on_line = start + draw.uniform(0.1, 0.9) * (goal - start)
    angle, part = draw.uniform(0, 2 * np.pi), draw.uniform(0, 0.9)
    if kind == SPHERE:
        radius = draw.uniform(0.03, 0.08)
        aside = draw.standard_normal(3)
        return kind, on_line + part * radius * aside / np.linalg.norm(aside), np.full(3, radius), 0.0
    wide = draw.uniform(0.02, 0.06, 2) if kind == BOX else np.full(2, draw.uniform(0.02, 0.05))
    top = min(on_line[2] + draw.uniform(0.03, 0.25), UPPER[2])
    x, y = on_line[:2] + part * wide.min() * np.array([np.cos(angle), np.sin(angle)])
    yaw = draw.uniform(0, np.pi) if kind == BOX else 0.0
    return kind, np.array([x, y, top / 2]), np.array([*wide, top / 2]), yaw


def draw_scene(seed: int) -> PointScene | None:
    """The scene of a seed; None: an obstacle found no place on the line apart from start and goal."""
    draw = np.random.default_rng([seed, 2025])
    start, goal = _ends(draw)
    solids = []
    for _ in range(int(draw.integers(1, MOST + 1))):
        for _ in range(TRIES):
            one = _obstacle(draw, start, goal)
            line = start + np.linspace(0, 1, 201)[:, None] * (goal - start)
            ends = solid_distance(*one, np.stack([start, goal]))
            if ends.min() >= ENDS_APART and solid_distance(*one, line).min() < 0:
                solids.append(one)
                break
        else:
            return None
    kind, center, size, yaw = (np.array(x) for x in zip(*solids, strict=True))
    return PointScene(start, goal, kind, center, size, yaw, LOWER, UPPER)


def way_exists(scene: PointScene, clearance: float = CLEARANCE) -> bool:
    """Whether start and goal hang together in the cells of a grid whose neighbours' connecting lines keep the clearance.

    The distance changes by at most as much as the point moves: half a cell's edge on such a line.
    """
    count = np.floor((scene.upper - scene.lower) / CELL + 1e-9).astype(int) + 1
    axes = [low + CELL * np.arange(n) for low, n in zip(scene.lower, count, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    labelled: Any = label(scene.distances(grid).min(axis=0) >= clearance + CELL / 2)
    parts: NDArray = labelled[0]
    start, goal = (
        parts[tuple(np.clip(np.rint((x - scene.lower) / CELL).astype(int), 0, count - 1))]
        for x in (scene.start, scene.goal)
    )
    return bool(start == goal != 0)


def feasible_scenes(count: int, first: int = 0) -> tuple[dict[int, PointScene], Counter[str]]:
    """The first feasible scenes by seed, from a seed on, and how many seeds were rejected for which reason."""
    found: dict[int, PointScene] = {}
    rejected: Counter[str] = Counter()
    seed = first
    while len(found) < count:
        scene = draw_scene(seed)
        if scene is None:
            rejected["no place for an obstacle"] += 1
        elif not way_exists(scene):
            rejected["no way that keeps the clearance"] += 1
        else:
            found[seed] = scene
        seed += 1
    return found, rejected
