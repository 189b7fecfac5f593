"""Refuses integers where the numbers of a method would be cast to them."""

import jax.numpy as jnp
from jaxtyping import ArrayLike


def require_floating(function: str, **arrays: ArrayLike) -> None:
    """Checks the types of arrays, when a function is traced.

    The library follows the type of its inputs: a length scale of 0.035 m as an integer is 0.

    Args:
        function: whose arguments they are, for the message.

    Raises:
        ValueError: one of them is not floating point.
    """
    for name, array in arrays.items():
        dtype = jnp.result_type(array)
        if not jnp.issubdtype(dtype, jnp.floating):
            raise ValueError(f"{function}: {name} is {dtype}; accepted: floating point, such as {name}.astype(float)")
