"""The monitor for tasks near a contact: power and force limiting alone (ISO/TS 15066, A.3), in place of speed and separation.

Towards people no point is faster than a contact with the most sensitive region of the body may be; no distance stops the arm. Data that
can't be trusted hold it as ever. A risk assessment decides whether a task may be run so; research software, not safety-rated.
"""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp

from hrcjax.safety import SafetyDecision, SafetyParams, ZoneState, initial_zone
from hrcjax.sim import SafetyPart, Separation, separation_monitor
from hrcjax.sim.default_parts import contact_speeds
from hrcjax.typing import Array, Float

UNBOUNDED = 100.0
"""Gain of speed in a tick that is no bound [m/s]."""


class MonitorParams(eqx.Module):
    """Either monitor."""

    safety: SafetyParams
    """Of both."""
    contact: Float[Array, ""] | float = 0.0
    """1: power and force limiting; 0: speed and separation [1]."""


def _decide(params: MonitorParams, memory: ZoneState, seen: Separation) -> tuple[ZoneState, SafetyDecision]:
    memory, found = separation_monitor(params.safety, memory, seen)
    by_force = jnp.asarray(params.contact) > 0.5
    d = seen.distance
    nominal = jnp.asarray(params.safety.zone.nominal_speed, d.dtype)
    slow = jnp.minimum(contact_speeds(params.safety, seen).astype(d.dtype), nominal)
    reduced = jnp.where(seen.guarded, params.safety.zone.red_speed, nominal)
    free = by_force & ~found.hold
    point = jnp.where(free, jnp.broadcast_to(jnp.minimum(slow, reduced), d.shape), found.point_limit)
    any_limit = found.speed_limit if found.any_limit is None else found.any_limit
    aside = jnp.zeros((), d.dtype) if found.aside is None else found.aside
    gain = jnp.asarray(UNBOUNDED, d.dtype) if found.gain is None else found.gain
    head = None if found.head_limit is None else jnp.where(free, UNBOUNDED, found.head_limit)
    return memory, replace(
        found,
        head_limit=head,
        point_limit=point,
        speed_limit=jnp.maximum(jnp.min(point), 0.0),
        any_limit=jnp.where(free, reduced, any_limit),
        aside=jnp.where(free, 0.0, aside),
        gain=jnp.where(free, UNBOUNDED, gain),
    )


CONTACT_OR_SEPARATION = SafetyPart(initial_zone, _decide, lambda params: params.safety.ssm)
"""The monitor; its parameters are `MonitorParams`."""
