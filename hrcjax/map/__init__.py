"""A map of surfaces as a distance field, built frame by frame from depth images."""

from hrcjax.map.as_function import distance_function
from hrcjax.map.batch import map_distances_and_gradients
from hrcjax.map.bound import distance_and_deviation, distance_bound
from hrcjax.map.cloud_view import FACES, cloud_camera, tiles_along, view_from_cloud
from hrcjax.map.fuse import fuse
from hrcjax.map.host import labelled_points
from hrcjax.map.layout import MapLayout
from hrcjax.map.level import Level
from hrcjax.map.nearest import nearest_points
from hrcjax.map.params import MapParams
from hrcjax.map.query import map_distance, map_distance_and_gradient
from hrcjax.map.sampled import sample_map
from hrcjax.map.search import local_field
from hrcjax.map.settle import settle
from hrcjax.map.solve import exact_distance_and_gradient, exact_field
from hrcjax.map.state import DYNAMIC, LABELS, NEW, NONE, STATIC, FieldMap, FrameReport, empty_map
from hrcjax.map.stream import StreamParams, StreamState, admit, describe_frame, initial_stream
from hrcjax.map.surface import Surface, describe_surface, fit_surface, map_surface
from hrcjax.map.take import FrameParams, MapPoints, admitted_view, map_points, surface_view, take_frame
from hrcjax.map.take_cloud import admit_cloud, take_cloud
from hrcjax.map.view import View, make_view

__all__ = [
    "DYNAMIC", "FACES", "LABELS", "NEW", "NONE", "STATIC", "FieldMap", "FrameParams", "FrameReport", "Level",
    "MapLayout", "MapParams", "MapPoints", "StreamParams", "StreamState", "Surface", "View", "admit", "admit_cloud",
    "admitted_view", "cloud_camera",
    "describe_frame", "describe_surface", "distance_and_deviation", "distance_bound", "distance_function", "empty_map",
    "exact_distance_and_gradient", "exact_field", "fit_surface", "fuse", "initial_stream", "labelled_points", "local_field", "make_view",
    "map_distance", "map_distance_and_gradient", "map_distances_and_gradients", "map_points", "map_surface",
    "nearest_points", "sample_map", "settle", "surface_view", "take_cloud", "take_frame", "tiles_along", "view_from_cloud",
]  # fmt: skip
