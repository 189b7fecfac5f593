"""The depth of what is held still, from several images of one camera."""

import jax.numpy as jnp

from hrcjax.sense.noise import NoiseParams, depth_deviation
from hrcjax.sense.points import valid_depth
from hrcjax.typing import Array, Bool, Float

NEAR = 4.0
"""Depths farther than so many standard deviations from the rest do not count: they fly, or belong to something else [1]."""
ROUNDS = 4
LEAST = 1e-3


def still_depth(
    images: Float[Array, "image *camera height width"], used: Bool[Array, "image"], noise: NoiseParams | None = None
) -> tuple[Float[Array, "*camera height width"], Float[Array, "*camera height width"]]:
    """Depth of each pixel over the images of what is held still [m], and how many agree on it; 0 where less than half have one.

    The mean with Tukey's weights, begun at the median. The median alone is too far at an edge, where one depth in four flies, and
    always behind the edge: by 0.4 standard deviations.
    """
    noise = noise or NoiseParams()
    there = valid_depth(images) & used.reshape(-1, *(1,) * (images.ndim - 1))
    count = jnp.sum(there, axis=0)
    order = jnp.sort(jnp.where(there, images, jnp.inf), axis=0)
    enough = (2 * count >= jnp.maximum(jnp.sum(used), 1)) & (count > 0)
    middle = jnp.take_along_axis(order, (jnp.maximum(count - 1, 0) // 2)[None], axis=0)[0]
    depth = jnp.where(enough, middle, 1.0)

    def weights(depth: Array) -> Array:
        t = (images - depth) / (NEAR * depth_deviation(depth, noise))
        return jnp.where(there, jnp.maximum(1.0 - t * t, 0.0) ** 2, 0.0)

    for _ in range(ROUNDS):
        w = weights(depth)
        sums = jnp.sum(w, axis=0), jnp.sum(w * jnp.where(there, images, 0.0), axis=0)
        depth = jnp.where(sums[0] > LEAST, sums[1] / jnp.maximum(sums[0], LEAST), depth)
    agree = jnp.sum((weights(depth) > 0).astype(images.dtype), axis=0)
    return jnp.where(enough, depth, 0.0), jnp.where(enough, agree, 0.0)
