"""Where people stand: at the table's +y edge, facing the robot, beside the middle of its path."""

import jax.numpy as jnp

from hrcjax.typing import Array, Float
from hrcjax.world.scene import Scene

EDGE_GAP = 0.24
"""Hip's middle to the table's edge [m]: the trunk's radius and two centimetres."""


def path_middle(scene: Scene) -> Float[Array, "3"]:
    """Half way between start and goal [m]."""
    return (scene.start + scene.goal) / 2


def standing_place(scene: Scene, aside: float = 0.0, back: float = 0.0) -> Float[Array, "2"]:
    """Where the hip of a person at the table is, seen from above [m].

    Args:
        scene: the cell.
        aside: along the edge, away from the path's start and past its goal [m].
        back: away from the table [m].
    """
    away = jnp.where(scene.goal[0] >= scene.start[0], 1.0, -1.0).astype(scene.start.dtype)
    x = jnp.clip(path_middle(scene)[0] + aside * away, scene.table_lower[0], scene.table_upper[0])
    return jnp.stack([x, scene.table_upper[1] + (EDGE_GAP + back)])
