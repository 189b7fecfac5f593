"""The scene and the people in it, read at once: a distance on a grid and a Gaussian process of moving points."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.field.closed_form import Part, part, read
from hrcjax.field.gp import GPField
from hrcjax.field.grid import GridField, grid_distance_and_gradient
from hrcjax.typing import Array, Float, Vector3


class Both(NamedTuple):
    """Readings of scene and people at a point."""

    distance: Float[Array, ""]
    """To everything [m]."""
    gradient: Vector3
    """Of that distance [1]."""
    scene_distance: Float[Array, ""]
    """To what stands [m]."""
    scene_gradient: Vector3
    """Of that distance [1]."""
    people: Part
    """What the field of the moving points says alone."""


def scene_and_people(scene: GridField, people: GPField, x: Vector3) -> Both:
    """Distance to everything at x: the occupancies exp(-d^2 / 2 l^2) of scene and people add.

    Args:
        scene: distance to all that stands.
        people: field of the moving points, of squared exponentials.
        x: query [m].
    """
    scale = people.length_scale
    d, g = grid_distance_and_gradient(scene, x)
    log_scene = -0.5 * d * jnp.abs(d) / scale**2
    moving = part(people, x)
    log_people = jnp.where(moving.some, moving.log_occupancy, log_scene - 100.0)
    log_all = jnp.logaddexp(log_scene, log_people)
    share = jnp.exp(log_scene - log_all)
    offset = share * jnp.abs(d) * g + (1.0 - share) * jnp.where(moving.some, moving.offset, 0.0)
    return Both(*read(log_all, offset, jnp.asarray(True), scale), d, g, moving)
