"""Fits what waits to be fitted, after the last frame."""

import dataclasses

import jax
import jax.numpy as jnp

from hrcjax.map.layout import MapLayout
from hrcjax.map.params import MapParams
from hrcjax.map.state import FieldMap
from hrcjax.map.weigh import refit_round


def settle(layout: MapLayout, params: MapParams, state: FieldMap) -> FieldMap:
    """The map with the weights of all blocks fitted: frames leave some for the next one. Points do not change.

    A layout without weights (`refitted` 0) stays as it is.
    """
    if layout.refitted == 0:
        return state

    base, stale, turn = jax.lax.while_loop(
        lambda known: jnp.any(known[1]),
        lambda known: refit_round(layout, *known, params),
        (state.levels[0], state.stale, state.turn),
    )
    return dataclasses.replace(state, levels=(base, *state.levels[1:]), stale=stale, turn=turn)
