"""A smooth lower bound of the distance to the nearest of a field's points.

The occupancy sum_i alpha_i exp(-r_i^2 / 2 l^2) is at least alpha_min exp(-r_min^2 / 2 l^2), so that the kernel's inverse,
corrected by the least weight, is never over the nearest point's distance, whatever the shape: no bias of convex bodies.
"""

import jax.numpy as jnp

from hrcjax.field.gp import GPField
from hrcjax.field.kernel import blended_root
from hrcjax.typing import Array, Float


def log_least_weight(field: GPField) -> Float[Array, "*field"]:
    """Logarithm of the least weight of a field of positive weights; 0 without points [1]."""
    least = jnp.min(jnp.where(field.mask, field.weights, jnp.inf), axis=-1)
    return jnp.where(jnp.isfinite(least), jnp.log(jnp.maximum(least, 1e-30)), 0.0)


def nearest_bound(
    log_o: Float[Array, ""], log_least: Float[Array, ""], length_scale: Float[Array, ""]
) -> Float[Array, ""]:
    """The bound from the logarithm of the occupancy [m]: sqrt(-2 l^2 (ln o - ln alpha_min)), at most r_min.

    Args:
        log_o: logarithm of the occupancy [1].
        log_least: logarithm of the least weight [1].
        length_scale: of the kernel [m].
    """
    return length_scale * blended_root(-2.0 * (log_o - log_least))
