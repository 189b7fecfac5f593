"""How close a run came to obstacles and people, and how long."""

import jax.numpy as jnp

from hrcjax.metrics.samples import masked_min
from hrcjax.typing import Array, Bool, Float, Int, Scalar

ZONES = 4


def min_clearance(distance: Float[Array, "time"], mask: Bool[Array, "time"] | None = None) -> Float[Array, ""]:
    """Smallest distance of the samples that count [m]; inf where none does."""
    return masked_min(distance, mask)


def time_below(
    distance: Float[Array, "time"],
    threshold: Float[Array, "time"] | Scalar,
    dt: Scalar,
    mask: Bool[Array, "time"] | None = None,
) -> Float[Array, ""]:
    """Time with the distance under the threshold, constant or over time [s]. Its derivative is 0.

    Args:
        distance: over time [m].
        threshold: [m].
        dt: time of a sample [s].
        mask: samples that count.
    """
    below = distance < threshold
    below = below if mask is None else below & mask
    return jnp.sum(below, dtype=distance.dtype) * dt


def time_in_zones(
    zone: Int[Array, "time"], dt: Scalar, mask: Bool[Array, "time"] | None = None
) -> Float[Array, "zone"]:
    """Time spent in green, yellow, red and stop [s].

    Args:
        zone: 0, 1, 2 or 3 over time.
        dt: time of a sample, whose dtype the result has [s].
        mask: samples that count.
    """
    dt = jnp.asarray(dt)
    within = zone[:, None] == jnp.arange(ZONES, dtype=zone.dtype)
    within = within if mask is None else within & mask[:, None]
    return jnp.sum(within, axis=0, dtype=dt.dtype) * dt
