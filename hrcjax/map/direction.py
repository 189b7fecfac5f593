"""Which way is off a surface that is very near: there the gradient of an unsigned distance fades out, and points the wrong way
on the far side of noisy points.

The normal is the direction in which the points under the kernel spread least: the eigenvector of the most negative
eigenvalue of the Hessian of the logarithm of the occupancy, (S - l^2) / l^4 with the spread S. Its side is that from which
the sensor saw the points, which the map remembers.
"""

import jax
import jax.numpy as jnp

from hrcjax.map.layout import MapLayout
from hrcjax.map.level import Level, block_rows
from hrcjax.map.moments import point_shares, total
from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.typing import Array, Float, Int, Scalar, Vector3

NEAR = (0.4, 0.9)
"""Between these distances over the length scale the normal gives way to the gradient of the distance [1]."""
SQUARINGS = 4
"""Of a matrix whose greatest eigenvector is sought; the 16th power of the ratio of its eigenvalues is left."""
OFFSET = 0.05
"""Weight of the offset from the points beside the remembered direction, for points without one [1]."""
LEVELS = 127.0
"""Directions are remembered in parts of this."""


def surface_direction(
    layout: MapLayout, levels: tuple[Level, ...], ratio: Scalar, slots: Int[Array, "block"], x: Vector3
) -> Vector3:
    """Unit normal of the surface near x, on the side from which it was seen [1]; 0 where the points have none. A constant to
    derivatives.

    Args:
        ratio: length scale over spacing [1].
        slots: of the blocks of level 0 nearest to x; the capacity: none.
    """
    at = jax.lax.stop_gradient(x)
    scale = jnp.asarray(layout.scale_of(ratio), x.dtype)
    offsets, share, _, _ = point_shares(block_rows(levels[0], slots), scale, at)
    toward = levels[0].toward.at[slots].get(mode="fill", fill_value=0).astype(x.dtype) / LEVELS
    mean = jnp.stack([total(share * o) for o in offsets])
    moment = {
        (i, j): total(share * offsets[i] * offsets[j]) - mean[i] * mean[j] for i in range(3) for j in range(i + 1)
    }
    S = jnp.stack([jnp.stack([moment[max(i, j), min(i, j)] for j in range(3)]) for i in range(3)]) / scale**2
    # of the cofactors the least eigenvector of S is the greatest: squared again and again, only n n' is left
    A = jnp.stack([jnp.cross(S[1], S[2]), jnp.cross(S[2], S[0]), jnp.cross(S[0], S[1])])
    for _ in range(SQUARINGS):
        A = safe_divide(A, jnp.trace(A))
        A = jnp.stack([jnp.stack([jnp.sum(A[i] * A[:, j]) for j in range(3)]) for i in range(3)])
    side = jnp.stack([total(share * toward[:, a]) for a in range(3)]) + OFFSET / scale * mean
    n = jnp.sum(safe_divide(A, jnp.trace(A)) * side, axis=1)
    return safe_divide(n, safe_norm(n))


def turned_off(g: Vector3, normal: Vector3, d: Float[Array, ""], length_scale: Scalar) -> Vector3:
    """A gradient [1] that is the normal next to a surface.

    Args:
        normal: of `surface_direction`; 0: the gradient stays.
        d: distance to the surface [m].
        length_scale: of the kernel [m].
    """
    low, high = (part * jnp.asarray(length_scale, d.dtype) for part in NEAR)
    t = jnp.clip((high - d) / (high - low), 0.0, 1.0)
    share = jnp.where(jnp.any(normal != 0), t * t * (3.0 - 2.0 * t), 0.0)
    return g + share * (normal - g)


def is_near(d: Float[Array, "*n"], length_scale: Scalar) -> Array:
    """Where `turned_off` needs a normal."""
    return d < NEAR[1] * jnp.asarray(length_scale, d.dtype)
