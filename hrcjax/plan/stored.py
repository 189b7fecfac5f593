"""Keeps a compiler that fuses from computing a summand anew for each of the many sums that it is part of."""

import jax

from hrcjax.numerics import computed
from hrcjax.typing import Array, Float


@jax.custom_jvp
def stored(x: Float[Array, "..."]) -> Float[Array, "..."]:
    """x, divided by a 1 that the compiler does not know: it keeps the results of divisions. Worth a factor of 5.

    Not finite if: x is not.
    """
    return x / (1 + 0 * x)


@stored.defjvp
def _stored_jvp(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    return stored(primals[0]), computed(tangents[0])
