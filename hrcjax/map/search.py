"""The blocks of a level that are nearest to a query, or to a box of queries."""

import jax
import jax.numpy as jnp

from hrcjax.field import GPField
from hrcjax.map.index import OCTET, children, squared_gaps
from hrcjax.map.layout import REACH, MapLayout
from hrcjax.map.level import Level, block_rows, padded_place
from hrcjax.typing import Array, Float, Int, Scalar, Vector3


def nearest_blocks(
    layout: MapLayout, level: int, blocks: Level, low: Vector3, high: Vector3, count: int, span: int = 1
) -> tuple[Int[Array, "count"], Float[Array, ""]]:
    """Slots of the blocks whose bounding boxes are nearest to a box of queries; the capacity: none.

    The blocks of the nearest three quarters of `count` octets are compared: an octet of a surface holds some four. Of a
    surface all blocks within some five length scales of the nearest point matter; `count` must hold these.

    Args:
        low, high: corners of the box; of a single query, the same [m].
        span: places along each edge of the box.

    Returns:
        the slots, and a lower bound of the squared gap to all other blocks; infinity: there are no others [m^2].
    """
    edge, index = layout.edge_of(level), blocks.index
    shape = index.hull.shape
    origin = [jnp.asarray(layout.lower[a] - REACH * edge, low.dtype) for a in range(3)]

    # octets: the window covers the places from REACH before the box to REACH behind it
    size = [min((2 * REACH + span) // 2 + 1, n) for n in shape]
    begin = (padded_place(layout, level, low) - REACH) // 2
    start = [jnp.minimum(begin[a], shape[a] - size[a]) for a in range(3)]
    window = jax.lax.dynamic_slice(index.hull, start, size)
    axes = jnp.meshgrid(*(jnp.arange(n, dtype=jnp.int32) for n in size), indexing="ij", sparse=True)
    corner = tuple(
        o + (s + step).astype(low.dtype) * (2 * edge) for o, s, step in zip(origin, start, axes, strict=True)
    )
    gap = squared_gaps(window, corner, 2 * edge, low, high).reshape(-1)
    # only whole results of top_k are used: of a part, XLA sorts everything
    octet_gap, best = jax.lax.top_k(-gap, min(-(-3 * count // 4), gap.shape[0]))
    within = (best // (size[1] * size[2]), best // size[2] % size[1], best % size[2])
    at = tuple(s + k for s, k in zip(start, within, strict=True))

    # their blocks
    octets = index.octets.reshape(-1, 2 * OCTET)[(at[0] * shape[1] + at[1]) * shape[2] + at[2]]
    step = children()
    corner = tuple(origin[a] + (2 * at[a][:, None] + step[:, a]).astype(low.dtype) * edge for a in range(3))
    gap = squared_gaps(octets[:, :OCTET], corner, edge, low, high).reshape(-1)
    near, best = jax.lax.top_k(-gap, min(count, gap.shape[0]))
    slots = jnp.where(near != -jnp.inf, octets[:, OCTET:].reshape(-1)[best], blocks.place.shape[0])
    return slots, jnp.minimum(jnp.max(-near), jnp.max(-octet_gap))


NEAREST = 16
"""Blocks that a query near surfaces reads."""


def slots_near(layout: MapLayout, levels: tuple[Level, ...], x: Vector3) -> Int[Array, "block"]:
    """Slots of the blocks of level 0 nearest to x, as far as within reach; the capacity: none."""
    x = jax.lax.stop_gradient(x)
    return nearest_blocks(layout, 0, levels[0], x, x, min(NEAREST, layout.capacity))[0]


def local_field(layout: MapLayout, level: int, blocks: Level, x: Vector3, ratio: Scalar, count: int) -> GPField:
    """The Gaussian process near x: the points of the nearest blocks; which they are is a constant to derivatives. Its
    distance is not corrected for curvature.

    Args:
        ratio: length scale over spacing [1].
        count: number of blocks.
    """
    at = jax.lax.stop_gradient(x)
    rows = block_rows(blocks, nearest_blocks(layout, level, blocks, at, at, count)[0])
    points = jnp.moveaxis(rows[:, :3], 1, 2).reshape(-1, 3)
    weights = rows[:, 3].reshape(-1)
    scale = jnp.asarray(layout.scale_of(ratio), x.dtype)
    return GPField(points, weights, weights > 0, scale, signed=False)
