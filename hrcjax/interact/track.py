"""The hand from image to image: a filter of place, velocity and acceleration, where it is by now, and how long it has been still."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.interact.seen import HandParams, Seen, find_hand
from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3


class TrackParams(eqx.Module):
    """Numbers of the filter; our choice."""

    hand: HandParams = HandParams()
    """How the hand is found in an image."""
    memory: float = 0.12
    """Time over which the weight of past images falls by e [s]."""
    lag: float = 0.02
    """Mean age of an image's points beyond its stamp: of two cameras that take turns, each shows its latest [s]."""
    ahead: float = 0.25
    """Longest time over which the motion is carried on [s]."""
    jump: float = 0.25
    """A hand that is found farther than this from where it should be is another one: the track starts anew [m]."""
    speed_max: float = 1.0
    """Largest speed that is carried on [m/s]."""
    lost: float = 0.3
    """Time without an image of a hand after which there is none [s]."""
    still_radius: float = 0.03
    """A hand is still while it stays within this of where it came to rest [m]."""


class HandTrack(eqx.Module):
    """What is known of the hand."""

    there: Bool[Array, ""]
    """Whether a hand has been found and is not lost."""
    x: Vector3
    """Place at `stamp` [m]."""
    v: Vector3
    """Velocity [m/s]."""
    a: Vector3
    """Acceleration [m/s^2]."""
    stamp: Float[Array, ""]
    """Of the last image with a hand [s]."""
    image: Float[Array, ""]
    """Of the last image [s]."""
    rest: Vector3
    """Where it came to rest last [m]."""
    since: Float[Array, ""]
    """Since when it has been within `still_radius` of there [s]."""


def no_hand(dtype: jnp.dtype | type = jnp.float32) -> HandTrack:
    """Nothing is known."""
    zero, never = jnp.zeros((3,), dtype), jnp.asarray(-jnp.inf, dtype)
    return HandTrack(jnp.asarray(False), zero, zero, zero, never, never, zero, jnp.asarray(jnp.inf, dtype))


def watch_hand(params: TrackParams, track: HandTrack, seen: Seen) -> HandTrack:
    """The track after a tick; it changes where an image is new.

    Between images the hand moves with constant acceleration; an image corrects place, velocity and acceleration by the gains of the
    fading-memory filter of degree 2 (Morrison 1969): with theta = exp(-dt / memory), 1 - theta^3, 3/2 (1 - theta)^2 (1 + theta) / dt and
    (1 - theta)^3 / dt^2 times the residual.
    """
    new = seen.stamp > track.image
    hand = find_hand(params.hand, seen)
    dtype = seen.points.dtype
    stamp = jnp.asarray(seen.stamp, dtype)
    some = new & hand.there
    known = jnp.isfinite(track.stamp)
    dt = jnp.where(some & known, stamp - jnp.where(known, track.stamp, 0.0), 0.0)
    dt = jnp.maximum(dt, 1e-3)
    x, v = track.x + track.v * dt + track.a * (dt * dt / 2), track.v + track.a * dt
    residual = hand.x - x
    anew = ~track.there | (safe_norm(residual) > params.jump)
    theta = jnp.exp(-dt / params.memory)
    once, twice = 1 - theta, (1 - theta) ** 2
    after = HandTrack(
        jnp.asarray(True),
        jnp.where(anew, hand.x, x + (1 - theta**3) * residual),
        jnp.where(anew, 0.0, v + 1.5 * twice * (1 + theta) / dt * residual),
        jnp.where(anew, 0.0, track.a + once * twice / (dt * dt) * residual),
        stamp,
        stamp,
        track.rest,
        track.since,
    )
    moved = anew | (safe_norm(after.x - track.rest) > params.still_radius)
    after = eqx.tree_at(
        lambda k: (k.rest, k.since),
        after,
        (jnp.where(moved, after.x, track.rest), jnp.where(moved, stamp, track.since)),
    )
    lost = ~(seen.t - track.stamp <= params.lost)
    kept = eqx.tree_at(
        lambda k: (k.there, k.image),
        track,
        (track.there & ~lost, jnp.maximum(track.image, jnp.where(new, stamp, -jnp.inf))),
    )
    return jax.tree.map(lambda one, other: jnp.where(some, one, other), after, kept)


def hand_now(params: TrackParams, track: HandTrack, t: Scalar) -> tuple[Vector3, Vector3, Vector3]:
    """Place [m], velocity [m/s] and acceleration [m/s^2] of the hand by now, carried on from the last image."""
    ahead = jnp.clip(t - jnp.where(jnp.isfinite(track.stamp), track.stamp, t) + params.lag, 0.0, params.ahead)
    x = track.x + track.v * ahead + track.a * (ahead * ahead / 2)
    v = track.v + track.a * ahead
    return x, v / jnp.maximum(safe_norm(v) / params.speed_max, 1.0), track.a


def still_for(track: HandTrack, t: Scalar) -> Float[Array, ""]:
    """How long the hand has been still; 0 if there is none [s]."""
    return jnp.where(track.there, jnp.maximum(t - track.since, 0.0), 0.0)
