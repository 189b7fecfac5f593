"""Distance of a point to everything in a map: the finest level that reaches so far, blended into the coarser ones."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.field import FAR
from hrcjax.field.closed_form import read
from hrcjax.field.curvature import curvature_correction, tangential_share
from hrcjax.field.kernel import blended_root
from hrcjax.map.layout import REACH, MapLayout
from hrcjax.map.level import Level, block_rows
from hrcjax.map.search import nearest_blocks
from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Bool, Float, Int, Matrix3, Scalar, Vector3

NEAREST = 16
"""Blocks of a level that a query reads."""
BLEND = ((0.75, 0.97), (0.4, 0.97))
"""Between these shares of its reach the distance of level 0, and of a coarser one, gives way to the next level's [1]."""
_LEAST_EXPONENT = -60.0
_FAR_SQUARED = 1e6


def _kernels(
    rows: Float[Array, "block 4 voxel"], length_scale: Float[Array, ""], x: Vector3
) -> tuple[list[Array], Array, Array, Array]:
    """Offsets from the points to x [m], their shares in the occupancy, its logarithm, and whether there is any."""
    there = rows[:, 3] > 0
    offsets = [x[a] - rows[:, a] for a in range(3)]
    r2 = offsets[0] ** 2 + offsets[1] ** 2 + offsets[2] ** 2
    some = jnp.max(rows[:, 3]) > 0  # not by the distance: a query that is not a number must not read as free space
    nearest = jax.lax.stop_gradient(jnp.where(some, jnp.min(jnp.where(there, r2, jnp.inf)), 0.0))
    r2 = jnp.where(there, r2, nearest + _FAR_SQUARED)
    precision = 0.5 / length_scale**2
    k = rows[:, 3] * jnp.exp(jnp.maximum(precision * (nearest - r2), _LEAST_EXPONENT))
    total = jnp.where(some, jnp.sum(k), 1.0)
    return offsets, k / total, jnp.log(total) - precision * nearest, some


def rows_distance_and_gradient(
    rows: Float[Array, "block 4 voxel"], length_scale: Scalar, x: Vector3
) -> tuple[Float[Array, ""], Vector3]:
    """`hrcjax.field.distance_and_gradient` of the points of some blocks, channel by channel [m], [1]."""
    scale = jnp.asarray(length_scale, x.dtype)
    offsets, share, log_o, some = _kernels(rows, scale, x)
    return read(log_o, jnp.stack([jnp.sum(share * d) for d in offsets]), some, scale)


class BlockReading(NamedTuple):
    """What the points of some blocks say at a query."""

    distance: Float[Array, ""]
    """Without what the curvature of the surface adds to it; FAR if there are no points [m]."""
    flatness: Float[Array, ""]
    """Product of the tangential spreads over l^4: 1 on flat surfaces, near 0 at sharp edges, above 1 in hollows, not below
    0 [1]."""
    weights: Float[Array, "block voxel"]
    """Shares of the points in the occupancy [1]."""


def curvature_corrected(
    log_o: Float[Array, ""], offset: Vector3, spread: Matrix3, some: Bool[Array, ""], scale: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Distance corrected for curvature [m], and `BlockReading.flatness` [1]; see `hrcjax.field.curvature`.

    Args:
        log_o: logarithm of the occupancy [1].
        offset: from the mean of the points under their shares to the query [m].
        spread: covariance of the points under their shares [m^2].
        some: whether there are points.
        scale: length scale [m].
    """
    flatness = tangential_share(spread, offset, scale)
    v = -2.0 * log_o + curvature_correction(flatness, offset, scale)
    return jnp.where(some, scale * blended_root(v), FAR), jnp.maximum(flatness, 0.0)


def read_blocks(rows: Float[Array, "block 4 voxel"], length_scale: Scalar, x: Vector3) -> BlockReading:
    """The distance of the points of some blocks, corrected for curvature; see `hrcjax.field.curvature`."""
    scale = jnp.asarray(length_scale, x.dtype)
    d, share, log_o, some = _kernels(rows, scale, x)
    c = [jnp.sum(share * e) for e in d]
    second = [[jnp.sum(share * d[i] * d[j]) - c[i] * c[j] for j in range(i + 1)] for i in range(3)]
    spread = jnp.stack([jnp.stack([second[max(i, j)][min(i, j)] for j in range(3)]) for i in range(3)])
    distance, flatness = curvature_corrected(log_o, jnp.stack(c), spread, some, scale)
    return BlockReading(distance, flatness, share)


def level_range(layout: MapLayout, level: int) -> tuple[float, float]:
    """Between these distances a level gives way to the next one [m]."""
    low, high = (part * REACH * layout.edge_of(level) for part in BLEND[min(level, 1)])
    return low, high


def level_share(layout: MapLayout, level: int, d: Float[Array, "*n"]) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Share of the coarser levels at the distance d that a level reads [1], and its derivative [1/m]."""
    if level == layout.levels - 1:
        return jnp.zeros_like(d), jnp.zeros_like(d)
    low, high = level_range(layout, level)
    width = high - low
    t = jnp.clip((d - low) / width, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / width


def slots_near(layout: MapLayout, level: int, blocks: Level, x: Vector3) -> Int[Array, "block"]:
    """Slots of a level's blocks near x: the nearest ones, of the coarsest level all; the capacity: none."""
    if level == layout.levels - 1:  # the coarsest is read whole: it answers wherever x is
        return jnp.arange(blocks.place.shape[0], dtype=jnp.int32)
    x = jax.lax.stop_gradient(x)
    return nearest_blocks(layout, level, blocks, x, x, min(NEAREST, blocks.place.shape[0]))[0]


def rows_near(layout: MapLayout, level: int, blocks: Level, x: Vector3) -> Float[Array, "block 4 voxel"]:
    """The points that a level has near x; see `slots_near`."""
    if level == layout.levels - 1:
        return blocks.rows
    return block_rows(blocks, slots_near(layout, level, blocks, x))


def read_level(
    layout: MapLayout, level: int, blocks: Level, ratio: Scalar, x: Vector3, corrected: bool
) -> tuple[Float[Array, ""], Vector3]:
    """Distance [m] and gradient [1] that one level reads.

    Args:
        corrected: for curvature.
    """
    rows, scale = rows_near(layout, level, blocks, x), layout.scale_of(level, ratio)
    if corrected:
        return jax.value_and_grad(lambda x: read_blocks(rows, scale, x).distance)(x)
    return rows_distance_and_gradient(rows, scale, x)


def map_distance_and_gradient(
    layout: MapLayout, levels: tuple[Level, ...], ratio: Scalar, x: Vector3, corrected: bool = True
) -> tuple[Float[Array, ""], Vector3]:
    """Distance to the mapped surfaces [m] and its gradient [1]; FAR and 0 if the map has no points.

    Value and derivative of `map_distance`, in one pass.

    Args:
        ratio: length scale over spacing [1].
        corrected: take off what the curvature of convex surfaces adds to the kernel's inverse (`hrcjax.field.curvature`);
            False: the plain inverse, which reads too far over convex surfaces, but whose gradient has the better
            direction.

    Raises:
        ValueError: x is of integers.
    """
    require_floating("map_distance_and_gradient", x=x)
    d, g = jnp.asarray(FAR, x.dtype), jnp.zeros_like(x)
    for level in reversed(range(layout.levels)):
        near, towards = read_level(layout, level, levels[level], ratio, x, corrected)
        share, slope = level_share(layout, level, near)
        g = (1 - share) * towards + share * g + slope * (d - near) * towards
        d = near + share * (d - near)
    return d, g


def map_distance(
    layout: MapLayout, levels: tuple[Level, ...], ratio: Scalar, x: Vector3, corrected: bool = True
) -> Float[Array, ""]:
    """Distance to the mapped surfaces [m]; FAR if the map has no points.

    Where coarse levels answer it reads too far: by up to 5 cm at 0.3 to 0.7 m; beyond 1 m by up to 27 cm, over a small
    thing that stands on a large one, measured at the default spacing. `distance_bound` covers that.

    Args:
        ratio: length scale over spacing [1].
        corrected: take off what the curvature of convex surfaces adds to the kernel's inverse (`hrcjax.field.curvature`);
            False: the plain inverse, which reads too far over convex surfaces, but whose gradient has the better
            direction.

    Raises:
        ValueError: x is of integers.
    """
    require_floating("map_distance", x=x)
    d = jnp.asarray(FAR, x.dtype)
    for level in reversed(range(layout.levels)):
        rows, scale = rows_near(layout, level, levels[level], x), layout.scale_of(level, ratio)
        near = read_blocks(rows, scale, x).distance if corrected else rows_distance_and_gradient(rows, scale, x)[0]
        share, _ = level_share(layout, level, near)
        d = near + share * (d - near)
    return d
