"""What a depth image looks like: how much of it is measured, how sharp its edges are, how much of it was there before.

Edges are looked for in inverse depth, which is linear on a plane and whose noise is the same at any depth: a stereo camera
measures disparity.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.sense.points import valid_depth
from hrcjax.typing import Array, Bool, Float, Scalar

RUN = 5
"""Pixels in a row in which an edge is looked for. A sharp edge is one step, or two about a flying pixel; smeared over more
pixels than this it is as many equal steps as there are neighbours, four."""


class Look(NamedTuple):
    """Completeness and sharpness of an image."""

    measured: Float[Array, "2 2"]
    """Share of each quadrant that is measured, and not too near [1]."""
    sharpness: Float[Array, ""]
    """The largest step between neighbours over the whole change, mean over runs of pixels across edges [1]."""
    edges: Float[Array, ""]
    """Number of those [1]."""


def _runs(
    inverse: Float[Array, "height width"], known: Bool[Array, "height width"], edge: Scalar, slope: Scalar, axis: int
) -> tuple[Array, Array]:
    """Sum of sharpness and number of the runs along an axis that are measured throughout and cross an edge."""
    count = inverse.shape[axis] - RUN + 1

    def moved(image: Array, k: int) -> Array:
        return jax.lax.slice_in_dim(image, k, k + count, axis=axis)

    pixels = [moved(inverse, k) for k in range(RUN)]
    whole, least, greatest, step = moved(known, 0), pixels[0], pixels[0], jnp.zeros_like(pixels[0])
    for k in range(1, RUN):
        whole = whole & moved(known, k)
        least, greatest = jnp.minimum(least, pixels[k]), jnp.maximum(greatest, pixels[k])
        step = jnp.maximum(step, jnp.abs(pixels[k] - pixels[k - 1]))
    change = greatest - least
    across = whole & (change > edge) & (change > slope * greatest)
    return jnp.sum(jnp.where(across, step / jnp.where(across, change, 1), 0)), jnp.sum(across, dtype=inverse.dtype)


def look(depth: Float[Array, "height width"], nearest: Scalar, edge: Scalar, slope: Scalar) -> Look:
    """What an image looks like.

    Args:
        depth: 0 or not finite: no measurement [m].
        nearest: what reads nearer is not measured either [m].
        edge: change of inverse depth within `RUN` pixels that counts as an edge [1/m].
        slope: change of depth within `RUN` pixels, as a share of the larger one, that a slanting surface may have [1].
    """
    known = valid_depth(depth) & (depth >= nearest)
    inverse = jnp.where(known, 1 / jnp.where(known, depth, 1), 0)
    down, rows = _runs(inverse, known, edge, slope, axis=0)
    across, columns = _runs(inverse, known, edge, slope, axis=1)
    edges = rows + columns
    half, middle = depth.shape[0] // 2, depth.shape[1] // 2
    quadrants = [[part[:, :middle], part[:, middle:]] for part in (known[:half], known[half:])]
    measured = jnp.stack([jnp.stack([jnp.mean(q, dtype=depth.dtype) for q in row]) for row in quadrants])
    return Look(measured, (down + across) / jnp.maximum(edges, 1), edges)


def same_share(depth: Float[Array, "height width"], last: Float[Array, "height width"]) -> Float[Array, ""]:
    """Share of pixels exactly as before, of those that either image measures [1]. 0 for two images without any depth."""
    known = valid_depth(depth) | valid_depth(last)
    same = jnp.sum(known & (depth == last), dtype=depth.dtype)
    return same / jnp.maximum(jnp.sum(known, dtype=depth.dtype), 1)
