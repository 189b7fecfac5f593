"""What one image says of voxels: which of them it sees through."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.presence.params import PresenceParams
from hrcjax.presence.voxels import Columns, VoxelLayout, centres, pack_columns
from hrcjax.sense import Camera
from hrcjax.typing import Array, Float, Int

RING = 4
"""Pixels of a quarter of 640 x 480 about a person that may be without measurement: flying pixels, and the stereo shadow,
f B (1 / z - 1 / z') = 3 pixels of a person at 1.2 m before the floor [1]."""
NEAREST = 0.05
"""Depth under which a voxel is not looked at [m]."""


class Sight(eqx.Module):
    """Where the voxels appear in a camera's image."""

    pixel: Int[Array, "*camera voxel"]
    """Pixel of the voxel's middle, row by row; -1: outside the image."""
    depth: Float[Array, "*camera voxel"]
    """Depth of the voxel's middle along the optical axis [m]."""


def sight_of(layout: VoxelLayout, camera: Camera) -> Sight:
    """The voxels in the image of one camera."""
    x = centres(layout, camera.position.dtype) - camera.position
    R = camera.rotation
    a, b, z = (x[:, 0] * R[0, j] + x[:, 1] * R[1, j] + x[:, 2] * R[2, j] for j in range(3))
    safe = jnp.where(z > NEAREST, z, 1.0)
    u = jnp.floor(camera.fx * a / safe + camera.cx + 0.5).astype(jnp.int32)
    v = jnp.floor(camera.fy * b / safe + camera.cy + 0.5).astype(jnp.int32)
    inside = (z > NEAREST) & (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    return Sight(jnp.where(inside, v * camera.width + u, -1), z)


def least_around(image: Float[Array, "height width"]) -> Float[Array, "height width"]:
    """The least value of each pixel and its eight neighbours. 0, no measurement, counts as the least."""
    padded = jnp.pad(image, 1, mode="edge")
    rows = jnp.minimum(jnp.minimum(padded[:-2], padded[1:-1]), padded[2:])
    return jnp.minimum(jnp.minimum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])


def seen_free(
    layout: VoxelLayout, params: PresenceParams, sight: Sight, depth: Float[Array, "height width"], surely: float = 1.0
) -> Columns:
    """The voxels that an image sees through: all measured pixels about its middle lie behind it.

    Args:
        depth: 0: no measurement, which sees through nothing [m].
        surely: times the usual margin of noise [1].
    """
    seen = least_around(depth).reshape(-1)
    far = seen[jnp.maximum(sight.pixel, 0)]
    beyond = sight.depth + 0.5 * layout.edge + surely * params.deviations * params.pixel_noise * sight.depth**2
    return pack_columns(layout, (sight.pixel >= 0) & (far > beyond))


def seen_before(layout: VoxelLayout, sight: Sight, depth: Float[Array, "height width"]) -> Columns:
    """The voxels whose middles lie before what an image measures: a body measured there does not reach to them.

    Without a margin of noise, unlike `seen_free`, which says that nothing at all is in a voxel.

    Args:
        depth: 0: no measurement [m].
    """
    return pack_columns(layout, (sight.pixel >= 0) & (depth.reshape(-1)[jnp.maximum(sight.pixel, 0)] > sight.depth))


def not_measured(
    layout: VoxelLayout, sight: Sight, depth: Float[Array, "height width"], settled: Float[Array, "height width"]
) -> Columns:
    """The voxels on rays that measure nothing, nor do those about them, though they did in the empty cell.

    Args:
        depth: 0: no measurement [m].
        settled: depth of the empty cell; 0: not known [m].
    """
    # lone holes are a camera's usual ones
    blank = jnp.where((depth <= 0) & (settled > 0), 1.0, 0.0).astype(depth.dtype)
    blank = (least_around(blank) > 0).reshape(-1)
    return pack_columns(layout, (sight.pixel >= 0) & blank[jnp.maximum(sight.pixel, 0)])


def seen_behind(layout: VoxelLayout, sight: Sight, shown: Float[Array, "height width"]) -> Columns:
    """The voxels behind what an image shows, and in the ring of `RING` pixels about it, where it sees through nothing either.

    Args:
        shown: depth of the pixels that show somebody, or the robot; 0: others [m].
    """
    front = jnp.where(shown > 0, shown, jnp.inf)
    for _ in range(RING):
        front = least_around(front)
    return pack_columns(layout, (sight.pixel >= 0) & (front.reshape(-1)[jnp.maximum(sight.pixel, 0)] < sight.depth))


def all_sights(layout: VoxelLayout, cameras: Camera) -> Sight:
    """Of several cameras, stacked."""
    return jax.vmap(lambda one: sight_of(layout, one))(cameras)
