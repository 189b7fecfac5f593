"""The penalty of a constraint that is not kept."""

import jax.numpy as jnp

from hrcjax.typing import Array, Scalar

SMOOTH = 0.0003
"""Distance over which the penalty sets in [m]."""
_FAR = 10.0
"""Distance beyond which a constraint is as good as absent: keeps infinite bounds out of the derivatives [m]."""


def hinge(spare: Array, smooth: Scalar = SMOOTH) -> tuple[Array, Array, Array]:
    """Half the square of h(-spare), h(s) = (s + sqrt(s^2 + 4 smooth^2)) / 2, its derivative by the violation -spare, and its
    second derivative.

    Twice differentiable; for a violation far above `smooth` half its square, for a constraint kept by far next to 0.

    Args:
        spare: how far the constraint is kept; negative: violated [m].
        smooth: width of the transition [m].
    """
    s = -jnp.minimum(spare, _FAR)
    four = 4 * jnp.asarray(smooth, s.dtype) ** 2
    root = jnp.sqrt(s * s + four)
    # the difference of two large numbers, where the constraint is kept, is written as a quotient
    h = jnp.where(s < 0, four / 2 / (root - jnp.where(s < 0, s, 0)), (s + root) / 2)
    slope = h / root
    return h * h / 2, h * slope, slope * slope + h * (four / 2) / (root * root * root)
