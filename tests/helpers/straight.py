"""The route along the straight line from start to goal, and a planner of it."""

from typing import Any

import jax.numpy as jnp

from hrcjax.plan import PathResult
from hrcjax.sim import Cell, Params, Task, World, path_through
from hrcjax.sim.episode import task_of
from hrcjax.sim.route import Route, make_route


def straight_route(cell: Cell, world: World, count: int = 24) -> Route:
    """Of so many waypoints."""
    return make_route(cell.arm, world.q_start, straight_plan(None, task_of(Params(), cell, world), count))


def straight_plan(_params: Any, task: Task, count: int = 24) -> PathResult:
    """In place of an optimiser, which takes seconds to compile."""
    start, goal = task.scene.start, task.scene.goal
    return path_through(task, jnp.linspace(0, 1, count)[:, None].astype(start.dtype) * (goal - start) + start)
