"""Lumped weights of the points of blocks: one over the sum of the kernel over all points near."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.map.blocks import slots_around, slots_in_turn
from hrcjax.map.layout import EDGE, VOXELS, MapLayout
from hrcjax.map.level import Level
from hrcjax.map.params import MapParams
from hrcjax.typing import Array, Bool, Float, Int

ROUND = 128
"""Blocks of level 0 that are fitted together."""
HALO = 2
"""Voxels around a block whose points count; farther ones are more than 2 spacings away, at 0.7 spacings exp(-4.1)."""


def block_grid(blocks: Level, place: Int[Array, "block 3"]) -> Float[Array, "channel x y z block"]:
    """Points and weights of blocks and of HALO voxels around them, voxel by voxel; weight 0: no point."""
    rows = blocks.rows.at[slots_around(blocks, place)].get(mode="fill", fill_value=0)
    count = place.shape[0]
    grid = rows.reshape(count, 3, 3, 3, 4, EDGE, EDGE, EDGE)
    grid = jnp.transpose(grid, (4, 1, 5, 2, 6, 3, 7, 0)).reshape(4, 3 * EDGE, 3 * EDGE, 3 * EDGE, count)
    cut = slice(EDGE - HALO, 2 * EDGE + HALO)
    return grid[:, cut, cut, cut]


def lumped_weights(
    grid: Float[Array, "channel x y z block"], length_scale: Float[Array, ""], params: MapParams
) -> Float[Array, "block voxel"]:
    """Weights alpha_i = 1 / (s2 + sum_j k_ij) of the points of blocks [1]; 0 where no point is.

    Args:
        grid: of `block_grid`.
        length_scale: of the kernel [m].
    """
    exists = (grid[3] > 0).astype(grid.dtype)
    precision = 0.5 / length_scale**2
    cut = slice(HALO, HALO + EDGE)
    x, y, z = (grid[a, cut, cut, cut] for a in range(3))
    span, size = 2 * HALO + 1, (EDGE, EDGE, EDGE, grid.shape[-1])

    def add(total: Array, step: Array) -> tuple[Array, None]:
        corner = tuple(step)
        other = [jax.lax.dynamic_slice(grid[a], corner, size) for a in range(3)]
        r2 = (x - other[0]) ** 2 + (y - other[1]) ** 2 + (z - other[2]) ** 2
        total = total + jax.lax.dynamic_slice(exists, corner, size) * jnp.exp(jnp.maximum(-precision * r2, -60.0))
        return total, None

    edges = [np.arange(n, dtype=np.int32) for n in (span, span, span, 1)]
    steps = np.stack(np.meshgrid(*edges, indexing="ij"), axis=-1).reshape(-1, 4)
    total, _ = jax.lax.scan(add, jnp.full_like(x, params.noise**2), jnp.asarray(steps))
    weights = jnp.where(exists[cut, cut, cut] > 0, 1.0 / jnp.maximum(total, 1e-6), 0.0)
    return jnp.moveaxis(weights, -1, 0).reshape(-1, VOXELS)


def typical_weight(layout: MapLayout, params: MapParams) -> Float[Array, ""]:
    """Weight of a point of a flat, regular sample: what a new one has until it is fitted [1]."""
    return jnp.asarray(1.0 / (1.0 + 2 * jnp.pi * (layout.scale_of(params.ratio) / layout.spacing) ** 2))


def refit(
    layout: MapLayout, base: Level, stale: Bool[Array, "slot"], turn: Int[Array, ""], params: MapParams
) -> tuple[Level, Bool[Array, "slot"], Int[Array, ""]]:
    """Fits the weights of some stale blocks of level 0, round robin, so that all come to be fitted: rounds of ROUND blocks,
    up to `layout.refitted`; none if nothing is stale.

    Returns:
        the level, which blocks are stale then, and whose turn is next.
    """
    most = -(-layout.refitted // ROUND)
    if most == 0:
        return base, stale, turn

    def wanted(known: tuple[Any, Array, Array, Array]) -> Bool[Array, ""]:
        return (known[3] < most) & jnp.any(known[1])

    def once(known: tuple[Any, Array, Array, Array]) -> tuple[Any, Array, Array, Array]:
        return (*refit_round(layout, *known[:3], params), known[3] + 1)

    base, stale, turn, _ = jax.lax.while_loop(wanted, once, (base, stale, turn, jnp.zeros((), jnp.int32)))
    return base, stale, turn


def refit_round(
    layout: MapLayout, base: Level, stale: Bool[Array, "slot"], turn: Int[Array, ""], params: MapParams
) -> tuple[Level, Bool[Array, "slot"], Int[Array, ""]]:
    """Fits the weights of at most ROUND stale blocks of level 0.

    Args:
        turn: slot to begin at.

    Returns:
        the level, which blocks are stale then, and whose turn is next.
    """
    capacity = stale.shape[0]
    slots = slots_in_turn(stale, min(layout.refitted, ROUND, capacity), turn)
    turn = jnp.where(slots[-1] < capacity, (slots[-1] + 1) % capacity, 0).astype(jnp.int32)
    grid = block_grid(base, base.place.at[slots].get(mode="fill", fill_value=1))
    scale = jnp.asarray(layout.scale_of(params.ratio), grid.dtype)
    rows = base.rows.at[slots, 3].set(lumped_weights(grid, scale, params), mode="drop")
    return dataclasses.replace(base, rows=rows), stale.at[slots].set(False, mode="drop"), turn
