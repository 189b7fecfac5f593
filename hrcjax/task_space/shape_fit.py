"""Fit of a sphere, an upright column and an upright box to what cameras saw of one thing, by damped least squares.

Residuals, each over its standard deviation: the signed distance of every measured point; how deep every ray along which free
space was seen would pass through the shape; for a thing seen down to the table, the height of its lower end; and weakly its
ends along every axis against those of the points, as a side that nobody saw is bounded by nothing else.
"""

from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.shape import box_distance, column_distance, segment_convex_distance, sphere_distance
from hrcjax.typing import Array, Bool, Float, Int, Scalar, Vector3
from hrcjax.world.scene import BOX, COLUMN, SPHERE

KINDS = (SPHERE, COLUMN, BOX)
UNKNOWNS = {SPHERE: 4, COLUMN: 5, BOX: 7}
"""Free numbers of each kind."""
YAWS = 6
"""Turns of a box from which the fit begins, over a quarter of a turn."""
OFF = 5.0
"""A point farther from a surface than this many standard deviations is not of it [1]."""
STEPS = 30
"""Damped Gauss-Newton steps."""


class FitParams(eqx.Module):
    """Numbers of the fit. All are our choice."""

    model: float = 0.0015
    """What a real surface differs from the shape's, added to the noise of a point [m]."""
    ray: float = 0.003
    """Standard deviation of how far beside a ray an edge may be: about half of a pixel's width at 2 m [m]."""
    stand: float = 0.002
    """Standard deviation of the lower end of a thing that stands on the table [m]."""
    size: float = 0.05
    """Standard deviation of half extents and middles about those of the points; of both ends the same times the root of 2 [m]."""
    robust: float = 3.0
    """Residuals over this count less, by Cauchy's law [1]."""


class Evidence(NamedTuple):
    """What was seen of one thing, in the table's frame; of fixed capacities."""

    points: Float[Array, "point 3"]
    """[m]"""
    deviation: Float[Array, "point"]
    """Of each along its ray [m]."""
    mask: Bool[Array, "point"]
    """True where there is a point."""
    begin: Float[Array, "ray 3"]
    """Of stretches of free space [m]."""
    end: Float[Array, "ray 3"]
    """[m]"""
    free: Bool[Array, "ray"]
    """True where there is a stretch."""
    lower: Float[Array, "3"]
    """Least coordinates of the points, without the outermost per cent [m]."""
    upper: Float[Array, "3"]
    """Greatest [m]."""
    stands: Bool[Array, ""]
    """Whether it is seen down to the table, or was hidden there."""


class Fitted(NamedTuple):
    """One kind of shape, fitted."""

    center: Float[Array, "3"]
    """[m]"""
    size: Float[Array, "3"]
    """Half extents, as in a `Scene` [m]."""
    yaw: Float[Array, ""]
    """Turn about the vertical [rad]."""
    cost: Float[Array, ""]
    """Sum of the squares of all residuals, large ones by Cauchy's law [1]."""
    residual: Float[Array, ""]
    """Root mean square of the points' distances from the surface [m]."""
    claimed: Float[Array, ""]
    """Share of the rays of free space that pass through the shape, deeper than two of their deviations [1]."""
    center_deviation: Float[Array, "3"]
    """Standard deviations of the centre; up to `FitParams.size` where a side is bounded by rays alone that do not press [m]."""
    size_deviation: Float[Array, "3"]
    """And of the half extents [m]."""


def solid_of(kind: int, u: Float[Array, "unknown"]) -> tuple[Vector3, Vector3, Scalar]:
    """Centre, half extents and yaw from the free numbers: x, y, then z and log radius of a sphere; log radius, lower and upper
    end of a column; log half extents, lower and upper end, and yaw of a box."""
    if kind == SPHERE:
        r = jnp.exp(u[3])
        return u[:3], jnp.stack([r, r, r]), jnp.zeros_like(r)
    bottom, top = (u[3], u[4]) if kind == COLUMN else (u[4], u[5])
    half = jnp.maximum((top - bottom) / 2, 1e-3)
    center = jnp.stack([u[0], u[1], (top + bottom) / 2])
    if kind == COLUMN:
        r = jnp.exp(u[2])
        return center, jnp.stack([r, r, half]), jnp.zeros_like(r)
    return center, jnp.stack([jnp.exp(u[2]), jnp.exp(u[3]), half]), u[6]


def signed_distance(kind: int, center: Vector3, size: Vector3, yaw: Scalar, x: Vector3) -> Float[Array, ""]:
    """Signed distance of a point to a solid of a kind that is known when traced [m]."""
    if kind == SPHERE:
        return sphere_distance(x, center, size[0])
    return column_distance(x, center, size[0], size[2]) if kind == COLUMN else box_distance(x, center, size, yaw)


def _robust(r: Array, c: Scalar) -> Array:
    """A residual whose square is Cauchy's loss, with the same sign."""
    return jnp.asarray(c, r.dtype) * jnp.sign(r) * jnp.sqrt(jnp.log1p((r / c) ** 2) + 1e-12)


def _start(kind: int, seen: Evidence, yaw: Array) -> Float[Array, "unknown"]:
    """First guess from the extent of the points, in axes turned by yaw."""
    weight = seen.mask.astype(seen.points.dtype)
    middle = (seen.lower + seen.upper) / 2
    bottom, top = jnp.where(seen.stands, 0.0, seen.lower[2]), seen.upper[2]
    half = jnp.maximum((seen.upper - seen.lower) / 2, 5e-3)
    wide = jnp.sqrt(half[0] * half[1])
    if kind == SPHERE:
        r = jnp.maximum((wide * 2 + (top - bottom) / 2) / 3, 5e-3)
        return jnp.stack([middle[0], middle[1], top - r, jnp.log(r)])
    if kind == COLUMN:
        return jnp.stack([middle[0], middle[1], jnp.log(wide), bottom, top])
    c, s = jnp.cos(yaw), jnp.sin(yaw)
    dx, dy = seen.points[:, 0] - middle[0], seen.points[:, 1] - middle[1]
    far = 1e3 * (1 - weight)
    lx, ly = c * dx + s * dy, c * dy - s * dx
    low = jnp.stack([jnp.min(lx + far), jnp.min(ly + far)])
    high = jnp.stack([jnp.max(lx - far), jnp.max(ly - far)])
    at, extent = (low + high) / 2, jnp.maximum((high - low) / 2, 5e-3)
    x, y = middle[0] + c * at[0] - s * at[1], middle[1] + s * at[0] + c * at[1]
    return jnp.stack([x, y, jnp.log(extent[0]), jnp.log(extent[1]), bottom, top, yaw])


def _parts(kind: int, params: FitParams, seen: Evidence, u: Array, start: Array) -> tuple[Array, Array, Array]:
    """Residuals of points, of rays, and of the rest [1]."""
    center, size, yaw = solid_of(kind, u)

    def distance(x: Vector3) -> Array:
        return signed_distance(kind, center, size, yaw, x)

    sigma = jnp.sqrt(seen.deviation**2 + params.model**2)
    on = jnp.where(seen.mask, jax.vmap(distance)(seen.points) / sigma, 0)
    deepest = jax.vmap(lambda a, b: segment_convex_distance(a, b, distance, steps=14))(seen.begin, seen.end)
    through = jnp.where(seen.free, jnp.maximum(-deepest, 0) / params.ray, 0)
    place, first, _ = solid_of(kind, start)
    lower = center[2] - size[2]
    # all ends about those of the points, but for the lower one of what stands, which the table bounds
    end = jnp.sqrt(jnp.asarray(2.0, size.dtype)) * params.size
    upper, under = (center + size - place - first) / end, (center - size - place + first) / end
    # a sphere rests on the table or is above it
    standing = jnp.where(seen.stands, lower / params.stand, jnp.minimum(lower, 0) / params.size)
    rest = jnp.concatenate([upper, under[:2], jnp.stack([jnp.where(seen.stands, 0, under[2]), standing])])
    return on, through, rest


def _residuals(kind: int, params: FitParams, seen: Evidence, u: Array, start: Array) -> Array:
    on, through, rest = _parts(kind, params, seen, u, start)
    return jnp.concatenate([_robust(on, params.robust), _robust(through, params.robust), rest])


def _solve(kind: int, params: FitParams, seen: Evidence, start: Array) -> tuple[Array, Array, Array]:
    """The free numbers at the least cost, the cost, and J^T J there."""

    def f(u: Array) -> Array:
        return _residuals(kind, params, seen, u, start)

    def both(u: Array) -> tuple[Array, Array, Array]:
        r, J = f(u), jax.jacfwd(f)(u)
        return jnp.sum(r * r), J.T @ J, J.T @ r

    def step(_: Int[Array, ""], state: tuple) -> tuple:
        u, cost, A, g, damping = state
        scale = jnp.diag(jnp.diag(A) + 1e-6)
        new = u - jnp.linalg.solve(A + damping * scale, g)
        new_cost, new_A, new_g = both(new)
        better = new_cost < cost  # False too where it is not a number

        def keep(a: Array, b: Array) -> Array:
            return jnp.where(better, a, b)

        damping = jnp.clip(jnp.where(better, damping / 4, damping * 5), 1e-6, 1e6)
        return keep(new, u), keep(new_cost, cost), keep(new_A, A), keep(new_g, g), damping

    state = (start, *both(start), jnp.asarray(1e-2, start.dtype))
    u, cost, A, _, _ = jax.lax.fori_loop(0, STEPS, step, state)
    return u, cost, A


@partial(jax.jit, static_argnums=0)
def fit_shape(kind: int, params: FitParams, seen: Evidence) -> Fitted:
    """The shape of one kind that explains best what was seen; a box from several turns.

    Args:
        kind: SPHERE, COLUMN or BOX.
    """
    count = YAWS if kind == BOX else 1
    yaws = jnp.arange(count).astype(seen.points.dtype) * (jnp.pi / 2 / count)
    starts = jax.vmap(lambda yaw: _start(kind, seen, yaw))(yaws)
    us, costs, As = jax.vmap(lambda s: _solve(kind, params, seen, s))(starts)
    best = jnp.argmin(jnp.where(jnp.isfinite(costs), costs, jnp.inf))
    u, cost, A = us[best], costs[best], As[best]
    center, size, turn = solid_of(kind, u)
    yaw = jnp.asarray(turn)
    on, through, _ = _parts(kind, params, seen, u, starts[best])
    count_points = jnp.maximum(jnp.sum(seen.mask, dtype=on.dtype), 1)
    sigma = jnp.sqrt(seen.deviation**2 + params.model**2)
    mild = jnp.sum(_robust(on, params.robust) ** 2) / count_points
    covariance = jnp.linalg.inv(A + 1e-6 * jnp.eye(len(u), dtype=A.dtype)) * jnp.maximum(mild, 1)
    to_center, to_size = jax.jacfwd(lambda v: solid_of(kind, v)[0])(u), jax.jacfwd(lambda v: solid_of(kind, v)[1])(u)

    def deviations(J: Array) -> Array:
        return jnp.sqrt(jnp.maximum(jnp.sum((J @ covariance) * J, axis=1), 0))

    return Fitted(
        center=center, size=size, yaw=yaw, cost=cost,
        residual=jnp.sqrt(jnp.sum((on * sigma) ** 2) / count_points),
        claimed=jnp.sum(through > 2, dtype=on.dtype) / jnp.maximum(jnp.sum(seen.free, dtype=on.dtype), 1),
        center_deviation=deviations(to_center), size_deviation=deviations(to_size),
    )  # fmt: skip
