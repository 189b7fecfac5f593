"""One depth image in tiles of some pixels: the mean point of each tile and how far its rays are free."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import require_floating
from hrcjax.sense import Camera
from hrcjax.typing import Array, Bool, Float, Scalar

TILE = 4
"""Pixels along the edge of a tile, for images of 640 x 480; 2 for a quarter of that."""
LEAST_PIXELS = 4
"""Pixels of a tile that must lie near its reference for the tile to count, or three quarters of all if these are fewer;
flying pixels hang alone."""
LEAST_MEASURED = 0.75
"""Share of a tile's pixels that must be measured for the tile to mark free space: a camera leaves some holes
everywhere, and large ones where it is blind [1]."""


FARTHEST = 8.0
"""A greater depth is no measurement, but a sensor's code for none [m]."""


class View(eqx.Module):
    """What one image says, tile by tile."""

    points: Float[Array, "tile 3"]
    """Mean point of the tile's surface, in the world [m]."""
    mask: Bool[Array, "tile"]
    """True where enough pixels agree."""
    variance: Float[Array, "tile"]
    """Variance of that point along the ray [m^2]."""
    depth: Float[Array, "row column"]
    """Least depth of any pixel of a tile: its rays are free up to here; 0 where too few are measured [m]."""
    tile: int = eqx.field(static=True, default=TILE)
    """Pixels along the edge of a tile."""
    robot: Bool[Array, "row column"] | None = None
    """Tiles that show the robot, which occludes; None: it is not in the picture."""


def tile_surface(camera: Camera, view: View) -> Float[Array, "tile 3"]:
    """The places on the rays through the middles of the tiles at the tiles' least depths, in the world [m]."""
    rows, columns = view.depth.shape
    u, v = (view.tile * jnp.arange(n).astype(view.depth.dtype) + 0.5 * (view.tile - 1) for n in (columns, rows))
    x, y = view.depth * (u - camera.cx) / camera.fx, view.depth * (v[:, None] - camera.cy) / camera.fy
    return camera.position + jnp.stack([x, y, view.depth], axis=-1).reshape(-1, 3) @ camera.rotation.T


def make_view(
    camera: Camera,
    depth: Float[Array, "height width"],
    noise: Scalar,
    gap: Scalar = 0.02,
    farthest: Scalar = FARTHEST,
    tile: int = TILE,
    flying: Bool[Array, "height width"] | None = None,
) -> View:
    """Tiles of an image. Of each, the pixels within `gap` of its reference, one of the inner pixels, are averaged.

    Args:
        depth: measured; 0 or not finite: no measurement [m].
        noise: standard deviation of a pixel's depth over the square of that depth, s / (f B) [1/m].
        farthest: a greater depth is taken for no measurement [m].
        gap: at 1 m and nearer; farther in proportion to the depth [m].
        tile: pixels along the edge of a tile.
        flying: pixels between foreground and background, on no surface; their rays still mark free space.

    Raises:
        ValueError: an image smaller than a tile.
    """
    require_floating("make_view", depth=depth)
    if min(depth.shape) < tile:
        raise ValueError(f"image of {depth.shape} pixels (rows, columns): accepted are {tile} x {tile} and more")
    h, w = depth.shape[0] // tile, depth.shape[1] // tile
    depth = jnp.where(jnp.isfinite(depth) & (depth > 0) & (depth < farthest), depth, 0.0)[: h * tile, : w * tile]
    solid = depth if flying is None else jnp.where(flying[: h * tile, : w * tile], 0.0, depth)
    z = {(i, j): depth[i::tile, j::tile] for i in range(tile) for j in range(tile)}
    flat = {(i, j): solid[i::tile, j::tile] for i in range(tile) for j in range(tile)}
    low, high = (tile - 1) // 2, tile // 2
    reference = flat[low, low]
    for place in ((high, high), (low, high), (high, low)):
        reference = jnp.where(reference > 0, reference, flat[place])
    margin = gap * jnp.maximum(reference, 1.0)
    zero = jnp.zeros_like(reference)
    n, sz, sx, sy, least, measured = zero, zero, zero, zero, jnp.full_like(zero, jnp.inf), zero
    u0 = (tile * jnp.arange(w).astype(depth.dtype) - camera.cx) / camera.fx
    v0 = (tile * jnp.arange(h).astype(depth.dtype) - camera.cy)[:, None] / camera.fy
    for (i, j), pixel in z.items():
        keep = jnp.where((flat[i, j] > 0) & (jnp.abs(pixel - reference) <= margin), 1.0, 0.0)
        kept = keep * pixel
        n, sz = n + keep, sz + kept
        sx, sy = sx + kept * (u0 + j / camera.fx), sy + kept * (v0 + i / camera.fy)
        least = jnp.where(pixel > 0, jnp.minimum(least, pixel), least)
        measured = measured + jnp.where(pixel > 0, 1.0, 0.0)
    count = jnp.maximum(n, 1.0)
    local = [sx / count, sy / count, sz / count]
    R, o = camera.rotation, camera.position
    points = [o[a] + R[a, 0] * local[0] + R[a, 1] * local[1] + R[a, 2] * local[2] for a in range(3)]
    deviation = noise * local[2] ** 2
    return View(
        points=jnp.stack([p.reshape(-1) for p in points], axis=-1),
        mask=(n >= min(LEAST_PIXELS, 0.75 * tile * tile)).reshape(-1),
        variance=(deviation**2 / count).reshape(-1),
        depth=jnp.where(measured >= LEAST_MEASURED * tile * tile, least, 0.0),
        tile=tile,
    )
