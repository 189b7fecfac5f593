"""The settled picture of the empty cell, pixel by pixel of a stationary camera."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.presence.params import PresenceParams
from hrcjax.presence.sight import least_around
from hrcjax.typing import Array, Bool, Float

LEAST_IMAGES = 3.0
"""Measurements of a pixel, beside the robot, that make its depth known [1]."""
LEAST_SHARE = 0.25
"""And this share of the images in which the robot was not in the way; a hole is no measurement [1]."""


class Background(eqx.Module):
    """Sums over the images of the set-up, of pixels that do not show the robot."""

    total: Float[Array, "*camera height width"]
    """Sum of the measured depths [m]."""
    count: Float[Array, "*camera height width"]
    """Number of measurements [1]."""
    shown: Float[Array, "*camera height width"]
    """Number of images in which the robot was not in the way [1]."""


def initial_background(cameras: int, height: int, width: int, dtype: jnp.dtype | type) -> Background:
    """No image yet."""
    zero = jnp.zeros((cameras, height, width), dtype)
    return Background(zero, zero, zero)


def shows_robot(
    params: PresenceParams, depth: Float[Array, "height width"], robot: Float[Array, "height width"]
) -> Bool[Array, "height width"]:
    """True where a pixel shows the robot, or flies at its edge: not nearer than the robot about the pixel.

    Args:
        depth: measured [m].
        robot: depth at which the robot is expected; infinity where it is not [m].
    """
    near = least_around(robot)
    slack = params.robot_margin + params.deviations * params.pixel_noise * depth**2
    return jnp.isfinite(near) & (depth > near - slack)


def learn_background(
    params: PresenceParams,
    known: Background,
    depth: Float[Array, "height width"],
    robot: Float[Array, "height width"],
) -> Background:
    """The background of one camera after one more image of the empty cell."""
    clear = ~jnp.isfinite(least_around(robot))
    measured = clear & (depth > 0)
    return Background(
        known.total + jnp.where(measured, depth, 0.0),
        known.count + measured.astype(depth.dtype),
        known.shown + clear.astype(depth.dtype),
    )


def settled_depth(known: Background) -> Float[Array, "*camera height width"]:
    """Mean depth of the empty cell; 0 where it is not known [m]."""
    enough = (known.count >= LEAST_IMAGES) & (known.count >= LEAST_SHARE * known.shown)
    return jnp.where(enough, known.total / jnp.maximum(known.count, 1.0), 0.0)


def foreground(
    params: PresenceParams,
    depth: Float[Array, "height width"],
    settled: Float[Array, "height width"],
    robot: Float[Array, "height width"],
) -> Bool[Array, "height width"]:
    """True where a pixel contradicts settled free space: nearer than all that stands about it, and than the robot.

    Flying pixels at the edges of scene and robot lie between front and back, and so not before the front. Where the
    background is not known nothing is foreground by itself.

    Args:
        depth: measured; 0: nothing [m].
        settled: of the empty cell; 0: not known [m].
        robot: depth at which the robot is expected; infinity where it is not [m].
    """
    deviation = params.deviations * params.pixel_noise * depth**2
    # an unknown pixel among the neighbours says nothing: only its own counts
    front = least_around(jnp.where(settled > 0, settled, jnp.inf))
    before_scene = (settled > 0) & (depth < front - params.margin - deviation)
    return (depth > 0) & before_scene & ~shows_robot(params, depth, robot)
