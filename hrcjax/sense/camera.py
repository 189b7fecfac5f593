"""A depth camera: exact depth images of obstacles, table, floor, people and robot, by closed-form ray casting.

The scene is static: its image is rendered once (`render_scene`); people and robot, all capsules, are drawn over it.
"""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.ray import ray_box, ray_capsule, ray_column, ray_plane, ray_sphere
from hrcjax.geom.rotation import look_at
from hrcjax.typing import Array, Float, Int, Matrix3, Scalar, Vector3
from hrcjax.world.scene import COLUMN, FLOOR_Z, SPHERE, Scene, table_solid

NEAREST = 0.05
"""What is nearer, or behind the camera, is projected as if it were so far before it [m]."""


class Camera(eqx.Module):
    """A pinhole camera: x right, y down, z forward. Pixel (u, v) looks along ((u - cx)/fx, (v - cy)/fy, 1)."""

    rotation: Matrix3
    """World from camera."""
    position: Vector3
    """Position of the pinhole in the world [m]."""
    fx: Scalar
    """Horizontal focal length [px]."""
    fy: Scalar
    """Vertical focal length [px]."""
    cx: Scalar
    """Column of the principal point [px]."""
    cy: Scalar
    """Row of the principal point [px]."""
    width: int = eqx.field(static=True)
    """Columns of the image."""
    height: int = eqx.field(static=True)
    """Rows of the image."""


def d435i(eye: Vector3, target: Vector3, decimation: int = 4) -> Camera:
    """An Intel D435i at `eye` that looks at `target`; of its 640 x 480 pixels every n-th column and row is kept.

    Raises:
        ValueError: a decimation that is not a positive divisor of 640 and 480.
    """
    if decimation < 1 or 640 % decimation or 480 % decimation:
        raise ValueError(f"decimation {decimation} must be a positive divisor of 640 and 480")

    def pixels(full: float) -> Array:
        return jnp.asarray(full / decimation, eye.dtype)

    return Camera(
        rotation=look_at(eye, target),
        position=eye,
        fx=pixels(385.0),
        fy=pixels(385.0),
        cx=pixels(319.0),
        cy=pixels(237.0),
        width=640 // decimation,
        height=480 // decimation,
    )


def pixel_directions(camera: Camera) -> tuple[Float[Array, "height width"], Float[Array, "height width"]]:
    """x and y of every pixel's ray in camera axes, at z = 1."""
    dtype = camera.position.dtype
    x = (jnp.arange(camera.width).astype(dtype) - camera.cx) / camera.fx
    y = (jnp.arange(camera.height).astype(dtype) - camera.cy) / camera.fy
    shape = (camera.height, camera.width)
    return jnp.broadcast_to(x, shape), jnp.broadcast_to(y[:, None], shape)


def in_image(
    camera: Camera, place: Float[Array, "*point 3"]
) -> tuple[Float[Array, "*point 2"], Float[Array, "*point"]]:
    """Columns and rows of points of the world [px], which may lie outside the image, and their depths along the optical axis [m].

    Nearer than `NEAREST` or behind the camera the pixel is that of a point at this depth, so that it stays finite.
    """
    own = (place - camera.position) @ camera.rotation
    focal, middle = jnp.stack([camera.fx, camera.fy]), jnp.stack([camera.cx, camera.cy])
    return own[..., :2] / jnp.maximum(own[..., 2:], NEAREST) * focal + middle, own[..., 2]


def ray_obstacle(
    kind: Int[Array, ""], center: Vector3, size: Vector3, yaw: Scalar, origin: Vector3, direction: Vector3
) -> Float[Array, ""]:
    """Where a ray enters one obstacle of a scene; infinity if it does not."""
    sphere = ray_sphere(origin, direction, center, size[0])
    column = ray_column(origin, direction, center, size[0], size[2])
    box = ray_box(origin, direction, center, size, yaw)
    return jnp.where(kind == SPHERE, sphere, jnp.where(kind == COLUMN, column, box))


def render_scene(camera: Camera, scene: Scene) -> Float[Array, "height width"]:
    """Depth along the optical axis of obstacles, table and floor [m]; infinity where nothing is hit."""
    x, y = pixel_directions(camera)
    table_center, table_half = table_solid(scene)
    up = jnp.asarray([0.0, 0.0, 1.0], x.dtype)
    floor = jnp.asarray(FLOOR_Z, x.dtype)

    def pixel(x: Array, y: Array) -> Array:
        direction = camera.rotation @ jnp.stack([x, y, jnp.ones_like(x)])  # z = 1: the ray's t is the depth
        obstacles = jax.vmap(ray_obstacle, in_axes=(0, 0, 0, 0, None, None))(
            scene.kind, scene.center, scene.size, scene.yaw, camera.position, direction
        )
        nearest = jnp.min(jnp.where(scene.mask, obstacles, jnp.inf), initial=jnp.inf)
        table = ray_box(camera.position, direction, table_center, table_half)
        return jnp.minimum(jnp.minimum(nearest, table), ray_plane(camera.position, direction, up, floor))

    return jax.vmap(jax.vmap(pixel))(x, y)


def render_capsules(
    camera: Camera, capsules: Capsules, behind: Float[Array, "height width"]
) -> Float[Array, "height width"]:
    """The image `behind` with capsules drawn over it [m]."""
    x, y = pixel_directions(camera)
    a = (capsules.a - camera.position) @ camera.rotation  # in the camera's axes, so that rays start at 0
    b = (capsules.b - camera.position) @ camera.rotation
    zero = jnp.zeros((3,), x.dtype)

    def draw(nearest: Array, capsule: tuple[Array, Array, Array]) -> tuple[Array, None]:
        def pixel(x: Array, y: Array) -> Array:
            return ray_capsule(zero, jnp.stack([x, y, jnp.ones_like(x)]), *capsule)

        return jnp.minimum(nearest, jax.vmap(jax.vmap(pixel))(x, y)), None

    image, _ = jax.lax.scan(draw, behind, (a, b, capsules.radius))
    return image


def render_depth(camera: Camera, scene: Scene, people: Capsules, robot: Capsules) -> Float[Array, "height width"]:
    """Depth along the optical axis of everything in the cell [m]; infinity where nothing is hit.

    Not finite if: a pixel's ray hits neither scene nor floor, which is not an error.
    """
    return render_capsules(camera, robot, render_capsules(camera, people, render_scene(camera, scene)))
