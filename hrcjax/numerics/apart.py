"""A border within a program that the compiler does not fuse across."""

from typing import TypeVar

import jax

_T = TypeVar("_T")


def computed(tree: _T) -> _T:
    """The same arrays, computed whole before they are used; so are their derivatives in reverse mode.

    Without it XLA on a CPU computes a long expression anew for every element that is made of it, as for each entry of an outer
    product of its result. The border is kept with `unrolled_options` alone.

    In reverse mode whatever crosses it has a cotangent, 0 where it is not used: its derivative must be finite even so.
    """
    return jax.lax.optimization_barrier(tree)
