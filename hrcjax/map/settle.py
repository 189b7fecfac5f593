"""Fits what waits to be fitted, after the last frame."""

import jax
import jax.numpy as jnp

from hrcjax.map.layout import MapLayout
from hrcjax.map.params import MapParams
from hrcjax.map.state import FieldMap
from hrcjax.map.weigh import refit_round
from hrcjax.typing import Array, Bool


def settle(layout: MapLayout, params: MapParams, state: FieldMap) -> FieldMap:
    """The map with the weights of all blocks fitted: frames leave some for the next one. Points do not change.

    A layout without weights (`refitted` 0) stays as it is.
    """
    if layout.refitted == 0:
        return state

    def waiting(known: tuple) -> Bool[Array, ""]:
        return jnp.any(jnp.stack([jnp.any(which) for which in known[1]]))

    levels, stale, turn = jax.lax.while_loop(
        waiting, lambda known: refit_round(layout, *known, params), (state.levels, state.stale, state.turn)
    )
    return FieldMap(
        levels=levels,
        extent=state.extent,
        stale=stale,
        turn=turn,
        information=state.information,
        missed=state.missed,
        unmet=state.unmet,
        label=state.label,
        drift=state.drift,
        frames=state.frames,
    )
