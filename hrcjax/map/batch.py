"""Many queries of a map at once. The search for the blocks near it, much of the time of a lone query, is done
once for a group of neighbours, and the whole map is searched only where a query of the group is far from everything.

`map_distance_and_gradient` is the definition; this is the same to rounding.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from hrcjax.field import FAR
from hrcjax.map.descent import Chosen, descend
from hrcjax.map.direction import is_near, surface_direction, turned_off
from hrcjax.map.layout import MapLayout
from hrcjax.map.level import Level, block_rows, padded_place
from hrcjax.map.query import curvature_corrected, far_range, far_share, read, read_slots, slots_far
from hrcjax.map.search import nearest_blocks, slots_near
from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Bool, Float, Int, Scalar

GROUP = 32
"""Queries of a group; fewer ones are read one by one."""
GROUP_BLOCKS = 64
"""Blocks that a group reads near surfaces."""
GROUP_FAR = Chosen(80, 16)
"""And far from them."""
SPAN = 4
"""Places along each edge of a group, at most; a wider one is read query by query."""
_LEAST_EXPONENT = -60.0  # numbers below the least normal one are slow
TAIL = 14.0
"""Blocks may stay unread if they add less than exp(-TAIL / 2) to the occupancy, relatively; else queries are read one by
one [1]."""

Readings = tuple[Float[Array, "query"], Float[Array, "query 3"]]


def morton_code(cell: Int[Array, "*n 3"]) -> Int[Array, "*n"]:
    """Position of a cell (each number below 1024) along the Z-order curve: near each other on it, near in space."""

    def spread(v: Array) -> Array:
        for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
            v = (v | (v << shift)) & mask
        return v

    x, y, z = (spread(cell[..., a]) for a in range(3))
    return x | (y << 1) | (z << 2)


def _cell_of(layout: MapLayout, x: Float[Array, "query 3"]) -> Int[Array, "query 3"]:
    """Cells for the order of queries: voxels, or larger ones where the box has more than 1024 of these along an edge."""
    edge = max(layout.spacing, max(layout.shape) * layout.edge_of(0) / 1024)
    step = jnp.floor((x - jnp.asarray(layout.lower, x.dtype)) / edge)
    return jnp.clip(step, 0, 1023).astype(jnp.int32)


def _greatest(a: Float[Array, "query column"]) -> Float[Array, "query"]:
    """Greatest of each row: the halves of all rows at once, as far as they are even; one by one it is slow."""
    while a.shape[1] % 2 == 0 and a.shape[1] > 32:
        a = jnp.maximum(a[:, : a.shape[1] // 2], a[:, a.shape[1] // 2 :])
    return jnp.max(a, axis=1)


def group_readings(
    rows: Float[Array, "block 4 voxel"],
    length_scale: Scalar,
    x: Float[Array, "query 3"],
    middle: Float[Array, "3"],
    corrected: bool,
) -> tuple[Readings, Float[Array, ""]]:
    """Distances [m] and gradients [1] of neighbouring queries by one set of points.

    Squared distances are a matrix product, relative to the middle of the queries so that no digits are lost.

    Args:
        middle: a place among points and queries, a constant to derivatives [m].
        corrected: for curvature.

    Returns:
        the readings, and the square of a radius within which every query has a point [m^2].
    """
    scale = jnp.asarray(length_scale, x.dtype)
    precision = 0.5 / scale**2
    weight = rows[:, 3].reshape(-1)
    there = weight > 0
    some = jnp.any(there)
    p = jnp.where(there, jnp.moveaxis(rows[:, :3], 1, 0).reshape(3, -1) - middle[:, None], 0.0)
    logarithm = jnp.where(there, jnp.log(jnp.maximum(weight, 1e-30)) - precision * jnp.sum(p * p, axis=0), -1e9)
    factors = jnp.concatenate([p, logarithm[None]])
    second = jnp.stack([p[i] * p[j] for i in range(3) for j in range(i + 1)]) if corrected else p[:0]
    moments = jnp.concatenate([p, jnp.ones_like(p[:1]), second])

    def sums(x: Float[Array, "query 3"]) -> tuple[Array, Array, Array, Array]:
        own = x - middle
        exponent = jnp.concatenate([(2 * precision) * own, jnp.ones_like(own[:, :1])], axis=1) @ factors
        top = jax.lax.stop_gradient(_greatest(exponent))
        total = jnp.exp(jnp.maximum(exponent - top[:, None], _LEAST_EXPONENT)) @ moments.T
        mass = jnp.where(some, total[:, 3], 1.0)
        log_o = top + jnp.log(mass) - precision * jnp.sum(own * own, axis=1)
        mean = total[:, :3] / mass[:, None]
        return log_o, own - mean, mean, total[:, 4:] / mass[:, None]

    def distances(x: Float[Array, "query 3"]) -> tuple[Array, tuple[Array, Array]]:
        log_o, offset, mean, second = sums(x)

        def one(log_o: Array, offset: Array, mean: Array, second: Array) -> Array:
            entry = {(i, j): second[i * (i + 1) // 2 + j] - mean[i] * mean[j] for i in range(3) for j in range(i + 1)}
            spread = jnp.stack([jnp.stack([entry[max(i, j), min(i, j)] for j in range(3)]) for i in range(3)])
            return curvature_corrected(log_o, offset, spread, some, scale)[0]

        d = jax.vmap(one)(log_o, offset, mean, second)
        return jnp.sum(d), (d, log_o)

    if corrected:
        g, (d, log_o) = jax.grad(distances, has_aux=True)(x)
    else:
        log_o, offset, _, _ = sums(x)
        d, g = jax.vmap(lambda a, b: read(a, b, some, scale))(log_o, offset)
    reach = (jnp.log(jnp.maximum(jnp.sum(weight), 1e-30)) - jnp.min(log_o)) / precision
    return (d, g), jnp.where(some, reach, jnp.inf)


def middle_within(layout: MapLayout, x: Float[Array, "query 3"]) -> Float[Array, "3"]:
    """Middle of the queries as far as they are in the mapped box, of the others' nearest places in it [m]: a query far away
    must not take the digits of those at the border with which it shares a group. A constant to derivatives."""
    lower = jnp.asarray(layout.lower, x.dtype)
    upper = lower + layout.edge_of(0) * jnp.asarray(layout.shape, x.dtype)
    return jax.lax.stop_gradient(jnp.mean(jnp.clip(x, lower, upper), axis=0))


def _near(
    layout: MapLayout, levels: tuple[Level, ...], ratio: Scalar, x: Float[Array, "query 3"], corrected: bool
) -> Readings:
    """Readings of the search near the queries of a group."""
    low, high = jnp.min(x, axis=0), jnp.max(x, axis=0)
    wide = jnp.any(padded_place(layout, 0, high) - padded_place(layout, 0, low) >= SPAN)

    def alone() -> Readings:
        return jax.vmap(lambda x: read_slots(layout, levels, ratio, slots_near(layout, levels, x), x, corrected))(x)

    slots, unread = nearest_blocks(layout, 0, levels[0], low, high, GROUP_BLOCKS, SPAN)
    # what is farther than the search reaches need not be known
    most = (far_range(layout)[1] + 4.0 * layout.scale_of(ratio)) ** 2
    return _by_group(layout, levels, ratio, x, corrected, (slots, unread, ~wide, most), alone)


def _far(layout: MapLayout, levels: tuple[Level, ...], ratio: Scalar, x: Float[Array, "query 3"]) -> Readings:
    """Readings of the search through the whole map for the queries of a group, not corrected for curvature."""
    low, high = jnp.min(x, axis=0), jnp.max(x, axis=0)

    def alone() -> Readings:
        return jax.vmap(lambda x: read_slots(layout, levels, ratio, slots_far(layout, levels, x), x, False))(x)

    slots, unread = descend(layout, levels, low, high, GROUP_FAR)
    return _by_group(layout, levels, ratio, x, False, (slots, unread, jnp.asarray(True), jnp.inf), alone)


def _by_group(
    layout: MapLayout,
    levels: tuple[Level, ...],
    ratio: Scalar,
    x: Float[Array, "query 3"],
    corrected: bool,
    found: tuple[Int[Array, "block"], Float[Array, ""], Bool[Array, ""], Scalar],
    alone: Callable[[], Readings],
) -> Readings:
    """Readings of the queries of a group by the same blocks, if these hold all that matters, else each alone.

    Args:
        found: slots of the blocks; lower bound of the squared gap to all others; whether they may do; the square of the
            distance beyond which nothing matters [m^2].
        alone: readings with blocks of each query's own.
    """
    slots, unread, may, most = found
    scale = jnp.asarray(layout.scale_of(ratio), x.dtype)
    rows = block_rows(levels[0], slots)
    readings, reach = group_readings(rows, scale, x, middle_within(layout, x), corrected)
    needed = jnp.minimum(reach + TAIL * scale**2, most)
    whole = (unread > needed) & may & jnp.all(jnp.isfinite(x))
    return jax.lax.cond(whole, lambda: readings, alone)


def _readings_of(
    layout: MapLayout,
    levels: tuple[Level, ...],
    ratio: Scalar,
    x: Float[Array, "query 3"],
    corrected: bool,
    oriented: bool,
) -> Readings:
    """Readings of the queries of a group. The whole map is searched only if a query of it is far from everything."""

    def each(slots: Int[Array, "query block"], corrected: bool) -> Readings:
        return jax.vmap(lambda x, s: read_slots(layout, levels, ratio, s, x, corrected))(x, slots)

    def found(near: bool) -> Int[Array, "query block"]:
        return jax.vmap(lambda x: (slots_near if near else slots_far)(layout, levels, x))(x)

    few = x.shape[0] < GROUP
    own = found(near=True) if few else None
    d, g = _near(layout, levels, ratio, x, corrected) if own is None else each(own, corrected)
    share, slope = far_share(layout, d)

    def nothing() -> Readings:
        return jnp.full(d.shape, FAR, d.dtype), jnp.zeros_like(g)

    def whole_map() -> Readings:
        return each(found(near=False), False) if few else _far(layout, levels, ratio, x)

    if oriented:
        # only beside surfaces
        scale = layout.scale_of(ratio)

        def normals() -> Float[Array, "query 3"]:
            slots = found(near=True) if own is None else own
            return jax.vmap(lambda x, s: surface_direction(layout, levels, ratio, s, x))(x, slots)

        normal = jax.lax.cond(jnp.any(is_near(d, scale)), normals, lambda: jnp.zeros_like(g))
        g = jax.vmap(lambda g, n, d: turned_off(g, n, d, scale))(g, normal, d)
    far, away = jax.lax.cond(jnp.any(~(share <= 0)), whole_map, nothing)
    mixed = (1 - share)[:, None] * g + share[:, None] * away + (slope * (far - d))[:, None] * g
    return d + share * (far - d), mixed


def map_distances_and_gradients(
    layout: MapLayout,
    levels: tuple[Level, ...],
    ratio: Scalar,
    x: Float[Array, "query 3"],
    corrected: bool = True,
    oriented: bool = True,
) -> Readings:
    """Distances to the mapped surfaces [m] and their gradients [1] at any number of queries.

    Under `vmap` nothing is skipped: call it with all queries instead. No reverse derivatives. NaN at a query that is not
    finite.

    Args:
        ratio: length scale over spacing [1].
        corrected: take off what the curvature of convex surfaces adds to the kernel's inverse (`hrcjax.field.curvature`);
            False: the plain inverse, which reads too far over convex surfaces, but whose gradient has the better
            direction.
        oriented: next to surfaces the gradient is the normal on the side of the sensor (`hrcjax.map.direction`); False: the
            derivative everywhere, which there fades out.

    Raises:
        ValueError: x is of integers.
    """
    require_floating("map_distances_and_gradients", x=x)
    finite = jnp.all(jnp.isfinite(x), axis=1)
    d, g = _readings(layout, levels, ratio, x, corrected, oriented)
    return jnp.where(finite, d, jnp.nan), jnp.where(finite[:, None], g, jnp.nan)


def _readings(
    layout: MapLayout,
    levels: tuple[Level, ...],
    ratio: Scalar,
    x: Float[Array, "query 3"],
    corrected: bool,
    oriented: bool,
) -> Readings:
    """Distances [m] and gradients [1], in groups if there are enough queries for one."""
    count = x.shape[0]
    if count < GROUP:
        return _readings_of(layout, levels, ratio, x, corrected, oriented)
    # groups of neighbours
    order = jnp.argsort(morton_code(_cell_of(layout, x)))
    order = jnp.concatenate([order, jnp.full((-count % GROUP,), order[-1])])
    groups = x[order].reshape(-1, GROUP, 3)
    d, g = jax.lax.map(lambda x: _readings_of(layout, levels, ratio, x, corrected, oriented), groups)
    empty = jnp.zeros((count, 3), x.dtype)
    return empty[:, 0].at[order].set(d.reshape(-1)), empty.at[order].set(g.reshape(-1, 3))
