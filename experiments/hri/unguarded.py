"""The safety layer switched off: for comparison with a baseline that has none. Bad data still hold the arm."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp

from hrcjax.safety import SafetyDecision, SafetyParams, ZoneState, initial_zone
from hrcjax.sim import SafetyPart, Separation, separation_monitor

UNBOUNDED = 100.0
"""Speed that counts as no limit: finite, as the tick asks for [m/s]."""


def _decide(params: SafetyParams, memory: ZoneState, seen: Separation) -> tuple[ZoneState, SafetyDecision]:
    memory, found = separation_monitor(params, memory, seen)
    free = jnp.where(found.hold, 0.0, UNBOUNDED).astype(found.speed_limit.dtype)
    found = replace(found, aside=None, gain=None)
    return memory, eqx.tree_at(
        lambda d: (d.point_limit, d.speed_limit, d.any_limit, d.zone, d.reasons),
        eqx.tree_at(lambda d: d.any_limit, found, free, is_leaf=lambda x: x is None),
        (
            jnp.broadcast_to(free, found.point_limit.shape), free, free, jnp.where(found.hold, found.zone, 0),
            jnp.where(found.hold, found.reasons, 0),
        ),
    )  # fmt: skip


UNGUARDED = SafetyPart(initial_zone, _decide, lambda params: params.ssm)
"""The monitor that sets no limit of speed."""
