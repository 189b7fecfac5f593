"""Lumped weights of the points of blocks: one over the sum of the kernel over all points near."""

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
    grid: Float[Array, "channel x y z block"], length_scale: Float[Array, "block"], params: MapParams
) -> Float[Array, "block voxel"]:
    """Weights alpha_i = 1 / (s2 + sum_j k_ij) of the points of blocks [1]; 0 where no point is.

    Args:
        grid: of `block_grid`.
        length_scale: of each block [m].
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


def next_in_turn(
    layout: MapLayout, level: int, stale: Bool[Array, "slot"], turn: Int[Array, ""]
) -> tuple[Int[Array, "block"], Int[Array, ""]]:
    """Slots of the stale blocks that are fitted now (the capacity: none), and at which slot to continue.

    Args:
        turn: slot to begin at.
    """
    capacity = stale.shape[0]
    most = min(min(layout.refitted, ROUND) // EDGE**level + EDGE, capacity)
    slots = slots_in_turn(stale, most, turn)
    return slots, jnp.where(slots[-1] < capacity, (slots[-1] + 1) % capacity, 0).astype(jnp.int32)


def refit(
    layout: MapLayout,
    levels: tuple[Level, ...],
    stale: tuple[Bool[Array, "_"], ...],
    turn: Int[Array, "level"],
    params: MapParams,
) -> tuple[tuple[Level, ...], tuple[Bool[Array, "_"], ...], Int[Array, "level"]]:
    """Fits the weights of some stale blocks of each level, round robin, so that all come to be fitted: rounds of ROUND blocks,
    up to `layout.refitted`; none if nothing is stale.

    Returns:
        the levels, which blocks are stale then, and whose turn is next.
    """
    most = -(-layout.refitted // ROUND)
    if most == 0:
        return levels, stale, turn

    def wanted(known: tuple[Any, Any, Any, Array]) -> Bool[Array, ""]:
        return (known[3] < most) & jnp.any(jnp.stack([jnp.any(which) for which in known[1]]))

    def once(known: tuple[Any, Any, Any, Array]) -> tuple[Any, Any, Any, Array]:
        return (*refit_round(layout, *known[:3], params), known[3] + 1)

    levels, stale, turn, _ = jax.lax.while_loop(wanted, once, (levels, stale, turn, jnp.zeros((), jnp.int32)))
    return levels, stale, turn


def refit_round(
    layout: MapLayout,
    levels: tuple[Level, ...],
    stale: tuple[Bool[Array, "_"], ...],
    turn: Int[Array, "level"],
    params: MapParams,
) -> tuple[tuple[Level, ...], tuple[Bool[Array, "_"], ...], Int[Array, "level"]]:
    """Fits the weights of some ROUND stale blocks of level 0, and of fewer of the coarser ones.

    Returns:
        the levels, which blocks are stale then, and whose turn is next.
    """
    chosen = [next_in_turn(layout, k, s, turn[k]) for k, s in enumerate(stale)]
    grids = [
        block_grid(level, level.place.at[slots].get(mode="fill", fill_value=1))
        for level, (slots, _) in zip(levels, chosen, strict=True)
    ]
    scales = [
        jnp.full(slots.shape, layout.scale_of(k, params.ratio), grids[0].dtype) for k, (slots, _) in enumerate(chosen)
    ]
    weights = lumped_weights(jnp.concatenate(grids, axis=-1), jnp.concatenate(scales), params)
    fitted, waiting, begin = [], [], 0
    for level, which, (slots, _) in zip(levels, stale, chosen, strict=True):
        own = weights[begin : begin + slots.shape[0]]
        begin += slots.shape[0]
        rows = level.rows.at[slots, 3].set(own, mode="drop")
        fitted.append(Level(level.slot, level.index, level.place, rows))
        waiting.append(which.at[slots].set(False, mode="drop"))
    return tuple(fitted), tuple(waiting), jnp.stack([after for _, after in chosen])
