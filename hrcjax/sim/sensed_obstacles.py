"""What stands in the cell as the planner may be told it: shapes from images of the set-up, in place of exact obstacles."""

import jax
import numpy as np

from hrcjax.robot import arm_capsules
from hrcjax.sense import Camera, NoiseParams
from hrcjax.sim.cell import Cell
from hrcjax.sim.prepare import posture_at
from hrcjax.sim.scan import scan_postures
from hrcjax.task_space import TaskSpace, TaskSpaceParams, map_table, simulated_views
from hrcjax.typing import PRNGKeyArray
from hrcjax.world import Scene

UP = np.array([0.0, 0.0, 1.0])
"""Upwards in the cell."""


def sense_obstacles(
    cell: Cell,
    scene: Scene,
    cameras: Camera,
    key: PRNGKeyArray,
    noise: NoiseParams | None = None,
    params: TaskSpaceParams | None = None,
) -> TaskSpace:
    """The task-space map of the empty cell: stationary cameras look at it while the arm moves through its scan, one image a
    posture; pixels that the arm covers, as its own posture says, don't count.

    Args:
        scene: what stands there; enters only by the images, and by the task where the scan goes.
        cameras: stationary ones, stacked; at full resolution, as a thing of 3 cm is two pixels of a thinned image.
        key: random key of the noise.

    Raises:
        ValueError: the start is out of the arm's reach, or no table is in view.
    """
    postures = scan_postures(cell.arm, scene, posture_at(cell, scene.start))
    arm = jax.vmap(lambda q: arm_capsules(cell.arm, q))(postures)
    return map_table(simulated_views(cameras, scene, key, noise=noise, arm=arm), UP, params)
