"""The generated worlds: five families, each with some seeds, observed by cameras all around."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from hrcjax.geom.capsules import Capsules
from hrcjax.world import Scene, clutter, motion_named, person_at, robotica
from hrcjax.world.person import REGIONS
from hrcjax.world.scene import BOX, SPHERE
from hrcjax.world.scenes import CAPACITY, Obstacle, make_scene

from .solids import Tori, World

TORI = 2
"""Capacity for tori of every world, so that all share one compiled program."""
VIEWS = 24
"""Frames of one world."""


class Case(NamedTuple):
    """One world, its camera poses, and its query box."""

    world: World
    eyes: np.ndarray
    """Positions of the camera (view, 3) [m]."""
    targets: np.ndarray
    """Points that the camera looks at (view, 3) [m]."""
    lower: np.ndarray
    """Minimum corner of the query box (3,) [m]."""
    upper: np.ndarray
    """Maximum corner of the query box (3,) [m]."""


def _capsules(rows: Sequence[tuple[Sequence[float], Sequence[float], float]]) -> Capsules:
    rows = [*rows, *[((0.0,) * 3, (0.0,) * 3, -1.0)] * (len(REGIONS) - len(rows))]
    a, b, radius = (jnp.asarray(np.asarray([row[k] for row in rows], np.float32)) for k in range(3))
    return Capsules(a, b, radius)


def _tori(rows: Sequence[tuple[Sequence[float], Sequence[float], float, float]]) -> Tori:
    rows = [*rows, *[((0.0,) * 3, (0.0, 0.0, 1.0), 0.1, -1.0)] * (TORI - len(rows))]
    center, axis, ring, tube = (np.asarray([row[k] for row in rows], np.float32) for k in range(4))
    axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    return Tori(*(jnp.asarray(v) for v in (center, axis, ring, tube)))


def plain(scene: Scene) -> World:
    """A scene without capsules and tori."""
    return World(scene, _capsules([]), _tori([]))


def with_capsules(world: World, capsules: Capsules) -> World:
    """The world with its capsules replaced by as many others."""
    return World(world.scene, capsules, world.tori)


def _scene(solids: Sequence[Obstacle]) -> Scene:
    return make_scene(solids, (0.0,) * 3, (0.1,) * 3, (-1.0, -0.5, 0.0), (1.0, 0.8, 0.6))


def _ring(
    seed: int,
    middle: Sequence[float],
    distances: Sequence[float],
    heights: Sequence[float],
    angles: tuple[float, float] = (0.0, 2 * np.pi),
) -> tuple[np.ndarray, np.ndarray]:
    """Camera positions on one circle per height around a vertical axis, with random offsets, and the points they look at."""
    draw = np.random.default_rng(1000 + seed)
    each = VIEWS // len(heights)
    eyes, targets = [], []
    for distance, height in zip(distances, heights, strict=True):
        turn = np.linspace(*angles, each, endpoint=angles[1] - angles[0] < 6) + draw.uniform(-0.1, 0.1, each)
        far = distance + draw.uniform(-0.08, 0.08, each)
        up = height + draw.uniform(-0.05, 0.05, each)
        eyes.append(np.stack([middle[0] + far * np.cos(turn), middle[1] + far * np.sin(turn), up], axis=1))
        targets.append(np.asarray(middle) + draw.uniform(-0.05, 0.05, (each, 3)))
    return np.concatenate(eyes).astype(np.float32), np.concatenate(targets).astype(np.float32)


def _case(world: World, eyes: tuple[np.ndarray, np.ndarray], lower: Sequence[float], upper: Sequence[float]) -> Case:
    return Case(world, *eyes, np.asarray(lower, np.float32), np.asarray(upper, np.float32))


def clutter_case(seed: int) -> Case:
    """Boxes, columns and spheres on a table."""
    eyes = _ring(seed, (0.0, 0.4, 0.1), (1.15, 1.15), (0.9, 0.45))
    return _case(plain(clutter(seed)), eyes, (-0.8, 0.0, 0.0), (0.8, 0.75, 0.5))


def robotica_case(seed: int) -> Case:
    """The four obstacles of the Robotica paper: columns, spheres of 3 cm, spheres of 12 cm."""
    eyes = _ring(seed, (0.4, 0.38, 0.12), (1.0, 1.0), (0.9, 0.45))
    world = plain(robotica(("columns", "spheres", "clearance")[seed % 3]))
    return _case(world, eyes, (0.0, -0.05, 0.0), (0.85, 0.75, 0.5))


def smooth_case(seed: int) -> Case:
    """Spheres, capsules and tori of several radii over a table."""
    draw = np.random.default_rng(2000 + seed)
    places = np.array([(x, y) for x in (-0.45, 0.0, 0.45) for y in (0.1, 0.5)]) + draw.uniform(-0.04, 0.04, (6, 2))
    draw.shuffle(places)
    balls, capsules, tori = [], [], []
    for (x, y), radius in zip(places[:2], (draw.uniform(0.05, 0.08), draw.uniform(0.11, 0.15)), strict=True):
        spot = (float(x), float(y), float(radius + draw.uniform(0.02, 0.15)))
        size = (float(radius), float(radius), float(radius))
        balls.append(Obstacle(SPHERE, spot, size, 0.0, float(radius)))
    for (x, y), radius in zip(places[2:4], (draw.uniform(0.04, 0.06), draw.uniform(0.08, 0.1)), strict=True):
        way = draw.normal(size=3) * (1.0, 1.0, 0.6)
        half = 0.09 * way / np.linalg.norm(way)
        spot = np.array([x, y, radius + abs(half[2]) + draw.uniform(0.02, 0.1)])
        capsules.append(((spot - half).tolist(), (spot + half).tolist(), float(radius)))
    for (x, y), (ring, tube) in zip(places[4:], ((0.11, 0.04), (0.1, 0.055)), strict=True):
        axis = draw.normal(size=3) + np.array([0.0, 0.0, 1.5])
        tori.append(([float(x), float(y), float(draw.uniform(0.18, 0.25))], axis.tolist(), ring, tube))
    world = World(_scene(balls), _capsules(capsules), _tori(tori))
    eyes = _ring(seed, (0.0, 0.3, 0.15), (1.15, 1.15), (0.95, 0.3))
    return _case(world, eyes, (-0.75, -0.15, 0.0), (0.75, 0.75, 0.55))


def shelf_case(seed: int) -> Case:
    """A corner of two walls with shelves of 10 to 18 cm between boards, and two boxes with a gap of 6 to 9 cm."""
    draw = np.random.default_rng(3000 + seed)

    def box(lower: Sequence[float], upper: Sequence[float]) -> Obstacle:
        low, high = np.asarray(lower, float), np.asarray(upper, float)
        middle, half = (low + high) / 2, (high - low) / 2
        return Obstacle(BOX, tuple(middle.tolist()), tuple(half.tolist()), 0.0, 0.1)  # pyright: ignore[reportArgumentType]  # three numbers

    depth = 0.22
    solids = [box((-0.72, 0.6, 0.0), (0.72, 0.66, 0.7)), box((-0.72, 0.0, 0.0), (-0.66, 0.6, 0.7))]
    height = 0.0
    for _ in range(3):
        height += draw.uniform(0.1, 0.18)
        solids.append(box((-0.3, 0.6 - depth, height), (0.66, 0.6, height + 0.03)))
        height += 0.03
    for x in (-0.3, 0.2, 0.66):
        solids.append(box((x, 0.6 - depth, 0.0), (x + 0.03, 0.6, height)))
    gap = draw.uniform(0.06, 0.09)
    for x, high in ((-0.2, 0.12), (-0.06 + gap, 0.16)):
        solids.append(box((x, 0.02, 0.0), (x + 0.14, 0.16, high)))
    scene = _scene(solids)
    eyes = _ring(seed, (0.0, 0.4, 0.2), (1.0, 1.05, 0.9), (0.9, 0.5, 0.25), (-0.8 * np.pi, -0.1 * np.pi))
    assert len(solids) <= CAPACITY
    return _case(plain(scene), eyes, (-0.65, -0.1, 0.0), (0.7, 0.6, 0.65))


def person_case(seed: int) -> Case:
    """A person who reaches over the table with the Robotica paper's columns on it."""
    scene = robotica("columns")
    body = person_at(motion_named("reach_in" if seed % 2 == 0 else "stand_and_work", scene, seed), 4.0)
    world = World(scene, body, _tori([]))
    eyes = _ring(seed, (0.4, 0.65, 0.3), (1.4, 1.45), (1.2, 0.6))
    return _case(world, eyes, (-0.1, 0.0, 0.0), (1.1, 1.3, 1.0))


FAMILIES: dict[str, tuple[Callable[[int], Case], tuple[int, ...]]] = {
    "clutter": (clutter_case, (5, 6, 7)),
    "robotica": (robotica_case, (0, 1, 2)),
    "smooth": (smooth_case, (0, 1)),
    "shelf": (shelf_case, (0, 1)),
    "person": (person_case, (0, 1)),
}
"""Name -> function from a seed to a case, and the seeds."""
