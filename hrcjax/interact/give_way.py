"""Yield and resume: a tool on its task makes way for a person who comes to where it works, waits in a refuge, and goes on from there.

The goal is (1 - s) task + s refuge. The share s goes from 0 to 1 and back by three equal poles (`shifted`), so that velocity and
acceleration of the goal have no step. It goes quickly, and comes back with no more acceleration and jerk than the path clock has. The
task's own clock stands while somebody is in the way and until the tool is back where it left: it would pass the end of the task without
the tool. The tool gives way before the safety layer would slow it: a slow arm does not get out of the way.
"""

import math

import equinox as eqx
import jax.numpy as jnp

from hrcjax.interact.nearing import Nearing, NearingParams, carried_on, nearest_to_way, nobody_near, watch_nearing
from hrcjax.interact.reference import Reference, ReferenceParams, Share, Tool, led_to, no_share, shifted
from hrcjax.interact.seen import Seen
from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3


class GiveWayParams(eqx.Module):
    """Numbers of giving way; our choice."""

    reference: ReferenceParams = ReferenceParams(
        gain=3.0, velocity_gain=12.0, speed=0.5, acceleration=0.7, leash=0.002, velocity_leash=0.005
    )
    """How the goal moves where the tool could not follow. Its leash is short: what the policy asks for when the safety layer lets go comes on
    top of the way's own acceleration."""
    pace: float = 1.0
    """Phase of the task in a second at full pace: to and fro takes 2 pi over this [1/s]."""
    enter: float = 0.35
    """A person who is, or soon will be, so near to where the tool works is in the way [m]."""
    leave: float = 0.45
    """One who is farther than this for `clear` is not any more [m]."""
    clear: float = 0.5
    """[s]"""
    nearing: NearingParams = NearingParams()
    """How far an approach is carried on."""
    quickness: float = 5.0
    """Of the way to the refuge; see `shifted` [1/s]."""
    acceleration: float = 0.9
    """Largest acceleration on the way back; a little less than that of the path clock, as the tool's way to its goal comes on top [m/s^2]."""
    jerk: float = 9.0
    """Largest jerk there, likewise [m/s^3]."""
    waits: float = 0.1
    """Distance of the tool from its place at which the task's clock runs at 1/e of its pace [m]."""
    joined: float = 0.1
    """Share of the refuge at which it does [1]."""
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
    nearing: Nearing
    """Of people to where the tool works."""


STEEPEST = (math.sqrt(2) - 1) * math.exp(math.sqrt(2) - 2)
"""Largest second derivative of the response of three equal poles 1 to a step [1]."""


def in_refuge(x: Vector3) -> GivingWay:
    """In the refuge, about to start."""
    zero = jnp.zeros((), x.dtype)
    one = eqx.tree_at(lambda s: s.s, no_share(x.dtype), zero + 1)
    return GivingWay(Reference(x, x * 0, x * 0), one, jnp.asarray(False), zero, zero, zero, nobody_near(x.dtype))


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
    nearing = watch_nearing(params.nearing, memory.nearing, seen.stamp, nearest_to_way(seen, *ends))
    soon = nearing.distance - carried_on(params.nearing, nearing)
    clear = jnp.where(soon > params.leave, memory.clear + dt, 0.0)
    waiting = on & ((soon < params.enter) | (memory.waiting & (clear < params.clear)))
    place, slope, bend = task_at(memory.phase, *ends)
    back = gently(params.acceleration, params.jerk, safe_norm(refuge - place))
    share = shifted(
        jnp.where(waiting, params.quickness, jnp.minimum(back, params.quickness)), memory.share, waiting, dt
    )
    off = safe_norm(place + memory.share.s * (refuge - place) - tool.x)
    joined = jnp.exp(-((off / params.waits) ** 2) - (share.s / params.joined) ** 2)
    wanted = jnp.where(waiting, 0.0, params.pace * joined)
    most = params.clock * params.pace
    quicker = jnp.clip(10.0 * (wanted - memory.pace), -most, most)
    pace = memory.pace + quicker * dt
    rest = 1.0 - share.s
    x = rest * place + share.s * refuge
    v = rest * slope * pace + share.rate * (refuge - place)
    a = rest * (bend * pace * pace + slope * quicker) - 2 * share.rate * slope * pace + share.curve * (refuge - place)
    reference = led_to(params.reference, memory.reference, tool, x, v, a, dt)
    return GivingWay(reference, share, waiting, clear, memory.phase + pace * dt, pace, nearing)


def gently(acceleration: Scalar, jerk: Scalar, way: Float[Array, ""]) -> Float[Array, ""]:
    """Quickness of a share whose place, a way off, has no more acceleration and jerk than these [1/s].

    The response of three poles k to a step has the third derivative k^3 at first, which is its largest, and a second derivative of at most
    (sqrt(2) - 1) exp(sqrt(2) - 2) k^2, at the time (2 - sqrt(2)) / k.

    Args:
        way: its length [m].
    """
    way = jnp.maximum(way, 1e-3)
    return jnp.minimum(jnp.cbrt(jerk / way), jnp.sqrt(acceleration / (STEEPEST * way)))


def task_at(phase: Scalar, one: Vector3, other: Vector3) -> tuple[Vector3, Vector3, Vector3]:
    """Place on the way to and fro [m], and its first two derivatives by the phase."""
    way = (other - one) / 2
    c, s = jnp.cos(phase), jnp.sin(phase)
    return one + (1 - c) * way, s * way, c * way
