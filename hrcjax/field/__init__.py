"""Distance fields: Gaussian processes of point clouds, their derivatives and how far to trust them; splines on a grid."""

from hrcjax.field.bias import convex_bias, lower_bound
from hrcjax.field.closed_form import distance_and_gradient, hessian
from hrcjax.field.gp import FAR, GPField, distance, fit, fit_exact, gradient, log_occupancy
from hrcjax.field.grid import GridField, GridLayout, fit_grid, grid_distance, grid_distance_and_gradient, grid_nodes
from hrcjax.field.kernel import MATERN12, MATERN32, SQUARED_EXPONENTIAL, Kernel, rational_quadratic
from hrcjax.field.normal import (
    SurfaceNormal,
    distance_occupancy_hessian,
    hessian_normal,
    occupancy_hessian,
    surface_normal,
)
from hrcjax.field.params import FieldParams
from hrcjax.field.union import union_distance, union_distance_and_gradient

__all__ = [
    "FAR", "MATERN12", "MATERN32", "SQUARED_EXPONENTIAL", "FieldParams", "GPField", "GridField", "GridLayout", "Kernel",
    "SurfaceNormal", "convex_bias", "distance", "distance_and_gradient", "distance_occupancy_hessian", "fit", "fit_exact", "fit_grid", "gradient", "grid_distance",
    "grid_distance_and_gradient", "grid_nodes", "hessian", "hessian_normal", "log_occupancy",
    "lower_bound", "occupancy_hessian", "rational_quadratic", "surface_normal", "union_distance",
    "union_distance_and_gradient",
]  # fmt: skip
