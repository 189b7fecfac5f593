"""From exact images to points: noise, and fusion into a map of fine spacing."""

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
DEVIATION = 7e-4
"""Points whose deviation along the rays is over this are left out [m]."""
POINTS = 1024
"""Capacity of an object's cloud."""


def map_params() -> MapParams:
    """The map's parameters for surfaces at 0.3 to 1.1 m, with lengths in proportion to the spacing."""
    return MapParams(
        clear_distance=SPACING, new_distance=1.5 * SPACING, least_deviation=3e-4, memory=100.0, through=0.006
    )


@partial(jax.jit, static_argnums=(3,))
def perceive(cameras: Camera, exact: jax.Array, keys: jax.Array, frames: int) -> SeenPoints:
    """The points of the object, from noisy images of all cameras in turn.

    Args:
        cameras: with a leading axis.
        exact: their images without noise (camera, row, column) [m].
        keys: of the noise (camera).
        frames: images of each.
    """
    dtype, params = exact.dtype, map_params()
    corner = jnp.asarray(LAYOUT.lower, dtype)
    lower = corner.at[2].set(TABLE)
    upper = corner + jnp.asarray(BLOCKS, dtype) * 4 * SPACING

    def one(state: FieldMap, n: jax.Array) -> tuple[FieldMap, None]:
        k = n % keys.shape[0]
        camera, depth = jax.tree.map(lambda a: a[k], cameras), exact[k]
        noisy = measure(depth, camera, jax.random.fold_in(keys[k], n), NoiseParams())
        view = within_box(surface_view(params, camera, noisy, TILE), lower, upper)
        return fuse(LAYOUT, params, state, camera, view)[0], None

    state, _ = jax.lax.scan(one, empty_map(LAYOUT, dtype), jnp.arange(frames * keys.shape[0], dtype=jnp.int32))
    return seen_points(state, POINTS, lower, upper, DEVIATION)
