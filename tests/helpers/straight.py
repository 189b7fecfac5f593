"""The route along the straight line from start to goal."""

import jax.numpy as jnp

from hrcjax.sim import Cell, Params, World, path_through
from hrcjax.sim.episode import task_of
from hrcjax.sim.route import Route, make_route


def straight_route(cell: Cell, world: World, count: int = 24) -> Route:
    """Of so many waypoints."""
    scene, task = world.scene, task_of(Params(), cell, world)
    line = jnp.linspace(0, 1, count)[:, None].astype(scene.start.dtype) * (scene.goal - scene.start) + scene.start
    return make_route(cell.arm, world.q_start, path_through(task, line))
