"""The penalty of a constraint that is not kept."""

import jax.numpy as jnp

from hrcjax.typing import Array, Scalar

SMOOTH = 0.0003
"""Half the width of the transition between a kept and a violated constraint [m]."""


def hinge(spare: Array, smooth: Scalar = SMOOTH) -> tuple[Array, Array, Array]:
    """The penalty of a constraint, its first derivative by the violation -spare, and its second.

    0 where the constraint is kept by more than `smooth`; half the square of the violation, and smooth^2 / 6, where it is
    violated by more; twice continuously differentiable between. The second derivative grows linearly from 0 to 1.

    Args:
        spare: how far the constraint is kept; negative: violated [m].
        smooth: half the width of the transition [m].
    """
    smooth = jnp.asarray(smooth, spare.dtype)
    into = jnp.clip(smooth - spare, 0, 2 * smooth)
    beyond = jnp.maximum(-spare - smooth, 0)
    curved = into / (2 * smooth)
    return into * into * curved / 6 + beyond * (smooth + beyond / 2), into * curved / 2 + beyond, curved
