"""Figures: arrays in, Figure and Axes out. Nothing here reads files or touches global state."""

from hrcjax.viz.heatmap import GridAxis, curve, heat_maps, sample_map
from hrcjax.viz.pareto import pareto_figure, pareto_mask
from hrcjax.viz.path_view import Obstacles, PathLine, PersonPoses, path_views, plan_view, view_3d
from hrcjax.viz.zones_view import zones_view

__all__ = [
    "GridAxis", "Obstacles", "PathLine", "PersonPoses", "curve", "heat_maps", "pareto_figure", "pareto_mask",
    "path_views", "plan_view", "sample_map", "view_3d", "zones_view",
]  # fmt: skip
