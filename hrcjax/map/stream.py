"""What arrives from a camera, before it is believed: stamps that go on, poses that do not leap, images with depth.

A frame that is refused is named, changes nothing in the map, and does not renew its age: the safety monitor sees the
data grow old.
"""

import dataclasses

import equinox as eqx
import jax.numpy as jnp

from hrcjax.bits import pack, words
from hrcjax.geom.capsules import Capsules
from hrcjax.map.view import View
from hrcjax.numerics import safe_norm
from hrcjax.sense import Camera
from hrcjax.typing import Array, Float, Int, Matrix3, Scalar, Vector3

EMPTY = 1
REPEATED = 2
REVERSED = 4
LEAP = 8
BAD_POSE = 16
AHEAD = 32

NO_ROTATION = 0.01
"""How far R^T R may be from the identity [1]."""

REASONS = {
    EMPTY: "too few pixels with depth",
    REPEATED: "time stamp repeated",
    REVERSED: "time stamp before the last one",
    LEAP: "pose leapt",
    BAD_POSE: "time stamp, pose or robot not finite, or no rotation",
    AHEAD: "time stamp leapt ahead",
}
"""Why a frame is refused: bit -> words."""


class StreamParams(eqx.Module):
    """What a frame must keep to. Our choice."""

    least_share: Scalar = 0.05
    """Share of tiles with depth under which a frame says nothing [1]."""
    top_speed: Scalar = 2.0
    """Speed of a camera beyond which its pose has leapt [m/s]."""
    top_turn: Scalar = 4.0
    """The same for its turning [rad/s]."""
    slack: Scalar = 0.01
    """Leaps smaller than this are jitter [m], [rad]."""
    longest_gap: Scalar = 10.0
    """Between two frames; a stamp farther ahead has leapt [s]."""


class StreamState(eqx.Module):
    """The last frames of one camera."""

    stamp: Float[Array, ""]
    """Time of the last frame that was believed; minus infinity: none yet [s]."""
    latest: Float[Array, ""]
    """Time of the frame before, believed or not, if its stamp and pose were finite; minus infinity: none yet [s]."""
    rotation: Matrix3
    """World from camera, of that frame."""
    position: Vector3
    """Of the pinhole, of that frame [m]."""


def initial_stream(dtype: jnp.dtype | type = jnp.float32) -> StreamState:
    """No frame yet."""
    never = jnp.asarray(-jnp.inf, dtype)
    return StreamState(never, never, jnp.eye(3, dtype=dtype), jnp.zeros(3, dtype))


def admit(
    params: StreamParams,
    state: StreamState,
    stamp: Float[Array, ""],
    camera: Camera,
    view: View,
    body: Capsules | None = None,
) -> tuple[StreamState, View, Int[Array, ""]]:
    """Decides on one frame.

    A pose or stamp that leaps is refused once: if the next frame goes on from there, the camera has been moved, or its
    clock set.

    Args:
        stamp: when the image was taken, since a moment not long ago: float32 resolves a millisecond for two hours [s].
        body: the robot at that time; if it is not finite the frame is refused.

    Returns:
        the state, the view (without anything if the frame is refused), and bits of why it is refused; 0: it is not.
    """
    R, o = camera.rotation, camera.position
    finite = jnp.isfinite(stamp) & jnp.all(jnp.isfinite(o))
    finite = finite & jnp.all(jnp.abs(R.T @ R - jnp.eye(3, dtype=R.dtype)) < NO_ROTATION)
    if body is not None:
        finite = finite & jnp.all(jnp.isfinite(body.a)) & jnp.all(jnp.isfinite(body.b))
        finite = finite & jnp.all(jnp.isfinite(body.radius))
    began = jnp.isfinite(state.latest)
    dt = jnp.where(began & finite, jnp.maximum(stamp - state.latest, 0.0), 0.0)
    # |R - R'| over the square root of 2 is 2 sin(angle / 2), and near the angle for small ones
    turn = safe_norm((R - state.rotation).reshape(-1)) / jnp.sqrt(jnp.asarray(2.0, R.dtype))
    leap = (safe_norm(o - state.position) > params.top_speed * dt + params.slack) | (
        turn > params.top_turn * dt + params.slack
    )
    share = jnp.mean(view.mask, dtype=R.dtype)

    reasons = pack(
        {
            BAD_POSE: ~finite,
            EMPTY: ~(share >= params.least_share),
            REPEATED: finite & (stamp == state.latest),
            REVERSED: finite & (stamp < state.latest),
            LEAP: finite & began & leap & (stamp > state.latest),
            AHEAD: finite & began & (dt > params.longest_gap),
        }
    )
    good = reasons == 0
    state = StreamState(
        stamp=jnp.where(good, stamp, state.stamp),
        latest=jnp.where(finite, stamp, state.latest),
        rotation=jnp.where(finite, R, state.rotation),
        position=jnp.where(finite, o, state.position),
    )
    shown = dataclasses.replace(view, mask=view.mask & good, depth=jnp.where(good, view.depth, 0.0))
    return state, shown, reasons


def describe_frame(reasons: int) -> str:
    """The bits of a refusal in words; "none" for 0."""
    return words(REASONS, reasons)
