"""Exact weights of the points near a place, beside the lumped ones that the map keeps (`hrcjax.map.weigh`).

One Cholesky factor of some hundred points. The map's own length scale (0.7 spacings) has condition numbers near 10, so that
single precision is far from its limit of 1e8; where a longer length scale or coinciding points reach it, the status says
so and the weights are the lumped ones.
"""

import jax.numpy as jnp

from hrcjax.field import FieldParams, GPField, distance_and_gradient, fit_exact
from hrcjax.map.layout import MapLayout
from hrcjax.map.level import Level
from hrcjax.map.nearest import POINTS, nearest_points
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3


def exact_field(
    layout: MapLayout, levels: tuple[Level, ...], x: Vector3, ratio: Scalar, noise: Scalar = 0.01, count: int = POINTS
) -> tuple[GPField, Bool[Array, ""]]:
    """The Gaussian process of the points of level 0 nearest to x, with the weights of (K + s2 I) alpha = 1.

    Some weights are negative. Queries by `hrcjax.field` know that: where the signed sum has cancelled they take the sum of
    absolute terms, a smaller distance.

    Args:
        ratio: length scale over spacing [1].
        noise: standard deviation s of the noise of the occupancy, whose training target is 1 [1].
        count: points that are taken at most.

    Returns:
        field: of these points.
        ok: False: too badly conditioned for the precision; the weights are the lumped ones.
    """
    scale = jnp.asarray(layout.scale_of(ratio), x.dtype)
    return fit_exact(nearest_points(layout, levels, x, count), FieldParams(scale, noise))


def exact_distance_and_gradient(
    layout: MapLayout, levels: tuple[Level, ...], x: Vector3, ratio: Scalar, noise: Scalar = 0.01, count: int = POINTS
) -> tuple[Float[Array, ""], Vector3]:
    """Distance [m] and gradient [1] at x by exact weights, without coarse levels, not corrected for curvature; FAR and 0
    without points near x.

    As a function of x it leaps a little where the set of nearest points changes: it is what lumped weights are measured
    against, not what a policy reads. Its meaning ends where level 0 does (0.3 m at the default spacing).

    Args:
        ratio: length scale over spacing [1].
        noise: standard deviation of the noise of the occupancy [1].
        count: points that are taken at most.
    """
    return distance_and_gradient(exact_field(layout, levels, x, ratio, noise, count)[0], x)
