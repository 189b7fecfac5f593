"""The body of a person, followed from image to image as the cell's cameras take them."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.body import BodyFit, BodyParams, BodyState, initial_body, track_body
from hrcjax.geom.cloud import Cloud
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
    nowhere = Cloud(jnp.zeros((1, 3), dtype), jnp.zeros((1,), bool))
    state = initial_body(params, dtype)
    shape = jax.eval_shape(lambda: track_body(params, state, nowhere.points, nowhere.mask, 0.0, nowhere.points[0])[1])
    nothing = jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), shape)
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
