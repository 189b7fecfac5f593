"""Spatial index of a level: bounding boxes of its blocks, by which a query finds the nearest ones.

Blocks are kept by octets, 2 x 2 x 2 places side by side in memory, and each octet has a hull around the boxes of its
blocks: a query looks through hulls first, then through the blocks of the nearest octets.
"""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.map.layout import EDGE, REACH, VOXELS
from hrcjax.typing import Array, Float, Int

GRAIN = 32
"""Parts of an edge in which a box within it is kept."""
NO_BOX = -1
"""Box where no points are."""
OCTET = 8
"""Places of an octet."""


class BlockIndex(eqx.Module):
    """Bounding boxes of the points of blocks and of octets.

    A box is one number: least x, y, z and greatest ones, five bits each, in GRAIN-ths of the edge of its block, or of its
    octet; NO_BOX: no points. One number, as reading them is most of what a query costs.
    """

    octets: Int[Array, "x y z 16"]
    """Boxes of the eight blocks of an octet, then their slots (the capacity: none), which are met together."""
    hull: Int[Array, "x y z"]
    """Bounding box of an octet's blocks."""


def empty_index(shape: tuple[int, int, int], capacity: int) -> BlockIndex:
    """An index without points.

    Args:
        shape: places along x, y and z.
        capacity: number of slots.
    """
    grid = tuple(-(-n // 2) for n in shape)
    nothing = jnp.asarray([NO_BOX] * OCTET + [capacity] * OCTET, jnp.int32)
    return BlockIndex(jnp.broadcast_to(nothing, (*grid, 2 * OCTET)), jnp.full(grid, NO_BOX, jnp.int32))


def pack_box(low: Int[Array, "*n 3"], high: Int[Array, "*n 3"]) -> Int[Array, "*n"]:
    """One number for a box from the GRAIN-th `low` to the end of the GRAIN-th `high`, each from 0 to GRAIN - 1."""
    parts = jnp.concatenate([low, high], axis=-1) << jnp.arange(0, 30, 5, dtype=jnp.int32)
    return jnp.sum(parts, axis=-1, dtype=jnp.int32)


def sides(box: Int[Array, "*n"], axis: int) -> tuple[Int[Array, "*n"], Int[Array, "*n"]]:
    """First and last GRAIN-th of boxes along an axis."""
    return (box >> (5 * axis)) & (GRAIN - 1), (box >> (5 * axis + 15)) & (GRAIN - 1)


def children() -> Int[Array, "8 3"]:
    """Steps from the first place of an octet to its eight places."""
    k = jnp.arange(OCTET, dtype=jnp.int32)
    return jnp.stack([k // 4, k // 2 % 2, k % 2], axis=-1)


def hull_of(boxes: Int[Array, "*n 8"]) -> Int[Array, "*n"]:
    """Bounding boxes of octets' blocks."""
    return joined(boxes, children(), 2)


def joined(boxes: Int[Array, "*n m"], steps: Int[Array, "m 3"], times: int) -> Int[Array, "*n"]:
    """Bounding boxes of some boxes each, in parts of an edge that is so many times as long.

    Args:
        steps: to the places of the boxes, from the one with the least coordinates.
    """
    some = boxes != NO_BOX
    low, high = [], []
    for a in range(3):
        first, last = sides(boxes, a)
        low.append(jnp.min(jnp.where(some, first + GRAIN * steps[:, a], times * GRAIN - 1), axis=-1) // times)
        high.append(jnp.max(jnp.where(some, last + GRAIN * steps[:, a], 0), axis=-1) // times)
    packed = pack_box(jnp.stack(low, axis=-1), jnp.stack(high, axis=-1))
    return jnp.where(jnp.any(some, axis=-1), packed, NO_BOX)


def below(index: BlockIndex, place: Int[Array, "block 3"]) -> tuple[Int[Array, "block 64"], Int[Array, "block 64"]]:
    """Boxes and slots of the blocks of a level that are the voxels of blocks of the level above, in the order of these.

    Args:
        index: of the level below.
        place: padded places on the level above.
    """
    half = EDGE // 2  # octets along the edge of a block above: places are padded by a multiple of it
    octet = (EDGE * (place - REACH) + REACH) // 2
    steps = jnp.arange(half, dtype=jnp.int32)
    x, y, z = (octet[:, a, None] + steps for a in range(3))
    grid = index.octets[x[:, :, None, None], y[:, None, :, None], z[:, None, None, :]]
    grid = grid.reshape(-1, half, half, half, 2, 2, 2, 2)  # octet, then box or slot, then place in the octet
    boxes, slots = jnp.transpose(grid, (4, 0, 1, 5, 2, 6, 3, 7)).reshape(2, -1, VOXELS)
    return boxes, slots


def hull_below(index: BlockIndex, place: Int[Array, "block 3"]) -> Int[Array, "block"]:
    """Bounding boxes of all points of level 0 in blocks of a level, from those of the level below; see `below`."""
    voxel = jnp.arange(VOXELS, dtype=jnp.int32)
    steps = jnp.stack([voxel // EDGE**2, voxel // EDGE % EDGE, voxel % EDGE], axis=-1)
    return joined(below(index, place)[0], steps, EDGE)


def with_boxes(
    index: BlockIndex,
    place: Int[Array, "block 3"],
    slots: Int[Array, "block"],
    boxes: Int[Array, "block"],
    capacity: int,
) -> BlockIndex:
    """The index with other boxes of some blocks.

    Args:
        place: padded places of the blocks, different ones.
        slots: of the blocks; the capacity: not a block, nothing is written.
        boxes: NO_BOX: the block holds no points, and is no longer found.
        capacity: number of slots.
    """
    grid = index.hull.shape
    size = grid[0] * grid[1] * grid[2]
    at, within = place // 2, place % 2
    octet = jnp.where(slots < capacity, (at[:, 0] * grid[1] + at[:, 1]) * grid[2] + at[:, 2], size)
    child = (within[:, 0] * 2 + within[:, 1]) * 2 + within[:, 2]
    octets = index.octets.reshape(-1, 2 * OCTET).at[octet, child].set(boxes, mode="drop")
    octets = octets.at[octet, OCTET + child].set(jnp.where(boxes == NO_BOX, capacity, slots), mode="drop")
    hull = hull_of(octets.at[octet, :OCTET].get(mode="fill", fill_value=NO_BOX))
    return BlockIndex(
        octets.reshape(*grid, 2 * OCTET), index.hull.reshape(-1).at[octet].set(hull, mode="drop").reshape(grid)
    )


def boxes_by_place(index: BlockIndex, shape: tuple[int, int, int]) -> tuple[Int[Array, "x y z"], Int[Array, "x y z"]]:
    """Boxes and slots laid out by place.

    Args:
        shape: places along x, y and z.
    """
    x, y, z = index.hull.shape
    grid = index.octets.reshape(x, y, z, 2, 2, 2, 2)
    grid = jnp.transpose(grid, (3, 0, 4, 1, 5, 2, 6)).reshape(2, 2 * x, 2 * y, 2 * z)
    boxes, slots = grid[:, : shape[0], : shape[1], : shape[2]]
    return boxes, slots


def squared_gaps(
    box: Int[Array, "*n"],
    corner: tuple[Float[Array, "*#n"], ...],
    edge: float,
    low: Float[Array, "3"],
    high: Float[Array, "3"],
) -> Float[Array, "*n"]:
    """Squares of the gaps between boxes and a box of queries; infinity where no points are [m^2].

    Args:
        corner: x, y and z of the least corners of the blocks or octets that the boxes are in, to be broadcast [m].
        edge: of these blocks or octets [m].
        low, high: corners of the box of queries [m].
    """
    r2 = jnp.zeros((), low.dtype)
    for a in range(3):
        first, last = sides(box, a)
        under = corner[a] + first.astype(low.dtype) * (edge / GRAIN) - high[a]
        over = low[a] - corner[a] - (last + 1).astype(low.dtype) * (edge / GRAIN)
        gap = jnp.maximum(jnp.maximum(under, over), 0.0)
        r2 = r2 + gap * gap
    return jnp.where(box == NO_BOX, jnp.inf, r2)
