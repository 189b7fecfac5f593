"""Normal and principal curvatures of a mapped surface near a place.

The normal begins as the eigenvector of the most negative eigenvalue of the Hessian of the occupancy (`hrcjax.field.normal`),
with a length scale of its own, as noise needs more points than a distance does. The fit below turns it by its slope g, which
brings the error of the samples of the tests down by a tenth to a half.

That Hessian knows curvatures only as their squares (its tangential eigenvalues are -1/R^2 on a sphere), without sign and
drowned in noise. So they come from the heights s of the points below the tangent plane, fitted by least squares, weighed by
alpha_i k_i, with

    s(u) = c + g . u + u'Ku / (1 + sqrt(1 - u'K^2 u)),

u across the normal, K symmetric 2 x 2. For g = 0 this is the surface itself on spheres (K = I/R), cylinders and planes, so
that the kernel's width biases none of them. The usual paraboloid c + g . u + u'Ku/2 is its first term and reads too much:
under a Gaussian of the deviation l, r^4 has the part 8 l^2 r^2 in paraboloids, so that K comes out 1 + 2 (l/R)^2 times too
large on spheres and 1 + 1.5 (l/R)^2 on cylinders: 28 % and 21 % at R = 10 cm, l = 3.75 cm. The rest of the fraction
is taken off the heights with the K at hand, and fitted again, some times. The frame is first turned so that g = 0.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.bits import pack, words
from hrcjax.field import FieldParams, fit, surface_normal
from hrcjax.geom.cloud import Cloud
from hrcjax.map.layout import MapLayout
from hrcjax.map.level import Level
from hrcjax.map.nearest import POINTS, nearest_points
from hrcjax.numerics import safe_divide, safe_sqrt, solve_spd, unit
from hrcjax.typing import Array, Float, Int, Scalar, Vector3

FEW = 1
CURVED = 2
AMBIGUOUS = 4
ROUGH = 8
OFF = 16

REASONS = {
    FEW: "too few points",
    CURVED: "too curved for the length scale",
    AMBIGUOUS: "no direction stands out, or the viewpoint is edge-on",
    ROUGH: "points do not lie on one smooth surface",
    OFF: "the place is off the surface",
}
"""Why a surface may not be used: bit -> words."""

RATIO = 2.0
"""Default length scale over the spacing. With 2 mm of noise on points 25 mm apart normals are then off by 0.2 (plane) to 1.7
degrees (torus) in the median, curvatures of 1/(10 cm) to 1/(30 cm) by at most 7 % (95th percentile); at 1.5 by 13 %, but
R = 6.5 cm is resolved where 2 needs R = 8.7 cm [1]."""
LEAST_COUNT = 8.0
"""Points under the kernel, (sum w)^2 / sum w^2, under which a surface is not told from noise [1]."""
LEAST_GAP = 0.25
"""Least difference of the first two eigenvalues of the Hessian, over the larger one in size [1]."""
LEAST_FACING = 0.05
"""Least cosine between normal and viewing direction at which the side is sure [1]."""
MOST_ROUGH = 0.2
"""Root of the mean square of what the fit leaves, over the length scale; two sides of a thin board leave more [1]."""
MOST_OFF = 0.5
"""Distance of a place from the surface, over the length scale [1]."""
ROUNDS = 8
"""Fits of K."""
_RIDGE = 1e-4
_LEAST_ROOT = 0.1


class Surface(eqx.Module):
    """A mapped surface near a place."""

    normal: Vector3
    """Unit normal on the side of the viewpoint [1]."""
    curvatures: Float[Array, "2"]
    """Principal curvatures, the greater first; positive: convex seen from the viewpoint [1/m]."""
    planarity: Float[Array, ""]
    """|lambda_min| / sum |lambda| of the Hessian of the occupancy: 1 on a plane, 1 - 2 l^2/R^2 on a sphere; lower by some 0.1
    where the local points end within 3 length scales [1]."""
    height: Float[Array, ""]
    """Of the place over the surface, on the side of the viewpoint [m]."""
    reasons: Int[Array, ""]
    """Bits of why this result may not be used; 0: it may. See `describe_surface`."""


def describe_surface(reasons: int) -> str:
    """The bits of a refusal in words; "none" for 0."""
    return words(REASONS, reasons)


def _tangents(n: Vector3) -> tuple[Vector3, Vector3]:
    """Two directions across a unit vector."""
    away = jnp.where(jnp.abs(n[2]) < 0.7, jnp.asarray([0.0, 0.0, 1.0], n.dtype), jnp.asarray([1.0, 0.0, 0.0], n.dtype))
    first = unit(jnp.cross(away, n))
    return first, jnp.cross(n, first)


def _bend(K: Float[Array, "3"], u: Array, v: Array) -> tuple[Array, Array]:
    """u'Ku and u'K^2u of K = (uu, uv, vv)."""
    a, b = K[0] * u + K[1] * v, K[1] * u + K[2] * v
    return a * u + b * v, a * a + b * b


def fit_surface(cloud: Cloud, x: Vector3, viewpoint: Vector3, length_scale: Scalar) -> Surface:
    """Normal and curvatures of the surface that a cloud samples, near x.

    Derivatives are finite. The lumped weights are those of this length scale among the points of the cloud.

    Args:
        cloud: the points near x, at least to 2.5 length scales.
        x: on the surface, or within half a length scale of it [m].
        viewpoint: where the surface was seen from [m].
        length_scale: of the kernel [m].
    """
    dtype = x.dtype
    scale = jnp.asarray(length_scale, dtype)
    field = fit(cloud, FieldParams(scale))
    found = surface_normal(field, x, viewpoint, 0.0)
    p = (cloud.points - x) / scale  # all lengths in length scales from here on
    weight = jnp.where(cloud.mask, field.weights * jnp.exp(-0.5 * jnp.sum(p * p, axis=1)), 0.0)
    total = jnp.sum(weight)
    weight = safe_divide(weight, total)

    def least_squares(u: Array, v: Array) -> Array:
        """Takes heights to the c, g and K (uu, uv, vv) of their best c + g . u + u'Ku/2: (6, point)."""
        columns = jnp.stack([jnp.ones_like(u), u, v, 0.5 * u * u, u * v, 0.5 * v * v])
        inverse = jax.vmap(solve_spd, in_axes=(None, 0))(
            (weight * columns) @ columns.T + _RIDGE * jnp.eye(6, dtype=dtype), jnp.eye(6, dtype=dtype)
        )
        return inverse @ (weight * columns)

    def heights(n: Vector3) -> tuple[Array, Array, Array]:
        first, second = _tangents(n)
        return p @ first, p @ second, -(p @ n)

    first, second = _tangents(found.normal)
    u, v, s = heights(found.normal)
    slope = least_squares(u, v) @ s
    n = unit(found.normal + slope[1] * first + slope[2] * second)
    u, v, s = heights(n)
    best = least_squares(u, v)

    def sag(K: Array) -> Array:
        bend, square = _bend(K, u, v)
        return bend / (1.0 + safe_sqrt(jnp.maximum(1.0 - square, _LEAST_ROOT)))

    def again(K: Array, _: None) -> tuple[Array, None]:
        fitted = best[3:] @ (s - (sag(K) - 0.5 * _bend(K, u, v)[0]))
        size = K[0] ** 2 + 2 * K[1] ** 2 + K[2] ** 2
        return K + (fitted - K) / (1.0 + 3.0 * jnp.minimum(size, 1.0)), None  # the slope of fitted - K, on a sphere

    K, _ = jax.lax.scan(again, best[3:] @ s, length=ROUNDS)
    level = best[:3] @ (s - (sag(K) - 0.5 * _bend(K, u, v)[0]))
    left = s - level[0] - level[1] * u - level[2] * v - sag(K)
    mean, half = (K[0] + K[2]) / 2, safe_sqrt(((K[0] - K[2]) / 2) ** 2 + K[1] ** 2)
    curvatures = jnp.stack([mean + half, mean - half]) / scale

    second_moment = (weight[:, None] * p).T @ p  # the Hessian is this less 1, over l^2
    values = jnp.linalg.eigvalsh(jax.lax.stop_gradient(second_moment)) - 1.0
    gap = safe_divide(values[1] - values[0], jnp.maximum(jnp.abs(values[0]), jnp.abs(values[2])))
    count = safe_divide(jnp.ones((), dtype), jnp.sum(weight * weight))
    way = unit(viewpoint - x)

    sure = (gap >= LEAST_GAP) & (values[0] < 0) & (jnp.abs(jnp.sum(way * n)) >= LEAST_FACING)
    reasons = pack(
        {
            FEW: ~(count >= LEAST_COUNT),
            CURVED: ~(jnp.max(jnp.abs(curvatures)) * scale < 3**-0.5),
            AMBIGUOUS: ~sure,
            ROUGH: ~(jnp.sum(weight * left * left) <= MOST_ROUGH**2),
            OFF: ~(jnp.abs(level[0]) <= MOST_OFF),
        }
    )
    return Surface(n, curvatures, found.planarity, level[0] * scale, reasons)


def map_surface(
    layout: MapLayout,
    levels: tuple[Level, ...],
    x: Vector3,
    viewpoint: Vector3,
    ratio: Scalar = RATIO,
    count: int = POINTS,
) -> Surface:
    """Normal and curvatures of the mapped surface near x.

    Args:
        x: on the surface, or near it [m].
        viewpoint: where the surface was seen from: the normal points there [m].
        ratio: length scale over spacing [1].
        count: points that are taken at most; 128 suffice up to a ratio of 2.5.
    """
    return fit_surface(nearest_points(layout, levels, x, count), x, viewpoint, layout.scale_of(ratio))
