"""How likely a field's own parameters make its training targets: 1 at every point of a cloud, under the exact Gaussian process.

C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, section 5.4. The targets are all
alike and the prior has mean 0 and amplitude 1: the smoothest function explains them best, so that both measures grow with the length
scale and, where that is long, as the noise vanishes. They say how well occupancy is explained, not how well distance is read.
"""

import math

import jax
import jax.numpy as jnp

from hrcjax.field.gp import gram
from hrcjax.field.kernel import SQUARED_EXPONENTIAL, Kernel
from hrcjax.field.params import FieldParams
from hrcjax.geom.cloud import Cloud
from hrcjax.lab.errors import UsageError
from hrcjax.numerics import safe_divide
from hrcjax.sim import Cell, Episode, Params, World
from hrcjax.typing import Array, Float

FRAMES = 8
"""Frames of a world that count, evenly spread over all."""
ROUNDING = 4.0
"""Added to the noise's variance, in roundings of 1 times the root of the number of points: the factor exists without noise [1]."""
LOG_2PI = math.log(2 * math.pi)


def log_evidence(cloud: Cloud, params: FieldParams, kernel: Kernel = SQUARED_EXPONENTIAL) -> Float[Array, ""]:
    """ln p(y = 1 | points, length scale, noise), the log marginal likelihood (eq. 5.8); 0 without points [1]."""
    factor, target = _factor(cloud, params, kernel)
    half = jax.scipy.linalg.solve_triangular(factor, target, lower=True)
    return -0.5 * half @ half - jnp.sum(jnp.log(jnp.diagonal(factor))) - 0.5 * LOG_2PI * jnp.sum(target)


def log_leave_one_out(cloud: Cloud, params: FieldParams, kernel: Kernel = SQUARED_EXPONENTIAL) -> Float[Array, ""]:
    """Sum over the points of ln p(y_i = 1 | the other points), from one inverse (eq. 5.10 to 5.12); 0 without points [1]."""
    factor, target = _factor(cloud, params, kernel)
    inverse = jax.scipy.linalg.cho_solve((factor, True), jnp.eye(target.shape[0], dtype=target.dtype))
    precision = jnp.diagonal(inverse)
    each = 0.5 * jnp.log(precision) - 0.5 * (inverse @ target) ** 2 / precision - 0.5 * LOG_2PI
    return jnp.sum(jnp.where(cloud.mask, each, 0.0))


def evidence(params: Params, cell: Cell, world: World, run: Episode | None) -> Float[Array, ""]:
    """- ln marginal likelihood of the field's parameters a point, mean over frames of people; of no episode."""
    return _mean_loss(log_evidence, params, world)


def leave_one_out(params: Params, cell: Cell, world: World, run: Episode | None) -> Float[Array, ""]:
    """- ln probability of each point given the others, mean over points and frames of people; of no episode."""
    return _mean_loss(log_leave_one_out, params, world)


def some_frames(world: World) -> Cloud:
    """At most `FRAMES` clouds of people, the first and the last among them."""
    count = world.frames.moving.mask.shape[0]
    size = min(FRAMES, count)
    places = [round(k * (count - 1) / max(size - 1, 1)) for k in range(size)]
    return jax.tree.map(lambda a: a[jnp.asarray(places)], world.frames.moving)


def _mean_loss(log_probability, params: Params, world: World) -> Float[Array, ""]:
    if not isinstance(params.field, FieldParams):
        raise UsageError(f"evidence, leave_one_out: the field has {type(params.field).__name__}; accepted: FieldParams")
    clouds = some_frames(world)
    dtype = clouds.points.dtype
    each = jax.lax.map(lambda cloud: log_probability(cloud, params.field), clouds)
    counts = jnp.sum(clouds.mask, axis=1).astype(dtype)
    return -safe_divide(jnp.sum(safe_divide(each, counts)), jnp.sum(counts > 0).astype(dtype))


def _factor(
    cloud: Cloud, params: FieldParams, kernel: Kernel
) -> tuple[Float[Array, "point point"], Float[Array, "point"]]:
    """Lower Cholesky factor of K + s2 I, that of the identity where no point exists, and the targets."""
    dtype = cloud.points.dtype
    size = cloud.mask.shape[0]
    step = jnp.finfo(dtype).eps * ROUNDING * math.sqrt(size)
    s2 = jnp.asarray(params.noise, dtype) ** 2 + step
    K = gram(cloud, jnp.asarray(params.length_scale, dtype), kernel)
    K = K + jnp.diag(jnp.where(cloud.mask, s2, 1.0))
    exists = jnp.all(jnp.isfinite(jnp.linalg.cholesky(jax.lax.stop_gradient(K))))
    # a bound on all rounding together: then it always exists
    more = jnp.where(exists, 0.0, step * math.sqrt(size))
    return jnp.linalg.cholesky(K + more * jnp.eye(size, dtype=dtype)), cloud.mask.astype(dtype)
