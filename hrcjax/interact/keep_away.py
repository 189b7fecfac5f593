"""Keep away: the tool holds a pose, and gives it up as far as a person comes nearer than a set distance.

The goal stands; the distance leaf of the composition (`KeepDistanceParams`, weight above 0) does the rest: the tool slides off along the
person's surface or back, and returns when there is room. Nearer than 0.5 m (default numbers) the red zone of the safety layer slows all
motion, the retreat too, and nearer than 0.31 m a stop leaves some centimetres a second of it: who reaches in faster than that catches a
tool that begins to go at the set distance. The leaf's distance therefore grows with the approach (`kept_from`), so that the tool has gone
before it would be slowed.
"""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.interact.nearing import Nearing, NearingParams, carried_on, nearest_to_way, nobody_near, watch_nearing
from hrcjax.interact.reference import Reference, ReferenceParams, Tool, at_rest, led_to
from hrcjax.interact.seen import Seen
from hrcjax.typing import Array, Float, Scalar, Vector3


class KeepAwayParams(eqx.Module):
    """Numbers of keeping away; our choice."""

    reference: ReferenceParams = ReferenceParams(leash=0.015, velocity_leash=0.03)
    """How the goal moves: on a short leash, so that a tool that has kept away comes back without haste."""
    nearing: NearingParams = NearingParams()
    """How far an approach is carried on."""


class KeepingAway(eqx.Module):
    """What is remembered from tick to tick."""

    reference: Reference
    """The goal."""
    nearing: Nearing
    """Of people to the pose."""


def not_keeping_away(x: Vector3) -> KeepingAway:
    """At a place, with nobody near."""
    return KeepingAway(at_rest(x), nobody_near(x.dtype))


def keep_away(params: KeepAwayParams, memory: KeepingAway, seen: Seen, tool: Tool, pose: Vector3, dt: Scalar) -> KeepingAway:  # fmt: skip
    """The memory after a tick; its `reference` goes to the pose whoever is there.

    Args:
        pose: place of the tool point [m].
        dt: length of the tick [s].
    """
    still = jnp.zeros_like(pose)
    return KeepingAway(
        led_to(params.reference, memory.reference, tool, pose, still, still, dt),
        watch_nearing(params.nearing, memory.nearing, seen.stamp, nearest_to_way(seen, pose, pose)),
    )


def kept_from(params: KeepAwayParams, memory: KeepingAway, distance: Scalar) -> Float[Array, ""]:
    """The distance that the leaf is to keep now: the set one and what people will have come nearer the pose soon [m]."""
    return jnp.asarray(distance + carried_on(params.nearing, memory.nearing))
