"""Sums over the points of some blocks: their shares in the occupancy at a query."""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Float, Vector3

_LEAST_EXPONENT = -60.0
_FAR_SQUARED = 1e6


def folded(two: Callable[[Array, Array], Array], a: Float[Array, "block voxel"]) -> Float[Array, "voxel"]:
    """All blocks joined by a function of two, halves at a time: whole rows are what a processor adds up fast."""
    while a.shape[0] > 1:
        half = a.shape[0] // 2
        joined = two(a[:half], a[half : 2 * half])
        a = joined if a.shape[0] % 2 == 0 else jnp.concatenate([joined, a[2 * half :]])
    return a[0]


def total(a: Float[Array, "block voxel"]) -> Float[Array, ""]:
    """Sum over all points."""
    return jnp.sum(folded(jnp.add, a))


def point_shares(
    rows: Float[Array, "block 4 voxel"], length_scale: Float[Array, ""], x: Vector3
) -> tuple[list[Array], Array, Array, Array]:
    """Offsets from the points to x [m], their shares in the occupancy, its logarithm, and whether there is any."""
    there = rows[:, 3] > 0
    offsets = [x[a] - rows[:, a] for a in range(3)]
    r2 = offsets[0] ** 2 + offsets[1] ** 2 + offsets[2] ** 2
    nearest = jnp.min(folded(jnp.minimum, jnp.where(there, r2, jnp.inf)))
    some = jnp.max(folded(jnp.maximum, rows[:, 3])) > 0  # not by the distance: what is not a number is not free space
    nearest = jax.lax.stop_gradient(jnp.where(some, nearest, 0.0))
    r2 = jnp.where(there, r2, nearest + _FAR_SQUARED)
    precision = 0.5 / length_scale**2
    k = rows[:, 3] * jnp.exp(jnp.maximum(precision * (nearest - r2), _LEAST_EXPONENT))
    mass = jnp.where(some, total(k), 1.0)
    return offsets, k / mass, jnp.log(mass) - precision * nearest, some
