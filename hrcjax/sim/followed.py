"""The body of a person, followed from image to image as the cell's cameras take them."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.body import BodyFit, BodyParams, BodyState, initial_body, track_body
from hrcjax.geom.segment import FAR
from hrcjax.presence import VoxelLayout
from hrcjax.presence.image_points import image_points
from hrcjax.presence.track import Track
from hrcjax.sense.rig import Rig
from hrcjax.typing import Array, Bool, Float, Int

POINTS = 512
"""Points of an image that a body is fitted to, the nearest to the robot's base."""


class Followed(eqx.Module):
    """The body after the last image."""

    state: BodyState
    """What is known from one image to the next."""
    fit: BodyFit
    """What the last image tells."""
    time: Float[Array, ""]
    """When it was taken [s]."""


def nobody_followed(params: BodyParams, time: Float[Array, ""]) -> Followed:
    """Before the first image.

    Args:
        time: shortly before it [s].
    """
    dtype = time.dtype
    state, zero = initial_body(params, dtype), jnp.zeros((), dtype)
    count = state.joints.shape[0]
    nothing = BodyFit(
        state.joints, state.radii, state.speeds, jnp.zeros((count, 3, 3), dtype), jnp.zeros((count, 3, 3), dtype), state.lengths,
        jnp.zeros_like(state.unseen), state.unseen, zero, zero, state.tracked, jnp.full((POINTS, 3), FAR, dtype),
    )  # fmt: skip
    return Followed(state, nothing, time)


def follow_body(
    params: BodyParams,
    voxels: VoxelLayout,
    rig: Rig,
    track: Track,
    before: Followed,
    camera: Int[Array, ""],
    exposed: Float[Array, ""],
    good: Bool[Array, ""],
) -> Followed:
    """The body after an image that the track of people has taken.

    Args:
        track: where people are, after the image.
        camera: which one took it.
        exposed: when [s].
        good: whether it was not refused; of a refused one no point counts.
    """
    cloud = image_points(voxels, track, camera, POINTS)
    dt = jnp.maximum(exposed - before.time, 0.0)
    eye = rig.cameras.position[camera]
    state, fit = track_body(params, before.state, cloud.points, cloud.mask & good, dt, eye)
    return Followed(state, fit, exposed)
