"""The mapped things as solids: their distances, and the scene that a planner takes."""

from collections.abc import Sequence

import numpy as np

from hrcjax.task_space.mapping import Instance
from hrcjax.task_space.solid_distance import POINTS
from hrcjax.task_space.table import Table
from hrcjax.world.scene import BOX, Scene
from hrcjax.world.scenes import Obstacle, make_scene

LEAST = 1e-3
"""Half extents are at least this [m]."""


def obstacle_of(one: Instance, table: Table | None = None) -> Obstacle:
    """An instance as an obstacle of a scene, upright in the frame of the table, or of the world if the table is given.

    A table that is not level to a degree tilts nothing in the world: things stay upright about their true centre.
    """
    center = one.center if table is None else table.rotation.T @ (one.center - table.shift)
    size = np.maximum(one.size, LEAST)
    kind = BOX if one.kind == POINTS else one.kind
    radius = float(size[0] if kind != BOX else np.mean(size[:2]))
    x, y, z = (float(v) for v in center)
    return Obstacle(kind, (x, y, z), (float(size[0]), float(size[1]), float(size[2])), one.yaw, radius)


def instances_scene(
    found: Sequence[Instance], like: Scene, table: Table | None = None, capacity: int | None = None
) -> Scene:
    """A scene whose obstacles are the things found, with the task, table and workspace of another one.

    Args:
        like: start, goal, bounds and table; its obstacles are not read.
        table: given if the scene is in the world's frame, not in the table's.
        capacity: obstacles that it has room for; None: as `like`, or more where there are more things.

    Raises:
        ValueError: more things than the capacity.
    """
    room = max(like.mask.shape[0], len(found)) if capacity is None else capacity
    ends = [np.asarray(v, float).tolist() for v in (like.start, like.goal, like.lower, like.upper)]
    made = make_scene([obstacle_of(one, table) for one in found], *ends, dtype=like.center.dtype, capacity=room)
    bounds = {"table_lower": like.table_lower, "table_upper": like.table_upper}
    return Scene(**{**vars(made), **bounds})
