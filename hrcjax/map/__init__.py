"""A map of surfaces as a distance field, built frame by frame from depth images."""

from hrcjax.map.batch import map_distances_and_gradients
from hrcjax.map.bound import distance_and_deviation, distance_bound
from hrcjax.map.cloud_view import FACES, cloud_camera, tiles_along, view_from_cloud
from hrcjax.map.fuse import fuse
from hrcjax.map.layout import MapLayout
from hrcjax.map.level import Level, local_field
from hrcjax.map.nearest import nearest_points
from hrcjax.map.params import MapParams
from hrcjax.map.query import map_distance, map_distance_and_gradient
from hrcjax.map.solve import exact_distance_and_gradient, exact_field
from hrcjax.map.state import DYNAMIC, LABELS, NEW, NONE, STATIC, FieldMap, FrameReport, empty_map
from hrcjax.map.stream import StreamParams, StreamState, admit, describe_frame, initial_stream
from hrcjax.map.surface import Surface, describe_surface, fit_surface, map_surface
from hrcjax.map.view import View, make_view

__all__ = [
    "DYNAMIC", "FACES", "LABELS", "NEW", "NONE", "STATIC", "FieldMap", "FrameReport", "Level", "MapLayout", "MapParams", "StreamParams", "StreamState", "View",
    "admit", "cloud_camera", "describe_frame", "distance_and_deviation", "distance_bound", "empty_map", "fuse", "initial_stream", "local_field", "make_view", "map_distance", "map_distance_and_gradient", "map_distances_and_gradients",
    "tiles_along", "view_from_cloud",
    "Surface", "describe_surface", "exact_distance_and_gradient", "exact_field", "fit_surface", "map_surface", "nearest_points",
]  # fmt: skip
