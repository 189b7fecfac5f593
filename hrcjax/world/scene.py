"""A scene: obstacles on a table, the task's start and goal, and the exact distances that tests and metrics trust.

The robot's base stands at the origin on a table whose top is z = 0; the floor lies lower. People work at the table's +y
edge. Obstacles have a fixed capacity and a mask, so that all scenes share one compiled program.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import FAR
from hrcjax.geom.shape import box_distance, column_distance, segment_convex_distance, sphere_distance
from hrcjax.typing import Array, Bool, Float, Int, Scalar, Vector3

SPHERE, COLUMN, BOX = 0, 1, 2
FLOOR_Z = -0.75
"""Height of the floor [m]."""
TABLE_THICKNESS = 0.04
"""Thickness of the table's slab, whose top is z = 0 [m]."""


class Scene(eqx.Module):
    """Obstacles, table, task and workspace. Where the mask is False there is no obstacle."""

    kind: Int[Array, "obstacle"]
    """SPHERE, COLUMN (upright cylinder) or BOX (upright)."""
    center: Float[Array, "obstacle 3"]
    """Middle of the solid [m]."""
    size: Float[Array, "obstacle 3"]
    """Half extents [m]; a sphere's radius is size[0], a column's radius size[0] and half height size[2]."""
    yaw: Float[Array, "obstacle"]
    """Turn of a box about the vertical [rad]."""
    radius: Float[Array, "obstacle"]
    """Characteristic radius, the one that "zeta x radius" multiplies [m]."""
    mask: Bool[Array, "obstacle"]
    """True where an obstacle exists."""
    table_lower: Float[Array, "2"]
    """Least x and y of the table's top [m]."""
    table_upper: Float[Array, "2"]
    """Greatest x and y of the table's top [m]."""
    start: Float[Array, "3"]
    """Where the tool's path begins [m]."""
    goal: Float[Array, "3"]
    """Where it ends [m]."""
    lower: Float[Array, "3"]
    """Least corner of the box that paths keep to [m]."""
    upper: Float[Array, "3"]
    """Its greatest corner [m]."""


def first_obstacles(scene: Scene, count: int) -> Scene:
    """The same scene with room for the first `count` obstacles alone: obstacles come before free places."""
    names = ("kind", "center", "size", "yaw", "radius", "mask")
    return eqx.tree_at(
        lambda s: [getattr(s, name) for name in names], scene, [getattr(scene, name)[:count] for name in names]
    )


def obstacle_distance(
    kind: Int[Array, ""], center: Vector3, size: Vector3, yaw: Scalar, x: Vector3
) -> Float[Array, ""]:
    """Signed distance of a point to one obstacle [m]."""
    sphere = sphere_distance(x, center, size[0])
    column = column_distance(x, center, size[0], size[2])
    box = box_distance(x, center, size, yaw)
    return jnp.where(kind == SPHERE, sphere, jnp.where(kind == COLUMN, column, box))


def obstacle_distances(scene: Scene, x: Vector3) -> Float[Array, "obstacle"]:
    """Signed distance of a point to every obstacle [m]: negative inside, FAR (10 m) where there is none."""
    distances = jax.vmap(obstacle_distance, in_axes=(0, 0, 0, 0, None))(
        scene.kind, scene.center, scene.size, scene.yaw, x
    )
    return jnp.where(scene.mask, distances, FAR)


def table_solid(scene: Scene) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """Middle and half extents of the table's slab [m]."""
    half_thickness = jnp.full((1,), TABLE_THICKNESS / 2, scene.center.dtype)
    center = jnp.concatenate([(scene.table_lower + scene.table_upper) / 2, -half_thickness])
    return center, jnp.concatenate([(scene.table_upper - scene.table_lower) / 2, half_thickness])


def scene_distance(scene: Scene, x: Vector3, table: bool = True) -> Float[Array, ""]:
    """Signed distance of a point to the nearest obstacle, and to the table's slab unless told otherwise [m]."""
    nearest = jnp.min(obstacle_distances(scene, x), initial=FAR)
    if not table:
        return nearest
    center, half = table_solid(scene)
    return jnp.minimum(nearest, box_distance(x, center, half))


def capsules_obstacle_distances(scene: Scene, capsules: Capsules) -> Float[Array, "capsule obstacle"]:
    """Least signed distance of every capsule's surface to every obstacle [m]; FAR where either does not exist.

    The least value of the obstacle's signed distance on the capsule's axis, less the radius: exact while the axis is
    outside; negative by the depth of the deepest point of the axis, plus the radius, where it is not.
    """

    def one(a: Array, b: Array, radius: Array, kind: Array, center: Array, size: Array, yaw: Array) -> Array:
        return segment_convex_distance(a, b, lambda x: obstacle_distance(kind, center, size, yaw, x)) - radius

    over_obstacles = jax.vmap(one, in_axes=(None, None, None, 0, 0, 0, 0))
    over_capsules = jax.vmap(over_obstacles, in_axes=(0, 0, 0, None, None, None, None))
    distances = over_capsules(capsules.a, capsules.b, capsules.radius, scene.kind, scene.center, scene.size, scene.yaw)
    return jnp.where((capsules.radius >= 0)[:, None] & scene.mask, distances, FAR)


def capsules_scene_distance(scene: Scene, capsules: Capsules) -> Float[Array, "capsule"]:
    """Least signed distance of every capsule's surface to any obstacle [m]; FAR where there is nothing."""
    return jnp.min(capsules_obstacle_distances(scene, capsules), axis=1, initial=FAR)
