"""What is known of a person from one frame to the next, and what a frame tells of them."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.body.params import BodyParams
from hrcjax.body.skeleton import JOINTS, LENGTHS, PARTS, RADIUS_NAMES
from hrcjax.typing import Array, Bool, Float, Int

PLACES = 3 * len(JOINTS)
SHAPE = len(LENGTHS) + len(RADIUS_NAMES)
KNOWN = PLACES + SHAPE
"""Places of the joints, then lengths and radii: what a frame measures. Speeds come after them."""


class BodyState(eqx.Module):
    """Joints, lengths, radii and speeds with their covariance."""

    joints: Float[Array, "joint 3"]
    """Places [m]."""
    lengths: Float[Array, "length"]
    """Of the bones, `LENGTHS` [m]."""
    radii: Float[Array, "radius"]
    """Of the parts, `RADIUS_NAMES` [m]."""
    speeds: Float[Array, "joint 3"]
    """Velocities of the joints [m/s]."""
    covariance: Float[Array, "all all"]
    """Of places, lengths, radii and velocities, in this order."""
    scatter: Float[Array, "joint"]
    """Squared corrections of each joint over their variances, averaged over the last frames: the told variances of speeds times this are
    those of the corrections that really happen [1]."""
    unseen: Float[Array, "part"]
    """Time since each part was seen [s]."""
    age: Float[Array, ""]
    """Time since the track began [s]."""
    bad: Float[Array, ""]
    """Frames in a row that the body does not explain [1]."""
    facing: Float[Array, ""]
    """Evidence that left and right are not exchanged, averaged over the last frames; see `facing_evidence` [1]."""
    turn: Int[Array, ""]
    """Frames in which other bodies were fitted: which first guesses come next [1]."""
    rivals: Float[Array, "rival known"]
    """Other bodies that are being fitted: places, lengths and radii [m]."""
    tracked: Bool[Array, ""]
    """Whether there is a track."""


class BodyFit(eqx.Module):
    """The body after a frame."""

    joints: Float[Array, "*frame joint 3"]
    """Places [m]."""
    radii: Float[Array, "*frame radius"]
    """Of the parts [m]."""
    speeds: Float[Array, "*frame joint 3"]
    """Velocities of the joints [m/s]."""
    place_covariance: Float[Array, "*frame joint 3 3"]
    """Of every joint's place [m^2]."""
    speed_covariance: Float[Array, "*frame joint 3 3"]
    """Of its velocity, by the corrections of the last frames [m^2/s^2]."""
    lengths: Float[Array, "*frame length"]
    """Of the bones [m]."""
    seen: Float[Array, "*frame part"]
    """Points of the frame on each part [1]."""
    unseen: Float[Array, "*frame part"]
    """Time since each part was seen [s]."""
    explained: Float[Array, "*frame"]
    """Share of the points that lie on the body's surface [1]."""
    age: Float[Array, "*frame"]
    """Time since the track began [s]."""
    tracked: Bool[Array, "*frame"]
    """Whether there is a track; nothing else means anything where there is none."""
    strange: Float[Array, "*frame point 3"]
    """Points of the frame that are not of this body: farther from all of its parts than `BodyParams.strange`; far away where there is none [m]."""


def shape_deviations(params: BodyParams, dtype: jnp.dtype | type) -> Float[Array, "shape"]:
    """Standard deviations of lengths and radii before anything is known [m]."""
    lengths, radii = jnp.asarray(params.length_spreads, dtype), jnp.asarray(params.radii, dtype)
    return jnp.concatenate([lengths, params.radius_spread * radii])


def initial_body(params: BodyParams, dtype: jnp.dtype | type = jnp.float32) -> BodyState:
    """Nobody is followed."""
    zero = jnp.zeros((), dtype)
    variances = jnp.concatenate(
        [jnp.ones(PLACES, dtype), shape_deviations(params, dtype) ** 2, jnp.ones(PLACES, dtype)]
    )
    return BodyState(
        joints=jnp.zeros((len(JOINTS), 3), dtype),
        lengths=jnp.asarray(params.lengths, dtype),
        radii=jnp.asarray(params.radii, dtype),
        speeds=jnp.zeros((len(JOINTS), 3), dtype),
        covariance=jnp.diag(variances),
        scatter=jnp.ones((len(JOINTS),), dtype),
        unseen=jnp.full((len(PARTS),), jnp.inf, dtype),
        age=zero,
        bad=zero,
        facing=zero,
        turn=jnp.zeros((), jnp.int32),
        rivals=jnp.zeros((params.guesses, KNOWN), dtype),
        tracked=jnp.asarray(False),
    )


def settled(
    params: BodyParams, tracked: Bool[Array, "*n"], age: Float[Array, "*n"], explained: Float[Array, "*n"]
) -> Bool[Array, "*n"]:
    """Whether a track is old enough and explains enough.

    Args:
        tracked: whether there is one.
        age: time since it began [s].
        explained: share of the points that lie on its surface [1].
    """
    return tracked & (age >= params.sure_age) & (explained >= params.sure_explained)


def sure_track(params: BodyParams, fit: BodyFit) -> Bool[Array, ""]:
    """Whether what the track says counts: it is settled, and all of it is a number."""
    parts = (fit.joints, fit.speeds, fit.radii, fit.speed_covariance, fit.place_covariance)
    finite = jnp.stack([jnp.all(jnp.isfinite(part)) for part in parts])
    return settled(params, fit.tracked, fit.age, fit.explained) & jnp.all(finite)
