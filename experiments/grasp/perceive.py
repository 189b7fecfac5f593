"""From exact images to points: noise, the median of the images from one place, and fusion into a map of fine spacing.

Noise of single images of the stationary cameras is as large as a voxel: points of one surface would fall into two layers of
voxels, and the mean within each is off by truncation. So images from one place become one first.
"""

from functools import partial

import jax
import jax.numpy as jnp

from hrcjax.grasp.seen_points import SeenPoints, seen_points
from hrcjax.map import FieldMap, MapLayout, MapParams, empty_map, fuse, surface_view
from hrcjax.map.clean import within_box
from hrcjax.sense import Camera, NoiseParams
from hrcjax.sense.noise import measure

from .scene import WORK

SPACING = 0.006
"""Of the map [m]."""
BLOCKS = (12, 12, 6)
"""Its size [blocks of 4 x 4 x 4 voxels]."""
LAYOUT = MapLayout(
    lower=(WORK[0] - BLOCKS[0] * 2 * SPACING, WORK[1] - BLOCKS[1] * 2 * SPACING, 0.0), shape=BLOCKS, spacing=SPACING,
    capacity=400, levels=2, seen=300, born=300, refitted=0,
)  # fmt: skip
TABLE = 0.006
"""Points lower than this over the table are taken for the table [m]."""
TILE = 2
"""Pixels along the edge of the tiles that images are thinned to."""
DEVIATION = 1e-3
"""Points whose deviation along the rays is over this are left out [m]."""
POINTS = 1024
"""Capacity of an object's cloud."""


MEDIAN = 1.2533
"""Standard deviation of a median of normal deviates over that of their mean [1]."""


def map_params(frames: int) -> MapParams:
    """The map's parameters for median images of surfaces at 0.3 to 1.1 m, with lengths in proportion to the spacing."""
    single = NoiseParams()
    deviation = MEDIAN / frames**0.5 if frames > 2 else 1 / frames**0.5
    return MapParams(
        pixel_noise=deviation * single.subpixel / (single.focal * single.baseline),
        clear_distance=SPACING, new_distance=1.5 * SPACING, least_deviation=3e-4, through=SPACING,
    )  # fmt: skip


def median_image(camera: Camera, exact: jax.Array, key: jax.Array, frames: int) -> jax.Array:
    """The median of several measured images of what stands still (row, column); 0: measured in fewer than half of them [m]."""
    images = jax.lax.map(lambda k: measure(exact, camera, k, NoiseParams()), jax.random.split(key, frames))
    count = jnp.sum((images > 0).astype(jnp.int32), axis=0)
    middle = jnp.nanmedian(jnp.where(images > 0, images, jnp.nan), axis=0)
    return jnp.where(2 * count >= frames, middle, 0)


@partial(jax.jit, static_argnums=(3,))
def perceive(cameras: Camera, exact: jax.Array, keys: jax.Array, frames: int) -> SeenPoints:
    """The points of the object, from noisy images of all cameras.

    Args:
        cameras: with a leading axis.
        exact: their images without noise (camera, row, column) [m].
        keys: of the noise (camera).
        frames: images of each.
    """
    dtype, params = exact.dtype, map_params(frames)
    corner = jnp.asarray(LAYOUT.lower, dtype)
    lower = corner.at[2].set(TABLE)
    upper = corner + jnp.asarray(BLOCKS, dtype) * 4 * SPACING

    def one(state: FieldMap, item: tuple[Camera, jax.Array, jax.Array]) -> tuple[FieldMap, None]:
        camera, depth, key = item
        image = median_image(camera, depth, key, frames)
        view = within_box(surface_view(params, camera, image, TILE), lower, upper)
        return fuse(LAYOUT, params, state, camera, view)[0], None

    state, _ = jax.lax.scan(one, empty_map(LAYOUT, dtype), (cameras, exact, keys))
    return seen_points(state, POINTS, lower, upper, DEVIATION)
