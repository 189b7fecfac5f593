"""Surface points with normals, in three ways: by the Hessian of the field, and as baselines by a plane through neighbours and by
the direction from the nearest point."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.field import GPField, SurfaceNormal, surface_normal
from hrcjax.geom.cloud import Cloud
from hrcjax.grasp.seen_points import SeenPoints
from hrcjax.numerics import safe_divide, unit
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3

NEIGHBOURS = 16
"""Points that a plane is laid through: about as many as the field's kernel weighs [1]."""
LINE = 1e-3
"""Middle over greatest variance below which points lie on a line, through which no plane is laid [1]."""
NormalFn = Callable[[Vector3, Vector3], SurfaceNormal]
"""Point on a surface [m], direction to where it was seen from [1] -> normal."""


class Contacts(eqx.Module):
    """Places on a surface where a pad could touch."""

    points: Float[Array, "point 3"]
    """Where [m]."""
    normals: Float[Array, "point 3"]
    """Unit normals, out of the object [1]."""
    planarity: Float[Array, "point"]
    """1 on a plane [1]."""
    mask: Bool[Array, "point"]
    """False: no point, or one whose normal may not be used."""


def contacts(seen: SeenPoints, normal: NormalFn) -> Contacts:
    """All points of a cloud with the normals of one way."""
    found = jax.vmap(normal)(seen.cloud.points, seen.toward)
    return Contacts(seen.cloud.points, found.normal, found.planarity, seen.cloud.mask & found.ok)


def by_hessian(field: GPField, least_planarity: Scalar) -> NormalFn:
    """Normals by the Hessian of a fitted field (HRI 2025)."""
    return lambda x, toward: surface_normal(field, x, x + toward, least_planarity)


def by_plane(cloud: Cloud, least_planarity: Scalar) -> NormalFn:
    """Normals of the planes through the nearest points: the least principal axis. Planarity is 1 - (least / middle variance)."""

    def normal(x: Vector3, toward: Vector3) -> SurfaceNormal:
        offset = cloud.points - x
        square = jnp.where(cloud.mask, jnp.sum(offset * offset, axis=1), jnp.inf)
        _, best = jax.lax.top_k(-square, min(NEIGHBOURS, square.shape[0]))
        some = cloud.mask[best]
        near = jnp.where(some[:, None], offset[best], 0)
        count = jnp.maximum(jnp.sum(some.astype(x.dtype)), 1)
        spread = near - jnp.where(some[:, None], jnp.sum(near, axis=0) / count, 0)
        values, vectors = jnp.linalg.eigh(spread.T @ spread / count)
        n = vectors[:, 0]
        planarity = 1 - safe_divide(values[0], values[1])
        line = values[1] <= LINE * values[2]
        ok = (count >= 4) & ~line & (planarity >= jnp.asarray(least_planarity, planarity.dtype))
        return SurfaceNormal(jnp.where(n @ toward < 0, -n, n), planarity, ok)

    return normal


def by_nearest(cloud: Cloud, lift: Scalar) -> NormalFn:
    """Normals as the gradient of the distance to the nearest point, read a little off the surface: at a point of the cloud it is 0 / 0.
    It knows no planarity: 1 everywhere.

    Args:
        lift: towards where the point was seen from; nearer than the spacing of the points these are told apart [m].
    """

    def normal(x: Vector3, toward: Vector3) -> SurfaceNormal:
        at = x + jnp.asarray(lift, x.dtype) * toward
        offset = at - cloud.points
        square = jnp.where(cloud.mask, jnp.sum(offset * offset, axis=1), jnp.inf)
        n = unit(offset[jnp.argmin(square)])
        return SurfaceNormal(n, jnp.ones_like(n[0]), jnp.any(n != 0) & jnp.all(jnp.isfinite(n)) & jnp.any(cloud.mask))

    return normal
