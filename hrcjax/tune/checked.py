"""A user's losses, checked on shapes alone before anything is compiled."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp

from hrcjax.lab.errors import UsageError, one_line
from hrcjax.tune.declared import LOSSES, Loss

LONGEST = 160
"""Longest message of an error of a user's function that is shown [characters]."""


def check_losses(losses: Sequence[Loss], params: Any, cell: Any, world: Any, play: Callable[[Any, Any], Any]) -> None:
    """Calls every loss that is not a declared one with the shapes of an episode.

    Args:
        play: (params, world) -> episode.

    Raises:
        UsageError: a loss fails, or its result is not one real number.
    """
    own = [one for one in losses if one.name not in LOSSES]
    run = jax.eval_shape(play, params, world) if own else None
    for one in own:
        accepted = "accepted is a function (params, cell, world, episode) -> scalar of JAX operations"
        try:
            found = jax.eval_shape(lambda p, w, e, of=one.of: of(p, cell, w, e), params, world, run)
        except Exception as error:  # user code may raise anything
            said = one_line(error).split(" See https")[0]
            said = said if len(said) <= LONGEST else said[: LONGEST - 3] + "..."
            raise UsageError(f"--loss {one.name}: {type(error).__name__}: {said}; {accepted}") from error
        if wrong := _wrong(found):
            raise UsageError(f"--loss {one.name}: returns {wrong}; {accepted}")


def _wrong(found: Any) -> str:
    """What is not a real number about a result; empty: nothing."""
    if not isinstance(found, jax.ShapeDtypeStruct):
        return "nothing" if found is None else f"a {type(found).__name__}"
    if found.shape:
        return f"an array of shape {found.shape}"
    return "" if jnp.issubdtype(found.dtype, jnp.floating) else f"a number of type {found.dtype}"
