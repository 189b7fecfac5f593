"""Sphere tracing (Hart 1996): where a ray first meets a surface of which only the distance is known."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Bool, DistanceFn, Float, Scalar, Vector3

STEEPEST = 0.2
"""The least slope of the distance along a ray that the last step and the derivative divide by [1]."""


class Hit(NamedTuple):
    """Where a ray meets a surface."""

    t: Float[Array, ""]
    """Way along the ray; where nothing was met, how far was looked [m]."""
    point: Vector3
    """The place [m]."""
    found: Bool[Array, ""]
    """Whether a surface was met."""


def sphere_trace(
    distance: DistanceFn,
    origin: Vector3,
    direction: Vector3,
    far: Scalar,
    tolerance: Scalar = 1e-3,
    steps: int = 96,
) -> Hit:
    """The first place along a ray at which the distance is within `tolerance` of 0.

    Each step goes as far as the distance says that nothing is there, so that no surface is passed over whose distance is not
    over-estimated. A field of noisy points does not fall to 0 at a surface: within `tolerance` a last step goes to where it would, along
    its slope, which is taken as at least `STEEPEST`. The derivative is that of the implicit function d(o + t u) = 0,
    dt = -(grad d . (do + t du)) / (grad d . u); of a ray that meets nothing it is 0.

    Args:
        origin: where the ray begins [m].
        direction: of length 1.
        far: the longest way [m].
        tolerance: a distance that counts as met [m].
        steps: the most steps; a ray that grazes a surface needs many.
    """

    frozen = jax.lax.stop_gradient
    origin, direction = jnp.asarray(origin), jnp.asarray(direction)
    given = (frozen(origin), frozen(direction))

    def step(t: Array, _: None) -> tuple[Array, None]:
        d = frozen(distance(given[0] + t * given[1]))
        return jnp.where(d > tolerance, jnp.minimum(t + d, far), t), None

    t, _ = jax.lax.scan(step, jnp.zeros((), origin.dtype), length=steps)
    left, slope = jax.value_and_grad(distance)(given[0] + t * given[1])
    found = (left <= tolerance) & jnp.isfinite(left)
    along = jnp.minimum(frozen(slope @ given[1]), -STEEPEST)
    t = t - jnp.where(found, distance(origin + t * direction) / along, 0.0)
    return Hit(t, origin + t * direction, found)
