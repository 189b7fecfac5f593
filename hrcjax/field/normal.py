"""Surface normals from the Hessian of the occupancy, which knows them where the gradient of the distance is 0 / 0.

On a sphere of radius R, at the surface, the eigenvalues of the Hessian of o (over o) are -1/l^2 + 2/R^2 along the
normal and -1/R^2 across: planarity 1 - 2 l^2 / R^2. From l = R / sqrt(3) on the normal is not the most negative one.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.field.closed_form import part
from hrcjax.field.gp import GPField, log_occupancy
from hrcjax.field.kernel import SQUARED_EXPONENTIAL
from hrcjax.numerics import safe_divide
from hrcjax.typing import Array, Bool, DistanceFn, Float, Matrix3, Scalar, Vector3


class SurfaceNormal(eqx.Module):
    """The normal of a sampled surface near a point."""

    normal: Vector3
    """Unit normal, on the side of the viewpoint [1]."""
    planarity: Float[Array, ""]
    """|lambda_min| / sum |lambda|: 1 on a plane [1]."""
    ok: Bool[Array, ""]
    """False: the surface is too curved for the length scale, or there is none; do not use the normal."""


def occupancy_hessian(field: GPField, x: Vector3) -> Matrix3:
    """Hessian of the occupancy over the occupancy [1/m^2]: it has the eigenvectors of Hess o and does not underflow."""

    def slope(at: Vector3) -> Vector3:
        if field.kernel is SQUARED_EXPONENTIAL:
            return -part(field, at).offset / field.length_scale**2
        return jax.grad(log_occupancy, argnums=1)(field, at)

    g = slope(x)
    return jax.jacfwd(slope)(x) + g[:, None] * g[None, :]


def distance_occupancy_hessian(distance: DistanceFn, x: Vector3, length_scale: Scalar) -> Matrix3:
    """The same for any field of distance, taken for the reading of an occupancy exp(-d^2 / 2 l^2) [1/m^2].

    Not finite if: the second derivative of the distance is not, as that of |s| or of a bare root at the surface.

    Args:
        length_scale: of the occupancy; it cancels in the normal, and decides what counts as curved [m].
    """

    def log_o(at: Vector3) -> Float[Array, ""]:
        return -0.5 * (distance(at) / length_scale) ** 2

    g = jax.grad(log_o)(x)
    return jax.hessian(log_o)(x) + g[:, None] * g[None, :]


def surface_normal(field: GPField, x: Vector3, viewpoint: Vector3, least_planarity: Scalar = 0.9) -> SurfaceNormal:
    """Normal at a point on the surface, or within about a third of a length scale of it; see `hessian_normal`."""
    return hessian_normal(occupancy_hessian(field, x), viewpoint - x, least_planarity)


def hessian_normal(H: Matrix3, toward: Vector3, least_planarity: Scalar = 0.9) -> SurfaceNormal:
    """Normal from the Hessian of an occupancy over the occupancy [1/m^2].

    Derivatives are those of perturbation theory about the eigenvectors, finite where eigenvalues coincide (the
    tangential ones do on a plane).

    Args:
        toward: from the surface to where it was seen from; the normal points to its side [m].
        least_planarity: below this `ok` is False; 0.9 is R >= 4.5 l on a sphere [1].
    """
    values, vectors = jnp.linalg.eigh(jax.lax.stop_gradient(H))  # ascending
    first = vectors[:, 0]
    change = H @ first  # along the other eigenvectors: 0 in value, not in derivative
    normal = first
    for j in (1, 2):
        other = vectors[:, j]
        normal = normal + other * safe_divide(jnp.sum(other * change), values[0] - values[j])
    normal = jnp.where(jnp.sum(jax.lax.stop_gradient(normal) * toward) < 0, -normal, normal)
    size = [jnp.abs(jnp.sum(vectors[:, j] * (H @ vectors[:, j]))) for j in range(3)]
    planarity = safe_divide(size[0], size[0] + size[1] + size[2])
    ok = (values[0] < 0) & (planarity >= jnp.asarray(least_planarity, planarity.dtype))
    return SurfaceNormal(normal, planarity, ok)
