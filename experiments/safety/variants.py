"""Ways to be safe beside people, as numbers of one monitor, so that one program plays them side by side."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.geom.segment import FAR
from hrcjax.robot import Arm
from hrcjax.safety import (
    SafetyDecision,
    SafetyParams,
    SsmParams,
    ZoneState,
    allowed_speed,
    assumed_human_speed,
    effective_mass,
    initial_zone,
    pfl_speeds,
)
from hrcjax.sim import Params, SafetyPart, Separation, separation_monitor
from hrcjax.sim.default_parts import contact_speeds
from hrcjax.typing import Array, Float

UNBOUNDED = 100.0
"""Speed that counts as no limit: finite, as the tick asks for [m/s]."""
EXPLAINED = {
    "zones": "the cell's monitor: speed and separation, zones, whole arm",
    "off": "no safety layer: for comparison only",
    "tool": "the same monitor, but the distance is that of the hand and tool alone, as in the Robotica paper",
    "contact_stop": "stop before contact, the principle of sara-shield: S_p without C, Z_d and Z_r, no reduced speed, no hysteresis, no retreat",
    "pfl": "power and force limiting alone: towards people never above the contact speed of the most sensitive region, no stop",
    "pfl_reflected": "the same, by the mass that a contact at each point would feel in its direction, instead of the standard's",
}
"""Variant -> what it is."""
VARIANTS = tuple(EXPLAINED)


class Switches(eqx.Module):
    """Parameters of the monitor below; the switches are 0 or 1."""

    safety: SafetyParams
    """Of the cell's monitor."""
    yardstick: SsmParams
    """What all variants are measured by."""
    watched: Float[Array, ""] | float = 1.0
    """0: no safety layer [1]."""
    whole: Float[Array, ""] | float = 1.0
    """0: only points of the last link count [1]."""
    force: Float[Array, ""] | float = 0.0
    """1: power and force limiting alone [1]."""
    reflected: Float[Array, ""] | float = 0.0
    """1: in it the mass that a contact feels, not the standard's [1]."""
    bare: Float[Array, ""] | float = 0.0
    """1: stop before contact alone, v(d) of S_p without C, Z_d and Z_r [1]."""


def contact_speed(safety: SafetyParams) -> Float[Array, ""]:
    """Contact speed of the most sensitive body region [m/s]."""
    return jnp.min(pfl_speeds(1.0 / effective_mass(safety.pfl)))


def before_contact(safety: SafetyParams, seen: Separation) -> Float[Array, "row"]:
    """Speed from which every point can stop before the person reaches it [m/s]; data older than the reaction time count as nearer."""
    ssm = eqx.tree_at(lambda s: (s.intrusion, s.Z_d, s.Z_r), safety.ssm, (0.0, 0.0, 0.0))
    older = jnp.clip(seen.age + seen.dt - ssm.reaction_time, 0.0, safety.max_age)
    d = seen.distance - ssm.v_h_near * older
    return jax.vmap(lambda one: allowed_speed(ssm, one, assumed_human_speed(ssm, one)))(d)


def variant_part(arm: Arm, contact_mass: str = "standard") -> SafetyPart:
    """The cell's monitor with switches; its parameters are `Switches`. It is for a cell that asks for the reflected mass.

    Args:
        contact_mass: the cell's own, for all variants but `pfl` and `pfl_reflected`.
    """
    last = np.asarray(arm.control_links) == arm.tool_link

    def decide(params: Switches, memory: ZoneState, seen: Separation) -> tuple[ZoneState, SafetyDecision]:
        rows = np.repeat(last, seen.distance.shape[0] // len(last))
        counts = jnp.asarray(rows) | (params.whole > 0.5)
        told = eqx.tree_at(
            lambda s: (s.distance, s.approach),
            seen,
            (jnp.where(counts, seen.distance, FAR), jnp.where(counts, seen.approach, 0.0)),
        )
        by_cell = replace(told, mobility=None) if contact_mass == "standard" else told
        memory, found = separation_monitor(params.safety, memory, by_cell)
        nominal = jnp.asarray(params.safety.zone.nominal_speed, seen.distance.dtype)
        contact = contact_speed(params.safety).astype(nominal.dtype)
        if seen.mobility is not None:
            contact = jnp.where(
                params.reflected > 0.5, contact_speeds(params.safety, seen).astype(nominal.dtype), contact
            )
        contact = jnp.minimum(contact, nominal)
        limit, most = found.point_limit, nominal if found.any_limit is None else found.any_limit
        force, free, bare = params.force > 0.5, params.watched < 0.5, params.bare > 0.5
        limit = jnp.where(force & ~found.hold, contact, limit)
        limit = jnp.where(bare & ~found.hold, jnp.minimum(before_contact(params.safety, told), nominal), limit)
        limit = jnp.where(free, UNBOUNDED, limit)
        most = jnp.where(free, UNBOUNDED, jnp.where((force | bare) & ~found.hold, nominal, most))
        stops = ~(force | free | bare)  # the others have no stop in which directions count
        return memory, replace(
            found,
            point_limit=limit,
            speed_limit=jnp.maximum(jnp.min(limit), 0.0),
            any_limit=most,
            hold=found.hold & ~free,
            aside=None if found.aside is None else jnp.where(stops, found.aside, 0.0),
            gain=None if found.gain is None else jnp.where(stops, found.gain, UNBOUNDED),
        )

    return SafetyPart(initial_zone, decide, lambda params: params.yardstick)


def switches(safety: SafetyParams, variant: str) -> Switches:
    """The parameters of a variant.

    Raises:
        KeyError: no such variant.
    """
    changed = {"zones": {}, "off": {"watched": 0.0}, "tool": {"whole": 0.0}, "contact_stop": {"bare": 1.0}, "pfl": {"force": 1.0}, "pfl_reflected": {"force": 1.0, "reflected": 1.0}}[variant]  # fmt: skip
    return Switches(safety, safety.ssm, **changed)


def with_variants(params: Params, variants: tuple[str, ...], dtype: jnp.dtype | type = jnp.float32) -> Params:
    """Parameters with the variants along the leading axis of `safety`; the others stay numbers.

    Raises:
        TypeError: the cell's monitor is not that of `hrcjax.safety`.
    """
    if not isinstance(params.safety, SafetyParams):
        raise TypeError("the variants are those of the monitor of hrcjax.safety; accepted: a cell with this monitor")
    each = [switches(params.safety, name) for name in variants]
    stacked = jax.tree.map(lambda *leaves: jnp.asarray(leaves, dtype), *each)
    rest = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), params)
    return eqx.tree_at(lambda p: p.safety, rest, stacked)


def batch_axes(params: Params) -> Params:
    """`in_axes` of a vmap over variants."""
    none = jax.tree.map(lambda _: None, params)
    return eqx.tree_at(lambda p: p.safety, none, jax.tree.map(lambda _: 0, params.safety), is_leaf=lambda x: x is None)
