"""The scenes by name: the Robotica paper's in three readings, the HRI paper's waypoints, random clutter.

Made on the host with NumPy, once; `dtype` is that of all their numbers.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from hrcjax.world.scene import BOX, COLUMN, SPHERE, Scene

CAPACITY = 16
"""Obstacles that a scene has room for."""
ARM_ROOM = 0.18
"""Room that random obstacles leave on both sides of an arm that stands at start or goal: its links lie up to 11 cm beside that line, with
radii of 6 cm at most [m]."""
TABLE = ((-1.1, -0.5), (1.1, 0.78))
"""Least and greatest x and y of the table's top [m]."""


class Obstacle(NamedTuple):
    """One obstacle on the host; lengths in metres."""

    kind: int
    center: tuple[float, float, float]
    size: tuple[float, float, float]
    yaw: float
    radius: float


def make_scene(
    obstacles: Sequence[Obstacle],
    start: Sequence[float],
    goal: Sequence[float],
    lower: Sequence[float],
    upper: Sequence[float],
    dtype: Any = jnp.float32,
    capacity: int = CAPACITY,
) -> Scene:
    """A scene from a list of obstacles.

    Raises:
        ValueError: more obstacles than the capacity.
    """
    count = len(obstacles)
    if count > capacity:
        raise ValueError(f"{count} obstacles do not fit a scene of {capacity}: give a larger capacity")
    absent = Obstacle(SPHERE, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0)
    padded = [*obstacles, *[absent] * (capacity - count)]

    def numbers(values: Any) -> Any:
        return jnp.asarray(np.asarray(values, float), dtype)

    return Scene(
        kind=jnp.asarray(np.asarray([o.kind for o in padded]), jnp.int32),
        center=numbers([o.center for o in padded]),
        size=numbers([o.size for o in padded]),
        yaw=numbers([o.yaw for o in padded]),
        radius=numbers([o.radius for o in padded]),
        mask=jnp.asarray(np.arange(capacity) < count),
        table_lower=numbers(TABLE[0]),
        table_upper=numbers(TABLE[1]),
        start=numbers(start),
        goal=numbers(goal),
        lower=numbers(lower),
        upper=numbers(upper),
    )


def robotica(reading: str = "columns", dtype: Any = jnp.float32) -> Scene:
    """The scene of the Robotica paper (2025), section 3, whose obstacles can be read in three ways.

    columns: upright cylinders of radius 3 cm that stand on the table up to their z; the first blocks the straight line.
    spheres: balls of radius 3 cm about the printed points; the straight line is free.
    clearance: balls of 12 cm, the clearance of zeta = 4 times the radius taken as solid; the characteristic radius
    stays 3 cm.

    Raises:
        ValueError: another reading.
    """
    if reading not in ("columns", "spheres", "clearance"):
        raise ValueError(f"unknown reading {reading!r}: accepted are 'columns', 'spheres', 'clearance'")
    centimetre = 0.01
    printed = np.array([(30, 55, 20), (25, 30, 20), (52, 50, 20), (55, 20, 20)]) * centimetre  # O1 to O4
    start, goal, radius = np.array((10, 70, 15)) * centimetre, np.array((70, 30, 5)) * centimetre, 3 * centimetre
    obstacles = []
    for x, y, z in printed.tolist():
        if reading == "columns":
            obstacles.append(Obstacle(COLUMN, (x, y, z / 2), (radius, radius, z / 2), 0.0, radius))
        else:
            solid = radius if reading == "spheres" else 4 * radius
            obstacles.append(Obstacle(SPHERE, (x, y, z), (solid, solid, solid), 0.0, radius))
    return make_scene(obstacles, start.tolist(), goal.tolist(), (-0.05, 0.1, 0.02), (0.85, 0.85, 0.6), dtype)


def hri(dtype: Any = jnp.float32) -> Scene:
    """The two waypoints of the HRI paper's experiment, with no obstacle but the person."""
    return make_scene([], (0.0, 0.53, 0.25), (-0.53, 0.03, 0.25), (-0.85, -0.1, 0.05), (0.2, 0.85, 0.7), dtype)


def _hull_radius(o: Obstacle) -> float:
    """Radius of the upright cylinder about an obstacle [m]."""
    return float(np.hypot(o.size[0], o.size[1])) if o.kind == BOX else o.size[0]


def clutter(seed: int = 0, dtype: Any = jnp.float32) -> Scene:
    """Six to twelve boxes, columns and spheres between a random start and goal, the same for the same seed.

    Every obstacle keeps 12 cm in plan from its neighbours' hulls, 20 cm from the robot's base axis, and `ARM_ROOM` from the lines
    from there to start and goal, where the arm stands; all end below 40 cm: a way through or over always exists.
    """
    draw = np.random.default_rng(seed)

    def place(angle: float) -> np.ndarray:
        distance = draw.uniform(0.5, 0.7)
        return np.array([distance * np.cos(angle), distance * np.sin(angle), draw.uniform(0.1, 0.3)])

    turn = draw.uniform(0.9, 1.4) / 2  # half the angle that start and goal span at the base
    middle = draw.uniform(0.8, np.pi - 0.8)
    way = draw.choice([-1.0, 1.0])
    start, goal = place(middle - way * turn), place(middle + way * turn)
    wanted = int(draw.integers(6, 13))
    obstacles: list[Obstacle] = []
    for _ in range(2000):
        if len(obstacles) == wanted:
            break
        kind = int(draw.integers(3))
        u = draw.uniform(size=6)
        spot = np.array([-0.8 + 1.6 * u[0], 0.1 + 0.6 * u[1]])
        if kind == SPHERE:
            size = np.full(3, 0.03 + 0.04 * u[2])
            height = size[2] + (0.4 - 2 * size[2]) * u[3]  # balls may hang
        elif kind == COLUMN:
            size = np.array([0.02 + 0.03 * u[2], 0.02 + 0.03 * u[2], 0.05 + 0.13 * u[3]])
            height = size[2]
        else:
            size = np.array([0.03 + 0.04 * u[2], 0.03 + 0.04 * u[4], 0.04 + 0.1 * u[3]])
            height = size[2]
        yaw = float(np.pi * u[5]) if kind == BOX else 0.0
        x, y = spot.tolist()
        radius = float(np.mean(size[:2]))
        new = Obstacle(kind, (x, y, float(height)), tuple(size.tolist()), yaw, radius)  # pyright: ignore[reportArgumentType]  # three numbers
        hull = _hull_radius(new)
        ends_clear = min(_to_radius(spot, start), _to_radius(spot, goal)) > hull + ARM_ROOM
        apart = all(np.hypot(x - o.center[0], y - o.center[1]) > hull + _hull_radius(o) + 0.12 for o in obstacles)
        reachable = 0.2 + hull < np.hypot(x, y) < 0.85
        if ends_clear and apart and reachable:
            obstacles.append(new)
    return make_scene(obstacles, start.tolist(), goal.tolist(), (-0.85, 0.0, 0.02), (0.85, 0.8, 0.6), dtype)


def _to_radius(spot: np.ndarray, end: np.ndarray) -> float:
    """Distance in plan of a spot to the line from the base axis to an end [m]."""
    part = np.clip(spot @ end[:2] / (end[:2] @ end[:2]), 0.0, 1.0)
    return float(np.linalg.norm(spot - part * end[:2]))


class SceneEntry(NamedTuple):
    """A named scene."""

    make: Callable[[int], Scene]
    """The scene of a seed."""
    description: str
    """One line."""

    def __call__(self, seed: int = 0) -> Scene:
        return self.make(seed)


SCENES: dict[str, SceneEntry] = {
    "robotica": SceneEntry(lambda seed: robotica("columns"), "the Robotica paper's four obstacles as columns"),
    "robotica-spheres": SceneEntry(lambda seed: robotica("spheres"), "the same as balls of 3 cm: the line is free"),
    "robotica-clearance": SceneEntry(lambda seed: robotica("clearance"), "the same as balls of 12 cm, zeta x radius"),
    "hri": SceneEntry(lambda seed: hri(), "the HRI paper's two waypoints, no obstacle but the person"),
    "clutter": SceneEntry(lambda seed: clutter(seed), "seeded random boxes, columns and spheres"),
}


def scene_named(name: str, seed: int = 0) -> Scene:
    """The scene of a name; only "clutter" depends on the seed.

    Raises:
        ValueError: an unknown name.
    """
    if name not in SCENES:
        raise ValueError(f"unknown scene {name!r}: accepted are {', '.join(SCENES)}")
    return SCENES[name].make(seed)
