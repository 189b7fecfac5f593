"""What a camera can see of a map: blocks in its frustum, and points in its free space."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.map.layout import REACH, MapLayout
from hrcjax.map.level import Level
from hrcjax.map.params import MapParams
from hrcjax.map.view import View
from hrcjax.sense import Camera
from hrcjax.typing import Array, Bool, Float, Scalar

_HALF_DIAGONAL = 3**0.5 / 2


def blocks_in_view(layout: MapLayout, params: MapParams, blocks: Level, camera: Camera) -> Bool[Array, "slot"]:
    """True where the circumscribed ball of a block touches the camera's frustum."""
    dtype, edge = blocks.rows.dtype, layout.edge_of(0)
    centre = jnp.asarray(layout.lower, dtype) + (blocks.place - REACH).astype(dtype) * edge + edge / 2
    x, y, z = jnp.moveaxis((centre - camera.position) @ camera.rotation, 1, 0)
    radius = _HALF_DIAGONAL * edge

    def between(a: Array, pixels: int, middle: Scalar, focal: Scalar) -> Array:
        low, high = jnp.asarray(-middle / focal, dtype), jnp.asarray((pixels - middle) / focal, dtype)
        inside = a - low * z > -radius * jnp.sqrt(1 + low * low)
        return inside & (high * z - a > -radius * jnp.sqrt(1 + high * high))

    seen = between(x, camera.width, camera.cx, camera.fx) & between(y, camera.height, camera.cy, camera.fy)
    return seen & (z > -radius) & (z < params.far + radius) & (blocks.place[:, 0] > 0)


class Look(NamedTuple):
    """What an image says at points of the map."""

    past: Bool[Array, "*n"]
    """All measured pixels of the point's tile see farther than the point."""
    met: Bool[Array, "*n"]
    """It meets something at the point's depth."""
    unmet: Bool[Array, "*n"]
    """The point is occluded, by other than the robot, or nothing is measured there."""
    depth: Float[Array, "*n"]
    """Of the point, in the camera [m]."""


def look_along(
    params: MapParams, camera: Camera, view: View, x: Float[Array, "*n"], y: Float[Array, "*n"], z: Float[Array, "*n"]
) -> Look:
    """Whether points are in free space, observed or occluded. A tile with too few measured pixels marks no free space.

    Args:
        x, y, z: coordinates of points in the world [m].
    """
    R, o = camera.rotation, camera.position
    offset = (x - o[0], y - o[1], z - o[2])
    a, b, depth = (sum(R[i, j] * offset[i] for i in range(3)) for j in range(3))
    rows, columns = view.depth.shape
    ahead = depth > params.near
    safe = jnp.where(ahead, depth, 1.0)
    u = jnp.floor((camera.fx * a / safe + camera.cx + 0.5) / view.tile).astype(jnp.int32)
    v = jnp.floor((camera.fy * b / safe + camera.cy + 0.5) / view.tile).astype(jnp.int32)
    inside = ahead & (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
    at = jnp.where(inside, v * columns + u, 0)
    surface = view.depth.reshape(-1)
    beyond = surface[at] - depth
    margin = params.through + params.pixel_noise * depth * depth
    met = inside & (beyond <= margin) & (beyond >= -margin - params.clear_distance)  # aslant, some of it is nearer
    unmet = inside & (beyond < -margin - params.clear_distance) & jnp.any(surface > 0)
    if view.robot is not None:
        unmet = unmet & ~view.robot.reshape(-1)[at]
    return Look(jnp.asarray(inside & (beyond > margin)), jnp.asarray(met), jnp.asarray(unmet), jnp.asarray(depth))
