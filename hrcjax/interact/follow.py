"""Follow: the tool keeps a set distance from a hand that moves, in a set direction from it.

Under speed and separation the distance must leave the arm in the yellow zone: nearer than 0.5 m (default numbers) no point may be faster
than 0.25 m/s, and nearer than 0.31 m the arm stops. The sensed distance is that of the whole arm to the whole person, a lower bound, and
the hand swings towards the tool: 0.7 m from the hand leaves 0.45 m of it, so 0.9 m by default. Nearer only power and force limiting allows.
"""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.interact.reference import Reference, ReferenceParams, Tool, bounded, led_to
from hrcjax.interact.seen import Seen
from hrcjax.interact.track import HandTrack, TrackParams, hand_now, no_hand, watch_hand
from hrcjax.typing import Array, Bool, Scalar, Vector3


class FollowParams(eqx.Module):
    """Numbers of following; our choice."""

    track: TrackParams = TrackParams()
    """How the hand is found and followed."""
    reference: ReferenceParams = ReferenceParams(
        gain=8.0, velocity_gain=32.0, acceleration=2.0, leash=0.1, velocity_leash=0.3
    )
    """How the goal comes up to it: off by the error of the hand's velocity over `gain`. The leash is long: the tool is to stay on a goal
    that turns."""
    distance: float = 0.9
    """From the hand's surface to the tool point [m]."""
    reach: float = 0.8
    """The goal is kept within this of the arm's base [m]."""


class Following(eqx.Module):
    """What is remembered from tick to tick."""

    track: HandTrack
    """The hand."""
    reference: Reference
    """The goal."""


def not_following(x: Vector3) -> Following:
    """At a place, without a hand."""
    return Following(no_hand(x.dtype), Reference(x, x * 0, x * 0))


def beside_hand(params: TrackParams, hand: Vector3, direction: Vector3, distance: Scalar) -> Vector3:
    """The tool's place at a distance from the surface of a hand [m].

    Args:
        hand: its middle [m].
        direction: unit vector from the hand to the tool [1].
    """
    return hand + (params.hand.radius + distance) * direction


def follow(
    params: FollowParams, memory: Following, seen: Seen, tool: Tool, home: Vector3, direction: Vector3, on: Bool[Array, ""], dt: Scalar,
) -> Following:  # fmt: skip
    """The memory after a tick; its `reference` is the goal. Without a hand the tool goes home.

    Args:
        tool: where the tool point is.
        home: where it waits [m].
        direction: unit vector from the hand to the tool [1].
        on: False: it stays at home.
        dt: length of the tick [s].
    """
    track = watch_hand(params.track, memory.track, seen)
    x, v, a = hand_now(params.track, track, seen.t)
    goes = track.there & on
    place = bounded(beside_hand(params.track, x, direction, params.distance), params.reach)
    still = jnp.zeros_like(x)
    reference = led_to(
        params.reference, memory.reference, tool, jnp.where(goes, place, home), jnp.where(goes, v, still), jnp.where(goes, a, still), dt
    )  # fmt: skip
    return Following(track, reference)
