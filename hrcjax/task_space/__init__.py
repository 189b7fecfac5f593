"""Task-space mapping: what stands on a table, from depth images, as named shapes and as a grid."""

from hrcjax.task_space.grid import ObstacleGrid, obstacle_grid
from hrcjax.task_space.mapping import Instance, TaskSpace, TaskSpaceParams, map_table
from hrcjax.task_space.segmenter import Detection, Segmenter, no_segmenter
from hrcjax.task_space.simulated import simulated_views
from hrcjax.task_space.solid_distance import POINTS, solid_distances
from hrcjax.task_space.solids import instances_scene
from hrcjax.task_space.table import Table, find_table
from hrcjax.task_space.view import View, view_of

__all__ = [
    "POINTS", "Detection", "Instance", "ObstacleGrid", "Segmenter", "Table", "TaskSpace", "TaskSpaceParams", "View",
    "find_table", "instances_scene", "map_table", "no_segmenter", "obstacle_grid", "simulated_views", "solid_distances", "view_of",
]  # fmt: skip
