"""Hand over: the tool goes to a pose beside a hand that holds still, holds there, and withdraws when the hand moves.

Under speed and separation the nearest pose is beyond the distance of a stop, 0.31 m (default numbers), plus what the sensed distance
falls short: some 0.45 m, from which a person takes what is offered by reaching for it. To come as near as a hand takes a thing from a
gripper, the monitor must be power and force limiting (`contact_limited`), whose speed towards people is that of a contact with the most
sensitive region.
"""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.geom.rotation import rotation_vector
from hrcjax.interact.follow import beside_hand
from hrcjax.interact.reference import Reference, ReferenceParams, Share, Tool, led_to, no_share, shifted
from hrcjax.interact.seen import Seen
from hrcjax.interact.track import HandTrack, TrackParams, hand_now, no_hand, still_for, watch_hand
from hrcjax.numerics import safe_norm
from hrcjax.policy import MovingFrame
from hrcjax.typing import Array, Bool, Matrix3, Scalar, Vector3


class HandOverParams(eqx.Module):
    """Numbers of handing over; our choice."""

    track: TrackParams = TrackParams()
    """How the hand is found and followed."""
    reference: ReferenceParams = ReferenceParams(speed=0.4, acceleration=1.0)
    """How the goal moves."""
    approach_speed: float = 0.2
    """Speed of the approach [m/s]."""
    distance: float = 0.45
    """From the hand's surface to the tool point [m]."""
    wait: float = 0.5
    """A hand that was still so long is approached [s]."""
    averaged: float = 1.0
    """Time over which the place of a hand that is still is averaged [s]."""
    withdraw_at: float = 0.06
    """A hand that has moved so far from where it was still has moved [m]."""
    turn: float = 4.0
    """Quickness of the turn of the tool to the hand; see `shifted` [1/s]."""
    reach: float = 0.85
    """A hand whose pose is farther than this from the arm's base is not approached [m]."""


class HandingOver(eqx.Module):
    """What is remembered from tick to tick."""

    track: HandTrack
    """The hand."""
    reference: Reference
    """The goal."""
    turned: Share
    """How far the tool is turned to the hand."""
    offered: Bool[Array, ""]
    """Whether the tool goes to the hand or is there."""
    mean: Vector3
    """Mean place of the hand while it is still [m]."""


def not_handing_over(x: Vector3) -> HandingOver:
    """At home, without a hand."""
    return HandingOver(no_hand(x.dtype), Reference(x, x * 0, x * 0), no_share(x.dtype), jnp.asarray(False), x)


def hand_over(
    params: HandOverParams, memory: HandingOver, seen: Seen, tool: Tool, home: Vector3, direction: Vector3, on: Bool[Array, ""],
    dt: Scalar,
) -> HandingOver:  # fmt: skip
    """The memory after a tick.

    Args:
        tool: where the tool point is.
        home: where the tool waits [m].
        direction: unit vector from the hand to the tool [1].
        on: False: it stays at home.
        dt: length of the tick [s].
    """
    track = watch_hand(params.track, memory.track, seen)
    x, _, _ = hand_now(params.track, track, track.stamp)
    still = still_for(track, seen.t)
    begins = ~memory.offered & (still >= params.wait) & on
    mean = jnp.where(memory.offered | (still > 0), memory.mean, x)
    within = safe_norm(x - mean) <= params.withdraw_at
    over = jnp.where(
        memory.offered, params.averaged, jnp.clip(still, dt, params.averaged)
    )  # an offer must not go with the hand
    mean = jnp.where(within, mean + (x - mean) * jnp.minimum(dt / over, 1.0), x)
    place = beside_hand(params.track, mean, direction, params.distance)
    offered = track.there & on & within & (memory.offered | begins) & (safe_norm(place) <= params.reach)
    zero = jnp.zeros_like(x)
    speed = jnp.where(offered, params.approach_speed, params.reference.speed)
    reference = led_to(params.reference, memory.reference, tool, jnp.where(offered, place, home), zero, zero, dt, speed)
    return HandingOver(track, reference, shifted(params.turn, memory.turned, offered, dt), offered, mean)


def turned_frame(memory: HandingOver, R_home: Matrix3, turn: Vector3) -> MovingFrame:
    """The frame that the tool is to ride on: turned from home about a fixed axis as far as it is offered.

    Args:
        R_home: axes of the tool at home [1].
        turn: rotation vector from there to the axes beside the hand; see `turn_between` [rad].
    """
    now, share = memory.reference, memory.turned
    return MovingFrame(
        rotation_vector(share.s * turn) @ R_home, now.x, now.v, share.rate * turn, now.a, share.curve * turn
    )


def turn_between(one: Matrix3, other: Matrix3) -> Vector3:
    """The rotation vector that turns the axes `one` into `other`; less than half a turn apart [rad]."""
    R = other @ one.T
    axis = jnp.stack([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine = safe_norm(axis)
    angle = jnp.arctan2(sine, (jnp.trace(R) - 1) / 2)
    return axis * jnp.where(sine > 1e-6, angle / jnp.where(sine > 1e-6, sine, 1.0), 1.0)
