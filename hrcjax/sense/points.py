"""Point clouds from depth images: deprojection, removal of the robot's body, cropping, separation of moved points."""

import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.segment import FAR, point_segment_distance
from hrcjax.numerics import require_floating, safe_sqrt
from hrcjax.sense.camera import Camera, pixel_directions
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3


def valid_depth(depth: Float[Array, "*image"]) -> Bool[Array, "*image"]:
    """True where a depth was measured: finite and greater than 0."""
    return jnp.isfinite(depth) & (depth > 0)


def supported(
    depth: Float[Array, "height width"],
    gap: Scalar | Float[Array, "height width"] = 0.05,
    least: Scalar = 2.0,
    corners: bool = False,
) -> Bool[Array, "height width"]:
    """True where at least `least` of a pixel's four neighbours have a depth within `gap` [m] of its own.

    Drops flying pixels between foreground and background, and surfaces less than two pixels wide: at a decimation of 4 and
    1.5 m that is 3 cm; at 8 the papers' columns of 6 cm are nearly lost.

    Args:
        depth: 0 or not finite: no measurement [m].
        gap: see above [m].
        least: neighbours [1].
        corners: whether the four neighbours at the corners count too: thin things may run across.
    """
    padded = jnp.pad(jnp.where(valid_depth(depth), depth, jnp.inf), 1, constant_values=jnp.inf)
    rows, columns = depth.shape
    own = padded[1:-1, 1:-1]
    steps = [(0, 1), (2, 1), (1, 0), (1, 2)] + ([(0, 0), (0, 2), (2, 0), (2, 2)] if corners else [])
    count = jnp.zeros_like(depth)
    for i, j in steps:
        other = padded[i : i + rows, j : j + columns]
        count = count + (jnp.abs(jnp.where(jnp.isfinite(own), own, 0) - other) <= gap).astype(depth.dtype)
    return valid_depth(depth) & (count >= least)


def deproject(camera: Camera, depth: Float[Array, "height width"]) -> Cloud:
    """The points of a depth image in the world, one per pixel, row by row; masked where there is no depth.

    Raises:
        ValueError: the image size differs from the camera's.
    """
    require_floating("deproject", depth=depth)
    if depth.shape != (camera.height, camera.width):
        raise ValueError(f"image of {depth.shape} for a camera of {(camera.height, camera.width)} (rows, columns)")
    x, y = pixel_directions(camera)
    mask = valid_depth(depth)
    z = jnp.where(mask, depth, 0)
    R, o = camera.rotation, camera.position
    world = [o[i] + z * (R[i, 0] * x + R[i, 1] * y + R[i, 2]) for i in range(3)]
    return Cloud(points=jnp.stack(world, axis=-1).reshape(-1, 3), mask=mask.reshape(-1))


def remove_body(cloud: Cloud, body: Capsules, scale: Scalar = 1.1, pad: Scalar = 0.05) -> Cloud:
    """The cloud without its points within scale x radius + pad [m] of the robot's capsules; points that are not finite are kept."""

    def step(outside: Array, capsule: tuple[Array, Array, Array]) -> tuple[Array, None]:
        a, b, radius = capsule
        distance = jax.vmap(point_segment_distance, in_axes=(0, None, None))(cloud.points, a, b)
        return outside & (~(distance <= scale * radius + pad) | (radius < 0)), None

    mask, _ = jax.lax.scan(step, cloud.mask, (body.a, body.b, body.radius))
    return Cloud(cloud.points, mask)


def crop(cloud: Cloud, lower: Vector3, upper: Vector3) -> Cloud:
    """The cloud within an axis-aligned box [m]; NaN points are kept, as their position is unknown."""
    outside = jnp.any((cloud.points < lower) | (cloud.points > upper), axis=-1)
    return Cloud(cloud.points, cloud.mask & ~outside)


def nearest_distance(points: Float[Array, "point 3"], cloud: Cloud, block: int = 8) -> Float[Array, "point"]:
    """Distance of each point to the nearest finite point of a cloud [m]; FAR if there is none.

    Loops over the cloud in blocks with the points as the vector axis, without an array of all pairs.
    """
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    count = cloud.mask.shape[0]
    rest = -count % block
    targets = jnp.pad(cloud.points, ((0, rest), (0, 0))).reshape(-1, block, 3)
    exists = cloud.mask & jnp.all(jnp.isfinite(cloud.points), axis=-1)
    real = jnp.pad(exists, (0, rest)).reshape(-1, block)

    def step(least: Array, some: tuple[Array, Array]) -> tuple[Array, None]:
        target, exists = some
        for k in range(block):
            dx, dy, dz = x - target[k, 0], y - target[k, 1], z - target[k, 2]
            least = jnp.minimum(least, jnp.where(exists[k], dx * dx + dy * dy + dz * dz, FAR * FAR))
        return least, None

    least, _ = jax.lax.scan(step, jnp.full_like(x, FAR * FAR), (targets, real))
    return safe_sqrt(least)


def moved(cloud: Cloud, background: Cloud, threshold: Scalar) -> Cloud:
    """The points farther than a threshold [m] from every point of the background; points that are not finite are kept."""
    return Cloud(cloud.points, cloud.mask & ~(nearest_distance(cloud.points, background) <= threshold))
