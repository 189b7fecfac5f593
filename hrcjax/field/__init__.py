"""Gaussian-process distance fields of point clouds: distance, gradient, Hessian, normals, and how far to trust them."""

from hrcjax.field.bias import convex_bias, lower_bound
from hrcjax.field.closed_form import distance_and_gradient, hessian
from hrcjax.field.gp import FAR, GPField, distance, fit, fit_exact, gradient, log_occupancy
from hrcjax.field.kernel import MATERN12, MATERN32, SQUARED_EXPONENTIAL, Kernel, rational_quadratic
from hrcjax.field.normal import SurfaceNormal, occupancy_hessian, surface_normal
from hrcjax.field.params import FieldParams
from hrcjax.field.union import union_distance, union_distance_and_gradient

__all__ = [
    "FAR", "MATERN12", "MATERN32", "SQUARED_EXPONENTIAL", "FieldParams", "GPField", "Kernel", "SurfaceNormal",
    "convex_bias", "distance", "distance_and_gradient", "fit", "fit_exact", "gradient", "hessian", "log_occupancy",
    "lower_bound", "occupancy_hessian", "rational_quadratic", "surface_normal", "union_distance",
    "union_distance_and_gradient",
]  # fmt: skip
