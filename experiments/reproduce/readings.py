"""The scene of a table row in each reading of the obstacles."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp

from hrcjax.world.scene import COLUMN, SPHERE, Scene
from hrcjax.world.scenes import Obstacle, make_scene

from .printed import GOAL, OBSTACLES, START, TimeRow

LOWER, UPPER = (-0.05, 0.1, 0.02), (0.85, 0.85, 0.6)
"""Box that paths keep to, as in the scene `robotica` [m]."""
EXPLAINED = {
    "spheres": "balls of the printed radius about the printed points; the straight line is free",
    "columns": "upright cylinders of that radius from the table up to the printed z; O1 blocks the straight line",
    "clearance": "balls of zeta times the radius, 12 cm by default; O1 blocks the straight line",
}


def row_scene(reading: str, row: TimeRow) -> Scene:
    """The obstacles of a row as solids, with start and goal, in double precision [m].

    Raises:
        ValueError: another reading.
    """
    if reading not in EXPLAINED:
        raise ValueError(f"unknown reading {reading!r}: accepted are {', '.join(EXPLAINED)}")
    obstacles = []
    for (x, y), r, z in list(zip(OBSTACLES, row.radius, row.height, strict=True))[: row.present]:
        x, y, r, z = (value / 100 for value in (x, y, r, z))
        if reading == "columns":
            obstacles.append(Obstacle(COLUMN, (x, y, z / 2), (r, r, z / 2), 0.0, r))
        else:
            solid = r if reading == "spheres" else row.zeta * r
            obstacles.append(Obstacle(SPHERE, (x, y, z), (solid, solid, solid), 0.0, r))
    start, goal = ([value / 100 for value in spot] for spot in (START, GOAL))
    with jax.enable_x64(True):
        return make_scene(obstacles, start, goal, LOWER, UPPER, jnp.float64, capacity=len(OBSTACLES))


def stacked(scenes: Sequence[Scene]) -> Scene:
    """Scenes along a leading axis, for vmap."""
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *scenes)
