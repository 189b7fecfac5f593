"""A set of capsules: the shape of arms and people."""

import equinox as eqx

from hrcjax.typing import Array, Float


class Capsules(eqx.Module):
    """Capsules from a to b. One that does not exist has a negative radius."""

    a: Float[Array, "*batch capsule 3"]
    """One end of the axis, in the world [m]."""
    b: Float[Array, "*batch capsule 3"]
    """The other end [m]."""
    radius: Float[Array, "*batch capsule"]
    """Radius [m]; negative: no capsule."""
