"""Figures: arrays in, Figure and Axes out. Functions here read no files and do not change global state."""

from hrcjax.viz.field_slice import FieldSlice, field_slices
from hrcjax.viz.heatmap import GridAxis, curve, heat_maps, sample_map
from hrcjax.viz.knobs_view import KnobRow, knobs_view
from hrcjax.viz.labelled_cloud import POINT_COLOURS, cloud_views
from hrcjax.viz.pareto import pareto_figure, pareto_mask
from hrcjax.viz.path_view import Obstacles, PathLine, PersonPoses, path_views, plan_view, view_3d
from hrcjax.viz.sensitivity_view import range_table, sensitivity_bars
from hrcjax.viz.setting_view import setting_view
from hrcjax.viz.zones_view import zones_view

__all__ = [
    "POINT_COLOURS", "FieldSlice", "GridAxis", "KnobRow", "Obstacles", "PathLine", "PersonPoses", "cloud_views", "curve",
    "field_slices", "heat_maps", "knobs_view", "pareto_figure", "pareto_mask", "path_views", "plan_view", "range_table",
    "sample_map", "sensitivity_bars", "setting_view", "view_3d", "zones_view",
]  # fmt: skip
