"""A generated world of analytic solids: its exact distance, and its exact depth image."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.shape import capsule_point_distance, plane_distance
from hrcjax.numerics import safe_norm, safe_sqrt
from hrcjax.sense import Camera
from hrcjax.sense.camera import pixel_directions, render_capsules, render_scene
from hrcjax.typing import Array, Float, Vector3
from hrcjax.world import Scene, scene_distance
from hrcjax.world.scene import FLOOR_Z

STEPS = 48
"""Steps of sphere tracing to a torus."""
CLOSE = 5e-4
"""A ray that ends nearer to a torus than this hits it [m]."""


class Tori(eqx.Module):
    """Tori."""

    center: Float[Array, "torus 3"]
    """Centre of the torus [m]."""
    axis: Float[Array, "torus 3"]
    """Axis of the torus, of length 1."""
    ring: Float[Array, "torus"]
    """Radius of the circle of tube centres [m]."""
    tube: Float[Array, "torus"]
    """Radius of the tube; negative: no torus [m]."""


class World(eqx.Module):
    """Obstacles, table and floor of a scene, capsules and tori."""

    scene: Scene
    capsules: Capsules
    tori: Tori


def torus_distance(x: Vector3, center: Vector3, axis: Vector3, ring: Array, tube: Array) -> Float[Array, ""]:
    """Signed distance to a torus [m]."""
    p = x - center
    along = jnp.sum(p * axis)
    out = safe_norm(p - along * axis) - ring
    return safe_sqrt(out * out + along * along) - tube


def world_distance(world: World, x: Vector3) -> Float[Array, ""]:
    """Signed distance to the nearest solid [m]: exact outside, negative inside."""
    c, t = world.capsules, world.tori
    up = jnp.asarray([0.0, 0.0, 1.0], x.dtype)
    d = jnp.minimum(scene_distance(world.scene, x), plane_distance(x, up, jnp.asarray(FLOOR_Z, x.dtype)))
    to_capsules = jax.vmap(capsule_point_distance, in_axes=(None, 0, 0, 0))(x, c.a, c.b, c.radius)
    d = jnp.minimum(d, jnp.min(jnp.where(c.radius >= 0, to_capsules, jnp.inf), initial=jnp.inf))
    to_tori = jax.vmap(torus_distance, in_axes=(None, 0, 0, 0, 0))(x, t.center, t.axis, t.ring, t.tube)
    return jnp.minimum(d, jnp.min(jnp.where(t.tube >= 0, to_tori, jnp.inf), initial=jnp.inf))


def _render_torus(camera: Camera, center: Array, axis: Array, ring: Array, tube: Array) -> Array:
    """Depth along the optical axis by sphere tracing [m]; infinity where the ray misses."""
    u, v = pixel_directions(camera)
    R = camera.rotation
    direction = [R[a, 0] * u + R[a, 1] * v + R[a, 2] for a in range(3)]
    length = jnp.sqrt(1.0 + u * u + v * v)
    offset = camera.position - center
    begin = jnp.maximum(jnp.sqrt(jnp.sum(offset * offset)) - ring - tube, 0.0) / length

    def distance(t: Array) -> Array:
        x, y, z = (offset[a] + t * direction[a] for a in range(3))
        along = x * axis[0] + y * axis[1] + z * axis[2]
        flat = safe_sqrt(x * x + y * y + z * z - along * along)
        return jnp.sqrt((flat - ring) ** 2 + along * along) - tube

    t = jax.lax.fori_loop(0, STEPS, lambda _, t: jnp.minimum(t + distance(t) / length, 100.0), begin)
    return jnp.where(distance(t) < CLOSE, t, jnp.inf)


def render_world(camera: Camera, world: World) -> Float[Array, "height width"]:
    """Depth along the optical axis [m]; infinity where nothing is hit."""
    image = render_scene(camera, world.scene)
    c, t = world.capsules, world.tori
    image = jax.lax.cond(
        jnp.any(c.radius >= 0), lambda image: render_capsules(camera, c, image), lambda image: image, image
    )
    for k in range(t.ring.shape[0]):
        solid = (t.center[k], t.axis[k], t.ring[k], t.tube[k])
        image = jax.lax.cond(
            t.tube[k] >= 0,
            lambda image, *solid: jnp.minimum(image, _render_torus(camera, *solid)),
            lambda image, *_: image,
            image,
            *solid,
        )
    return image
