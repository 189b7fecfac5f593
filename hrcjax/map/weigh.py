"""Lumped weights of the points of blocks: one over the sum of the kernel over all points about."""

import jax
import jax.numpy as jnp

from hrcjax.map.blocks import slots_around
from hrcjax.map.layout import EDGE, VOXELS, MapLayout
from hrcjax.map.level import Level
from hrcjax.map.params import MapParams
from hrcjax.typing import Array, Bool, Float, Int

HALO = 3
"""Voxels about a block whose points count; farther ones are more than three length scales away."""


def block_grid(blocks: Level, place: Int[Array, "block 3"]) -> Float[Array, "channel x y z block"]:
    """Points and weights of blocks and of HALO voxels about them, voxel by voxel; weight 0: no point."""
    rows = blocks.rows.at[slots_around(blocks, place)].get(mode="fill", fill_value=0)
    count = place.shape[0]
    grid = rows.reshape(count, 3, 3, 3, 4, EDGE, EDGE, EDGE)
    grid = jnp.transpose(grid, (4, 1, 5, 2, 6, 3, 7, 0)).reshape(4, 3 * EDGE, 3 * EDGE, 3 * EDGE, count)
    cut = slice(EDGE - HALO, 2 * EDGE + HALO)
    return grid[:, cut, cut, cut]


def lumped_weights(
    layout: MapLayout, level: int, blocks: Level, place: Int[Array, "block 3"], params: MapParams
) -> Float[Array, "block voxel"]:
    """Weights alpha_i = 1 / (s2 + sum_j k_ij) of the points of blocks [1]; 0 where no point is.

    Args:
        place: padded places of blocks.
    """
    grid = block_grid(blocks, place)
    exists = (grid[3] > 0).astype(grid.dtype)
    precision = 0.5 / layout.scale_of(level, params.ratio) ** 2
    cut = slice(HALO, HALO + EDGE)
    x, y, z = (grid[a, cut, cut, cut] for a in range(3))
    span, size = 2 * HALO + 1, (EDGE, EDGE, EDGE, grid.shape[-1])

    def add(step: Array, total: Array) -> Array:
        corner = (step // (span * span), (step // span) % span, step % span, 0)
        other = [jax.lax.dynamic_slice(grid[a], corner, size) for a in range(3)]
        r2 = (x - other[0]) ** 2 + (y - other[1]) ** 2 + (z - other[2]) ** 2
        return total + jax.lax.dynamic_slice(exists, corner, size) * jnp.exp(jnp.maximum(-precision * r2, -60.0))

    total = jax.lax.fori_loop(0, span**3, add, jnp.full_like(x, params.noise**2))
    weights = jnp.where(exists[cut, cut, cut] > 0, 1.0 / jnp.maximum(total, 1e-6), 0.0)
    return jnp.moveaxis(weights, -1, 0).reshape(-1, VOXELS)


def refit(
    layout: MapLayout, level: int, blocks: Level, stale: Bool[Array, "slot"], turn: Int[Array, ""], params: MapParams
) -> tuple[Level, Bool[Array, "slot"], Int[Array, ""]]:
    """Fits the weights of some stale blocks, in turn, so that all come to be fitted.

    Args:
        turn: slot to begin at.

    Returns:
        the level, which blocks are stale then, and whose turn is next.
    """
    capacity = stale.shape[0]
    most = min(layout.refitted // EDGE ** (2 * level) + EDGE, capacity)
    rolled = jnp.nonzero(jnp.roll(stale, -turn), size=most, fill_value=capacity)[0].astype(jnp.int32)
    again = jnp.where(rolled < capacity, (rolled + turn) % capacity, capacity)
    after = jnp.where(rolled[-1] < capacity, (again[-1] + 1) % capacity, 0).astype(jnp.int32)
    place = blocks.place.at[again].get(mode="fill", fill_value=1)
    weights = lumped_weights(layout, level, blocks, place, params)
    rows = blocks.rows.at[again, 3].set(weights, mode="drop")
    return Level(blocks.slot, blocks.box, blocks.place, rows), stale.at[again].set(False, mode="drop"), after
