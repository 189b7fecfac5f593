"""Voxel-grid downsampling of a cloud to one mean point per voxel, with fixed capacity."""

import jax
import jax.numpy as jnp

from hrcjax.geom.cloud import Cloud
from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Bool, Scalar, Vector3

_BITS = 10
_HALF = 1 << (_BITS - 1)
_NONE = (1 << 31) - 1


def thin(
    cloud: Cloud, voxel: Scalar, capacity: int, centre: Vector3, least: Scalar = 1.0
) -> tuple[Cloud, Bool[Array, ""]]:
    """The mean point of every voxel with at least `least` points, nearest to `centre` first.

    Args:
        cloud: any cloud.
        voxel: edge of the voxels; the grid starts at the world's origin [m].
        capacity: of the downsampled cloud.
        centre: the nearest points to it are kept, such as the robot's position [m].
        least: least points of a voxel, which is noise otherwise [1].

    Returns:
        The downsampled cloud, and whether points were dropped: those beyond the capacity, or more than 511 voxels from the
        centre.

    Raises:
        ValueError: a capacity under 1.
    """
    require_floating("thin", points=cloud.points)
    if capacity < 1:
        raise ValueError(f"capacity {capacity} must be at least 1")
    points, count = cloud.points, cloud.points.shape[0]
    middle = jnp.floor(centre / voxel)
    cell = jnp.floor(points / voxel) - middle
    within = cloud.mask & jnp.all(jnp.abs(cell) < _HALF, axis=-1)
    index = jnp.where(within[:, None], cell, 0).astype(jnp.int32) + _HALF
    key = (index[:, 0] << (2 * _BITS)) | (index[:, 1] << _BITS) | index[:, 2]
    key = jnp.where(within, key, _NONE)
    key, order = jax.lax.sort((key, jnp.arange(count, dtype=jnp.int32)), num_keys=1, is_stable=False)
    sorted_points = points[order]
    new = jnp.concatenate([jnp.ones((1,), bool), key[1:] != key[:-1]])
    group = jnp.cumsum(new.astype(jnp.int32)) - 1
    weight = (key != _NONE).astype(points.dtype)
    # sums relative to the centre, for float32 precision
    rows = jnp.concatenate([weight[:, None] * (sorted_points - centre), weight[:, None]], axis=-1)
    sums = jax.ops.segment_sum(rows, group, num_segments=count, indices_are_sorted=True)
    size = sums[:, 3]
    full = (size > 0) & (size >= least)
    offset = sums[:, :3] / jnp.maximum(size, 1)[:, None]
    square = jnp.where(full, jnp.sum(offset * offset, axis=-1), jnp.inf)
    places = min(capacity, count)
    negative, best = jax.lax.top_k(-square, places)
    mask = jnp.isfinite(negative)
    kept = jnp.where(mask[:, None], centre + offset[best], centre)
    spare = capacity - places
    thinned = Cloud(
        points=jnp.concatenate([kept, jnp.broadcast_to(centre, (spare, 3))]),
        mask=jnp.concatenate([mask, jnp.zeros((spare,), bool)]),
    )
    overflow = (jnp.sum(full) > capacity) | jnp.any(cloud.mask & ~within)
    return thinned, overflow
