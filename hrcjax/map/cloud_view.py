"""A cloud of points as a view: what a pinhole camera in its sensor would have measured.

A sensor that sees all around is six such cameras, one for each face of a cube; each is fused by itself.
"""

import math

import jax.numpy as jnp
import numpy as np

from hrcjax.map.view import TILE, View
from hrcjax.numerics import require_floating
from hrcjax.sense import Camera
from hrcjax.typing import Array, Bool, Float, Matrix3, Scalar, Vector3

BRIM = 1.1
"""Half the image over the distance of its plane [1]: 1 is a face of a cube; the rest is shared with the next face, as
tiles at the border mark no free space."""

FACES = np.array(
    [
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    ],
    float,
)
"""The sensor's axes from those of a camera that looks along its z, -z, x, -x, y and -y."""


def tiles_along(capacity: int) -> int:
    """Tiles along the edge of a cloud's image: some eight places of the cloud a tile, 16 to 128 tiles."""
    return 2 ** min(max(round(math.log2(max(capacity, 1) / 8) / 2), 4), 7)


def cloud_camera(rotation: Matrix3, position: Vector3, tiles: int) -> Camera:
    """A camera that sees a face of a cube and a margin around it.

    Args:
        rotation: world from camera.
        position: of the pinhole [m].
        tiles: along each edge of its image.
    """
    edge = TILE * tiles
    focal, middle = (jnp.asarray(v, position.dtype) for v in (edge / 2 / BRIM, edge / 2 - 0.5))
    return Camera(rotation, position, focal, focal, middle, middle, edge, edge)


def _pooled(image: Float[Array, "row column"]) -> Float[Array, "row column"]:
    """The least of every cell and its eight neighbours."""
    for axis in (0, 1):
        ends = [(1, 1) if a == axis else (0, 0) for a in (0, 1)]
        n = image.shape[axis]
        padded = jnp.pad(image, ends, constant_values=jnp.inf)
        parts = [jnp.take(padded, jnp.arange(k, k + n), axis=axis) for k in range(3)]
        image = jnp.minimum(jnp.minimum(parts[0], parts[1]), parts[2])
    return image


def view_from_cloud(
    camera: Camera, cloud: Float[Array, "point 3"], mask: Bool[Array, "point"], noise: Scalar, gap: Scalar = 0.05
) -> View:
    """Every point of a cloud in the camera's image as a tile of its own, and how far its rays are free.

    A point occludes what lies behind it within `gap`, so that there are no free rays between the points of a surface. A
    tile without a point has no ray.

    Args:
        camera: its image is in whole tiles.
        cloud: in the camera's axes [m].
        mask: which points exist.
        noise: standard deviation of a point along its ray over the square of its distance [1/m].
        gap: the points of one surface are nearer to each other than this [m].
    """
    require_floating("view_from_cloud", cloud=cloud)
    rows, columns = camera.height // TILE, camera.width // TILE
    x, y, z = (cloud[:, a] for a in range(3))
    there = mask & (z > 0)
    safe = jnp.where(there, z, 1.0)
    u = jnp.floor((camera.fx * x / safe + camera.cx + 0.5) / TILE)
    v = jnp.floor((camera.fy * y / safe + camera.cy + 0.5) / TILE)
    there = there & (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
    column, row = (jnp.where(there, w, 0.0).astype(jnp.int32) for w in (u, v))

    def nearest(which: Bool[Array, "point"], width: int) -> Float[Array, "row column"]:
        """Least depth in squares of `width` tiles; infinity: no point."""
        shape = (-(-rows // width), -(-columns // width))
        at = jnp.where(which, (row // width) * shape[1] + column // width, shape[0] * shape[1])
        image = jnp.full((shape[0] * shape[1],), jnp.inf, z.dtype).at[at].min(z, mode="drop")
        return image.reshape(shape)

    seen = nearest(there, 1)
    least = seen
    reach = jnp.maximum(camera.fx, camera.fy) / TILE * jnp.asarray(gap, z.dtype) / safe  # of the gap, in tiles
    last = math.ceil(math.log2(max(rows, columns, 2)))
    for k in range(1, last + 1):
        # squares of 2^k tiles, and the eight about each, cover the gap; one tile about does the reader of a view
        wide = there & (reach > 2 ** (k - 1)) & ((reach <= 2**k) | (k == last))
        hidden = _pooled(nearest(wide, 2**k))
        hidden = jnp.repeat(jnp.repeat(hidden, 2**k, axis=0), 2**k, axis=1)[:rows, :columns]
        least = jnp.minimum(least, hidden)
    R, o = camera.rotation, camera.position
    points = jnp.stack([o[a] + R[a, 0] * x + R[a, 1] * y + R[a, 2] * z for a in range(3)], axis=-1)
    deviation = noise * (x * x + y * y + z * z)
    return View(
        points=jnp.where(there[:, None], points, 0.0),
        mask=there,
        variance=jnp.where(there, deviation * deviation, 0.0),
        depth=jnp.where(jnp.isfinite(seen), least, 0.0),
    )
