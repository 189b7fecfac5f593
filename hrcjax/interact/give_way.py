"""Yield and resume: a tool on its task makes way for a person who comes to where it works, waits in a refuge, and goes on from there.

The goal is (1 - s) task + s refuge. The share s goes from 0 to 1 and back by three equal poles (`shifted`), so that velocity and
acceleration of the goal have no step; the task's own clock runs at the share (1 - s) of its pace, so that it stands in the refuge and is
taken up where it was left. The tool gives way before the safety layer would slow it: a slow arm does not get out of the way.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.interact.reference import Reference, ReferenceParams, Share, Tool, led_to, no_share, shifted
from hrcjax.interact.seen import Seen
from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3


class GiveWayParams(eqx.Module):
    """Numbers of giving way; our choice."""

    reference: ReferenceParams = ReferenceParams(
        gain=4.0, velocity_gain=16.0, speed=0.5, acceleration=1.0, leash=0.015, velocity_leash=0.03
    )
    """How the goal moves where the tool could not follow."""
    pace: float = 1.0
    """Phase of the task in a second at full pace: to and fro takes 2 pi over this [1/s]."""
    enter: float = 0.5
    """A person who is, or within `foresight` will be, so near to where the tool works is in the way [m]."""
    leave: float = 0.6
    """One who is farther than this for `clear` is not any more [m]."""
    clear: float = 0.5
    """[s]"""
    foresight: float = 0.6
    """Time over which an approach is carried on [s]."""
    smoothing: float = 0.1
    """Time over which the distance's rate is averaged [s]."""
    approach_max: float = 1.5
    """Largest rate of approach that is carried on [m/s]."""
    quickness: float = 5.0
    """Of the way to the refuge and back; see `shifted` [1/s]."""
    waits: float = 0.1
    """Distance of the tool from its goal at which the task's clock runs at 1/e of its pace [m]."""
    clock: float = 2.0
    """Largest change of the pace, as a share of it, in a second [1/s]."""


class GivingWay(eqx.Module):
    """What is remembered from tick to tick."""

    reference: Reference
    """The goal."""
    share: Share
    """How far it is in the refuge."""
    waiting: Bool[Array, ""]
    """Whether somebody is in the way."""
    clear: Float[Array, ""]
    """How long nobody has been [s]."""
    phase: Float[Array, ""]
    """Of the task [rad]."""
    pace: Float[Array, ""]
    """Rate of the phase [1/s]."""
    distance: Float[Array, ""]
    """From where the tool works to the nearest person, in the last image [m]."""
    rate: Float[Array, ""]
    """Its rate [m/s]."""
    stamp: Float[Array, ""]
    """Of the last image [s]."""


FAR = 10.0
"""Distance where nobody is [m]."""


def in_refuge(x: Vector3) -> GivingWay:
    """In the refuge, about to start."""
    zero = jnp.zeros((), x.dtype)
    one = eqx.tree_at(lambda s: s.s, no_share(x.dtype), zero + 1)
    return GivingWay(
        Reference(x, x * 0, x * 0), one, jnp.asarray(False), zero, zero, zero, zero + FAR, zero, zero - jnp.inf
    )


def nearest_to_way(seen: Seen, one: Vector3, other: Vector3) -> Float[Array, ""]:
    """Distance of the nearest sensed point to the straight way between two places; `FAR`: nobody is there [m]."""

    def from_way(p: Vector3) -> Float[Array, ""]:
        way = other - one
        share = jnp.clip(jnp.dot(p - one, way) / jnp.maximum(jnp.dot(way, way), 1e-12), 0.0, 1.0)
        return safe_norm(p - one - share * way)

    return jnp.minimum(jnp.min(jnp.where(seen.mask, jax.vmap(from_way)(seen.points), FAR)), FAR)


def give_way(
    params: GiveWayParams, memory: GivingWay, seen: Seen, tool: Tool, ends: tuple[Vector3, Vector3], refuge: Vector3,
    on: Bool[Array, ""], dt: Scalar,
) -> GivingWay:  # fmt: skip
    """The memory after a tick; its `reference` is the goal of a tool that goes to and fro between two places.

    Args:
        tool: where the tool point is.
        ends: the two places; the task begins at the first [m].
        refuge: where the tool is in nobody's way [m].
        on: False: it goes on whoever comes; the safety layer alone reacts.
        dt: length of the tick [s].
    """
    new = seen.stamp > memory.stamp
    known = jnp.isfinite(memory.stamp)
    since = jnp.where(new & known, seen.stamp - jnp.where(known, memory.stamp, 0.0), 1.0)
    d = nearest_to_way(seen, *ends)
    # who comes into view at once has no rate
    rate = jnp.where(known & (memory.distance < FAR) & (d < FAR), (d - memory.distance) / jnp.maximum(since, 1e-3), 0.0)
    weight = 1 - jnp.exp(-since / params.smoothing)
    rate = jnp.where(new, memory.rate + weight * (rate - memory.rate), memory.rate)
    distance = jnp.where(new, d, memory.distance)
    stamp = jnp.where(new, seen.stamp, memory.stamp)
    soon = distance - params.foresight * jnp.clip(-rate, 0.0, params.approach_max)
    clear = jnp.where(soon > params.leave, memory.clear + dt, 0.0)
    waiting = on & ((soon < params.enter) | (memory.waiting & (clear < params.clear)))
    share = shifted(params.quickness, memory.share, waiting, dt)
    place, slope, bend = task_at(memory.phase, *ends)
    off = safe_norm(memory.reference.x - tool.x)
    wanted = params.pace * jnp.clip(1.0 - share.s, 0.0, 1.0) * jnp.exp(-((off / params.waits) ** 2))
    most = params.clock * params.pace
    quicker = jnp.clip(10.0 * (wanted - memory.pace), -most, most)
    pace = memory.pace + quicker * dt
    rest = 1.0 - share.s
    x = rest * place + share.s * refuge
    v = rest * slope * pace + share.rate * (refuge - place)
    a = rest * (bend * pace * pace + slope * quicker) - 2 * share.rate * slope * pace + share.curve * (refuge - place)
    reference = led_to(params.reference, memory.reference, tool, x, v, a, dt)
    return GivingWay(reference, share, waiting, clear, memory.phase + pace * dt, pace, distance, rate, stamp)


def task_at(phase: Scalar, one: Vector3, other: Vector3) -> tuple[Vector3, Vector3, Vector3]:
    """Place on the way to and fro [m], and its first two derivatives by the phase."""
    way = (other - one) / 2
    c, s = jnp.cos(phase), jnp.sin(phase)
    return one + (1 - c) * way, s * way, c * way
