"""What does not belong into a map, taken out of a view: flying pixels, the robot, what lies outside the cell."""

import dataclasses

import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.map.view import View, tile_surface
from hrcjax.sense import Camera
from hrcjax.sense.points import crop, remove_body, supported
from hrcjax.typing import Scalar, Vector3


def drop_lonely(view: View, camera: Camera, gap: Scalar = 0.02, slope: Scalar = 3.0, least: Scalar = 2.0) -> View:
    """The view without tiles that have too few neighbours at their own depth: they fly between front and back.

    Args:
        gap: difference of depth of neighbours on one surface [m].
        slope: and this much more for the distance across from one tile to the next [1].
        least: neighbours, of four.
    """
    depth = jnp.sum((view.points - camera.position) * camera.rotation[:, 2], axis=1)
    grid = jnp.where(view.mask, depth, 0.0).reshape(view.depth.shape)
    gaps = gap + slope * view.tile * grid / camera.fx
    return dataclasses.replace(view, mask=view.mask & supported(grid, gaps, least).reshape(-1))


def without_body(view: View, camera: Camera, body: Capsules, scale: Scalar = 1.1, pad: Scalar = 0.05) -> View:
    """The view without the points on the robot. The robot still occludes.

    Args:
        scale, pad: the robot is taken this much thicker [1], and this much more [m]; the presets of the HRI paper's map.
    """
    measured = view.depth.reshape(-1) > 0
    beside = remove_body(Cloud(tile_surface(camera, view), measured), body, scale, pad).mask
    return dataclasses.replace(
        view,
        mask=remove_body(Cloud(view.points, view.mask), body, scale, pad).mask,
        robot=(measured & ~beside).reshape(view.depth.shape),
    )


def within_box(view: View, lower: Vector3, upper: Vector3) -> View:
    """The view without the points outside an upright box [m]. Its rays still mark free space in the box."""
    return dataclasses.replace(view, mask=crop(Cloud(view.points, view.mask), lower, upper).mask)
