"""A Gaussian-process distance field: occupancy regressed on surface points, distance by the kernel's inverse.

The occupancy o(x) = sum_i alpha_i k(|x - x_i|) has the target 1 at every point, (K + s2 I) alpha = 1; the distance is
the r at which k(r) = o(x). No normals, no inside: the distance is unsigned. Convex bodies are over-estimated, see
`convex_bias`.
"""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from hrcjax.field.kernel import SQUARED_EXPONENTIAL, Kernel
from hrcjax.field.moments import LEAST_EXPONENT
from hrcjax.field.params import FieldParams
from hrcjax.geom.cloud import Cloud
from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Bool, Float, Vector3

FAR = 10.0
"""Distance reported, with gradient 0, by a field of no points [m]."""

LEAST_LOG = -1e6
"""Logarithm of the occupancy of no points is this many over l^2 [m^2]."""

LEAST_TRUST = 1e-3
"""Below this part of the sum of absolute terms, a signed sum is taken for cancelled [1]."""


class GPField(eqx.Module):
    """A fitted distance field. Batches of fields have leading axes: take one before you query."""

    points: Float[Array, "*batch point 3"]
    """Training points [m]."""
    weights: Float[Array, "*batch point"]
    """Weights alpha; 0 where no point exists [1]."""
    mask: Bool[Array, "*batch point"]
    """True where a point exists."""
    length_scale: Float[Array, "*batch"]
    """Length scale of the kernel [m]."""
    kernel: Kernel = eqx.field(static=True, default=SQUARED_EXPONENTIAL)
    """Covariance function."""
    signed: bool = eqx.field(static=True, default=True)
    """False: all weights are known to be positive, and the care that negative ones need is left out."""


def gram(cloud: Cloud, length_scale: Array, kernel: Kernel) -> Float[Array, "point point"]:
    """Covariances of the points that exist; 0 in the rows and columns of the others."""
    p = [cloud.points[:, i] for i in range(3)]
    r2 = sum((c[:, None] - c[None, :]) ** 2 for c in p)
    both = cloud.mask[:, None] & cloud.mask[None, :]
    return jnp.where(both, jnp.exp(kernel.log(r2 / length_scale**2)), 0.0)


def _check(cloud: Cloud) -> None:
    """Refuses what no field can be fitted to, as far as it is known: values are while nothing is traced."""
    require_floating("fit", points=cloud.points)
    if cloud.points.ndim != 2 or cloud.points.shape[-1] != 3 or cloud.mask.shape != cloud.points.shape[:1]:
        raise ValueError(
            f"fit: points {cloud.points.shape}, mask {cloud.mask.shape}; accepted: one cloud, (point, 3) and (point,)"
        )
    if isinstance(cloud.points, Tracer) or isinstance(cloud.mask, Tracer):
        return
    mask = np.asarray(cloud.mask)  # in numpy: under a jit that closes over the cloud, jnp would trace
    bad = int(np.sum(mask & ~np.isfinite(np.asarray(cloud.points)).all(axis=-1)))
    if bad:
        raise ValueError(
            f"fit: {bad} of {int(mask.sum())} points under the mask are not finite; take them out with "
            "`hrcjax.geom.cloud.drop_not_finite`, which counts them"
        )


def fit(
    cloud: Cloud,
    params: FieldParams,
    kernel: Kernel = SQUARED_EXPONENTIAL,
    solver: Literal["lumped", "cholesky"] = "lumped",
) -> GPField:
    """The distance field of a cloud of surface points.

    Args:
        solver: "lumped": alpha_i = 1 / (s2 + sum_j k_ij), no solve, always positive, within 1-2 mm of the exact one
            on regular sampling for length scales up to the spacing. "cholesky": the exact solution; see `fit_exact`.

    Not finite if: a point under the mask is not and the cloud is traced, so that this can't be refused. Then every
    distance of the field is NaN: a thing that nobody can locate may be anywhere, and must not read as free space.

    Raises:
        ValueError: unknown solver; the cloud is not one cloud, or of integers; a point under the mask is not finite.
    """
    if solver == "cholesky":
        return fit_exact(cloud, params, kernel)[0]
    if solver != "lumped":
        raise ValueError(f"fit: solver {solver!r}; accepted: 'lumped', 'cholesky'")
    _check(cloud)
    length_scale = jnp.asarray(params.length_scale, cloud.points.dtype)
    s2 = jnp.asarray(params.noise, cloud.points.dtype) ** 2
    total = s2 + jnp.sum(gram(cloud, length_scale, kernel), axis=1)
    weights = jnp.where(cloud.mask, 1.0 / jnp.where(cloud.mask, total, 1.0), 0.0)
    spoilt = jnp.any(cloud.mask & ~jnp.all(jnp.isfinite(cloud.points), axis=-1))
    weights = jnp.where(spoilt, jnp.nan, weights)
    return GPField(cloud.points, weights, cloud.mask, length_scale, kernel, signed=False)


def fit_exact(
    cloud: Cloud, params: FieldParams, kernel: Kernel = SQUARED_EXPONENTIAL
) -> tuple[GPField, Bool[Array, ""]]:
    """The field whose weights solve (K + s2 I) alpha = 1, and whether they do.

    Float32 fails from condition numbers near 1e8: length scales over about 3 spacings, points that coincide with little
    noise. Then the second result is False and the field is the lumped one, NaN only for the reason that `fit` names.

    Returns:
        field: exact where the status is True.
        ok: the factor is finite and no equation is off by more than 0.01.

    Raises:
        ValueError: as `fit`.
    """
    lumped = fit(cloud, params, kernel)
    dtype = cloud.points.dtype
    diagonal = jnp.where(cloud.mask, jnp.asarray(params.noise, dtype) ** 2, 1.0)
    K = gram(cloud, lumped.length_scale, kernel) + jnp.diag(diagonal)
    target = cloud.mask.astype(dtype)

    def solve(K: Array) -> Array:
        return jax.scipy.linalg.cho_solve((jnp.linalg.cholesky(K), True), target)

    trial = jax.lax.stop_gradient(K)
    residual = trial @ solve(trial) - target
    ok = jnp.all(jnp.isfinite(residual)) & (jnp.max(jnp.abs(residual)) < 0.01)
    exact = solve(jnp.where(ok, K, jnp.eye(K.shape[0], dtype=dtype)))  # a second factor: its derivative is finite
    weights = jnp.where(cloud.mask, jnp.where(ok, exact, lumped.weights), 0.0)
    return GPField(cloud.points, weights, cloud.mask, lumped.length_scale, kernel), ok


def log_occupancy(field: GPField, x: Vector3) -> Float[Array, ""]:
    """Logarithm of the occupancy at x, a signed log-sum-exp [1].

    Where negative weights leave less than LEAST_TRUST of the sum of absolute terms, the sum of absolute terms is
    taken instead: more occupancy, a smaller distance. No point exists: LEAST_LOG / l^2, finite.
    """
    dx, dy, dz = (field.points[:, i] - x[i] for i in range(3))
    r2 = dx * dx + dy * dy + dz * dz
    terms = jnp.where(field.mask, field.kernel.log(r2 / field.length_scale**2), LEAST_LOG / field.length_scale**2)
    largest = jax.lax.stop_gradient(jnp.max(terms))
    k = jnp.exp(jnp.maximum(terms - largest, LEAST_EXPONENT))
    total = field.weights @ k
    return largest + log_signed(total, jnp.abs(field.weights) @ k if field.signed else total)


def has_digits(total: Float[Array, ""], absolute: Float[Array, ""]) -> Bool[Array, ""]:
    """True where a sum of signed terms has not cancelled."""
    return total > LEAST_TRUST * absolute


def log_signed(total: Float[Array, ""], absolute: Float[Array, ""]) -> Float[Array, ""]:
    """ln of a sum of signed terms, or of the sum of absolute terms if the first has cancelled; 0 if there are none. NaN stays NaN."""
    chosen = jnp.where(has_digits(total, absolute), total, absolute)
    none = chosen <= 0
    return jnp.where(none, 0.0, jnp.log(jnp.where(none, 1.0, chosen)))


def distance(field: GPField, x: Vector3) -> Float[Array, ""]:
    """Distance from x to the surface that the points sample [m]: the one scalar that defines gradient and Hessian.

    `jax.grad` and `jax.hessian` of it are finite everywhere. Below ROOT_BLEND length scales the value bends to 0 from
    below and the gradient shrinks to 0; below about a third of a length scale the direction of the gradient may be
    that of either side. Without points: FAR, gradient 0.
    """
    some = jnp.any(field.mask)
    log_o = jnp.where(some, log_occupancy(field, x), -1.0)
    return jnp.where(some, field.length_scale * field.kernel.distance(log_o), FAR)


def gradient(field: GPField, x: Vector3) -> Vector3:
    """Gradient of the distance by autodiff: points away from the surface [1].

    Its length is 1 on flat surfaces, within a few per cent of 1 a length scale from curved ones, and up to about 2.5
    below ROOT_BLEND length scales.
    """
    return jax.grad(distance, argnums=1)(field, x)
