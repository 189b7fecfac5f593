"""A field of the exact shapes, moved by noise: what a sensing that keeps its word tells, at the cost of some capsules."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.field.grid import GridField, fit_grid, grid_distance_and_gradient, grid_nodes
from hrcjax.field.near import OTHER_WAY
from hrcjax.geom.segment import FAR
from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.sim import Cell, FieldPart, Fields, Reading
from hrcjax.sim.default_parts import SURFACES
from hrcjax.typing import Array, Float, Vector3
from hrcjax.world import Scene
from hrcjax.world.scene import scene_distance


class Margin(eqx.Module):
    """Parameters of the field."""

    noise: float = 0.03
    """Taken off the distance to people: the error of their position that the field vouches for [m]."""
    in_front: float = 0.0
    """A capsule whose nearest point is so much in front of the plane through a nearer one is read as well, as in the cell; infinite:
    those in other directions alone [m]."""


class Shapes(eqx.Module):
    """Capsules of people, as an image tells them; a row for each image."""

    a: Float[Array, "*image capsule 3"]
    """One end of each axis [m]."""
    b: Float[Array, "*image capsule 3"]
    """The other end [m]."""
    radius: Float[Array, "*image capsule"]
    """Negative: nobody [m]."""


def standing(cell: Cell, scene: Scene) -> GridField:
    """The exact distance to what stands, sampled as a map is."""
    nodes = grid_nodes(cell.grid)
    values = jax.lax.map(lambda x: scene_distance(scene, x), nodes, batch_size=4096)
    return fit_grid(cell.grid, values.reshape(cell.grid.shape))


def read(params: Margin, fields: Fields, x: Vector3) -> Reading:
    """Distances at a point; to people the nearest capsule's, and those of the nearest in other directions or in front of it."""
    people: Shapes = fields.moving
    stands, off = grid_distance_and_gradient(fields.static, x)
    way, from_a = people.b - people.a, x - people.a
    part = jnp.clip(safe_divide(jnp.sum(from_a * way, -1), jnp.sum(way * way, -1)), 0, 1)
    gaps = from_a - part[:, None] * way
    size = safe_norm(gaps)
    directions = gaps / jnp.maximum(size, 1e-6)[:, None]
    to_surface = size - people.radius
    left = jnp.where(people.radius >= 0, to_surface - params.noise, FAR)
    distances, found = [], []
    for _ in range(SURFACES):
        k = jnp.argmin(left)
        some = left[k] < FAR
        distances.append(left[k])
        found.append(jnp.where(some, directions[k], 0.0))
        along = jnp.sum(directions * directions[k], -1)
        behind = along * to_surface >= to_surface[k] - params.in_front
        left = jnp.where((along > OTHER_WAY) & behind, FAR, left).at[k].set(FAR)
    near = distances[0] < stands
    return Reading(
        jnp.where(near, distances[0], stands), jnp.where(near, found[0], off), jnp.stack(distances), jnp.stack(found),
        stands, off,
    )  # fmt: skip


def _no_fit(params: Margin, frames: object) -> Fields:
    raise NotImplementedError("the shapes are given, see `Shapes`")


EXACT_FIELD = FieldPart(_no_fit, read)
