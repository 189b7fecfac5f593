"""How curved the sampled surface is, read from the spread of the training points under the kernel, and what that does
to the distance.

About a query at the distance d from a surface with the principal radii R_1, R_2 (positive: convex), the points weighed
by alpha_i k_i spread over the tangent plane by l^2 R_j / (R_j + d): the further from a convex body, the narrower. The
occupancy is smaller by the root of the product of these shares, so that the kernel's inverse reads
d_hat^2 = d^2 + l^2 sum_j ln(1 + d / R_j) (Laplace's approximation; `convex_bias` is its case of a sphere). The spread is
known, so the bias is.
"""

import jax.numpy as jnp

from hrcjax.field.kernel import positive_part
from hrcjax.numerics import safe_divide
from hrcjax.typing import Array, Float, Matrix3, Vector3

LEAST_SHARE = 0.02
"""Added to the product of the shares: points of a sampled edge do not tell radii much smaller than their spacing [1]."""
KNEE = 0.1
"""The product of the shares is bent to 1 from this much under it to this much over it [1]."""
MOST = 0.6
"""The correction takes at most this share of the square of a distance: a sparse or noisy sample looks like a sharp edge, and a
surface there must not reach out to the query [1]."""
_BEND = 4
FADE = (0.1, 0.4)
"""Between these distances, in length scales, the correction sets in: nearer, the normal is not known [1]."""


def tangential_share(spread: Matrix3, offset: Vector3, length_scale: Float[Array, ""]) -> Float[Array, ""]:
    """Product of the spreads in the plane across `offset`, over l^4 [1]: 1 on a plane, less on a convex body.

    Args:
        spread: covariance of the training points under the weights alpha_i k_i [m^2].
        offset: from their mean to the query [m].
    """
    S = spread / length_scale**2
    cofactor = jnp.stack([jnp.cross(S[1], S[2]), jnp.cross(S[2], S[0]), jnp.cross(S[0], S[1])])
    return safe_divide(jnp.sum(offset * (cofactor @ offset)), jnp.sum(offset * offset), 1.0)


def curvature_correction(share: Float[Array, ""], offset: Vector3, length_scale: Float[Array, ""]) -> Float[Array, ""]:
    """What to add to the square of a distance over l^2: next to 0 (-0.025) on flat and concave surfaces, negative on convex ones [1].

    Concave surfaces are left as they are, for there the uncorrected distance is too small, which is the safe side.

    Args:
        share: of `tangential_share` [1].
        offset: from the mean of the training points under the weights alpha_i k_i to the query [m].
    """
    over = jnp.clip(share - (1.0 - KNEE), 0.0, 2.0 * KNEE)
    bent = jnp.minimum(share, 1.0 + KNEE) - over * over / (4.0 * KNEE)
    logarithm = jnp.log((jnp.maximum(bent, 0.0) + LEAST_SHARE) / (1.0 + LEAST_SHARE))
    low, high = ((f * length_scale) ** 2 for f in FADE)
    t = jnp.clip((jnp.sum(offset * offset) - low) / (high - low), 0.0, 1.0)
    return logarithm * t * t * (3.0 - 2.0 * t)


def corrected_square(square: Float[Array, ""], correction: Float[Array, ""]) -> Float[Array, ""]:
    """The square of a distance with its correction for curvature, bent so that (1 - MOST) of the square is always left; both
    over l^2 [1]."""
    part = jnp.maximum(-correction, 0.0) / (MOST * positive_part(square))
    return square + correction / (1.0 + part**_BEND) ** (1.0 / _BEND)
