"""A point cloud of fixed capacity."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.typing import Array, Bool, Float, Int


class Cloud(eqx.Module):
    """Points of which only those under the mask exist; the others have finite, meaningless coordinates."""

    points: Float[Array, "*batch point 3"]
    """Positions in the world [m]."""
    mask: Bool[Array, "*batch point"]
    """True where a point exists."""


def drop_not_finite(cloud: Cloud) -> tuple[Cloud, Int[Array, "*batch"]]:
    """The cloud without points that have a NaN or an infinite coordinate, and how many these were.

    What they stood for is no longer in the cloud: whoever drops points answers for the count, for example by declaring
    the frame invalid.
    """
    finite = jnp.all(jnp.isfinite(cloud.points), axis=-1)
    kept = cloud.mask & finite
    dropped = jnp.sum(cloud.mask & ~finite, axis=-1, dtype=jnp.int32)
    return Cloud(jnp.where(finite[..., None], cloud.points, 0), kept), dropped
