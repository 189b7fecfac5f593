"""Distance of a point to everything in a map: by the points of level 0, wherever it is.

Near surfaces the blocks that matter are found in a window about the query, farther away through the coarser levels
(`hrcjax.map.descent`). Both read the same points, and so nearly the same distance where one gives way to the other.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.field import FAR
from hrcjax.field.curvature import corrected_square, curvature_correction, tangential_share
from hrcjax.field.kernel import raised_root, raised_root_slope
from hrcjax.map.descent import descend
from hrcjax.map.direction import surface_direction, turned_off
from hrcjax.map.layout import REACH, MapLayout
from hrcjax.map.level import Level, block_rows
from hrcjax.map.moments import point_shares, total
from hrcjax.map.search import slots_near
from hrcjax.numerics import require_floating
from hrcjax.typing import Array, Bool, Float, Int, Matrix3, Scalar, Vector3

BLEND = (0.75, 0.97)
"""Between these shares of the reach of the search near a query it gives way to the search through the whole map [1]."""


def read(
    log_o: Float[Array, ""], offset: Vector3, some: Bool[Array, ""], length_scale: Float[Array, ""]
) -> tuple[Float[Array, ""], Vector3]:
    """Distance [m] and gradient [1], not corrected for curvature.

    Args:
        log_o: logarithm of the occupancy [1].
        offset: from the mean of the points under their shares to the query [m].
        some: whether there are points.
        length_scale: of the kernel [m].
    """
    v = -2.0 * log_o  # (d / l)^2
    g = (2.0 * raised_root_slope(v) / length_scale) * offset  # far from a surface (x - c) / d
    return jnp.where(some, length_scale * raised_root(v), FAR), jnp.where(some, g, 0.0)


def rows_distance_and_gradient(
    rows: Float[Array, "block 4 voxel"], length_scale: Scalar, x: Vector3
) -> tuple[Float[Array, ""], Vector3]:
    """`hrcjax.field.distance_and_gradient` of the points of some blocks, channel by channel [m], [1]."""
    scale = jnp.asarray(length_scale, x.dtype)
    offsets, share, log_o, some = point_shares(rows, scale, x)
    return read(log_o, jnp.stack([total(share * d) for d in offsets]), some, scale)


class BlockReading(NamedTuple):
    """What the points of some blocks say at a query."""

    distance: Float[Array, ""]
    """Without what the curvature of the surface adds to it; FAR if there are no points [m]."""
    plain: Float[Array, ""]
    """With it [m]."""
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
    v = corrected_square(-2.0 * log_o, curvature_correction(flatness, offset, scale))
    return jnp.where(some, scale * raised_root(v), FAR), jnp.maximum(flatness, 0.0)


def read_blocks(rows: Float[Array, "block 4 voxel"], length_scale: Scalar, x: Vector3) -> BlockReading:
    """The distance of the points of some blocks, corrected for curvature; see `hrcjax.field.curvature`."""
    scale = jnp.asarray(length_scale, x.dtype)
    d, share, log_o, some = point_shares(rows, scale, x)
    c = [total(share * e) for e in d]
    second = [[total(share * d[i] * d[j]) - c[i] * c[j] for j in range(i + 1)] for i in range(3)]
    spread = jnp.stack([jnp.stack([second[max(i, j)][min(i, j)] for j in range(3)]) for i in range(3)])
    distance, flatness = curvature_corrected(log_o, jnp.stack(c), spread, some, scale)
    plain = jnp.where(some, scale * raised_root(-2.0 * log_o), FAR)
    return BlockReading(distance, plain, flatness, share)


def corrected_distance_and_gradient(
    rows: Float[Array, "block 4 voxel"], length_scale: Scalar, x: Vector3
) -> tuple[Float[Array, ""], Vector3]:
    """Distance of the points of some blocks, corrected for curvature [m], and its gradient [1].

    In closed form, as reverse derivatives of the sums take several times as long: with offsets c_i from the mean and shares
    w_i, the derivative of a share is -w_i c_i / l^2, so that of the mean offset is I - S / l^2, and that of the spread S the
    third moment over -l^2.
    """
    scale = jnp.asarray(length_scale, x.dtype)
    offsets, share, log_o, some = point_shares(rows, scale, x)
    mean = jnp.stack([total(share * o) for o in offsets])
    c = [o - m for o, m in zip(offsets, mean, strict=True)]
    entry = {(i, j): total(share * c[i] * c[j]) for i in range(3) for j in range(i + 1)}
    spread = jnp.stack([jnp.stack([entry[max(i, j), min(i, j)] for j in range(3)]) for i in range(3)])

    def distance(log_o: Float[Array, ""], mean: Vector3, spread: Matrix3) -> Float[Array, ""]:
        return curvature_corrected(log_o, mean, spread, some, scale)[0]

    d, (by_log, by_mean, by_spread) = jax.value_and_grad(distance, argnums=(0, 1, 2))(log_o, mean, spread)
    form = sum(
        (by_spread[i, j] + (by_spread[j, i] if i != j else 0.0)) * c[i] * c[j] for i in range(3) for j in range(i + 1)
    )
    third = jnp.stack([total(share * form * o) for o in c])
    return d, by_mean - (by_log * mean + spread @ by_mean + third) / scale**2


def far_range(layout: MapLayout) -> tuple[float, float]:
    """Between these distances the search near a query gives way to that through the whole map [m]."""
    low, high = (part * REACH * layout.edge_of(0) for part in BLEND)
    return low, high


def far_share(layout: MapLayout, d: Float[Array, "*n"]) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Share of the search through the whole map where that near the query reads the distance d [1], and its derivative
    [1/m]."""
    low, high = far_range(layout)
    width = high - low
    t = jnp.clip((d - low) / width, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / width


def slots_far(layout: MapLayout, levels: tuple[Level, ...], x: Vector3) -> Int[Array, "block"]:
    """Slots of the blocks of level 0 nearest to x, wherever it is; the capacity: none."""
    x = jax.lax.stop_gradient(x)
    return descend(layout, levels, x, x)[0]


def read_slots(
    layout: MapLayout, levels: tuple[Level, ...], ratio: Scalar, slots: Int[Array, "block"], x: Vector3, corrected: bool
) -> tuple[Float[Array, ""], Vector3]:
    """Distance [m] and gradient [1] by the points of some blocks of level 0.

    Args:
        corrected: for curvature.
    """
    rows, scale = block_rows(levels[0], slots), layout.scale_of(ratio)
    if corrected:
        return corrected_distance_and_gradient(rows, scale, x)
    return rows_distance_and_gradient(rows, scale, x)


def no_number(x: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
    """0 with derivative 0; NaN with derivative NaN where x is not finite, for what is nowhere has no distance."""
    return jnp.sum(x * jnp.where(jnp.all(jnp.isfinite(x), axis=-1, keepdims=True), 0.0, jnp.nan), axis=-1)


def map_distance_and_gradient(
    layout: MapLayout,
    levels: tuple[Level, ...],
    ratio: Scalar,
    x: Vector3,
    corrected: bool = True,
    oriented: bool = True,
) -> tuple[Float[Array, ""], Vector3]:
    """Distance to the mapped surfaces [m] and its gradient [1]; FAR and 0 if the map has no points, NaN where x is not
    finite.

    Value and derivative of `map_distance`, in one pass; next to surfaces, within a length scale, a unit normal instead of the
    derivative (`hrcjax.map.direction`).

    Args:
        ratio: length scale over spacing [1].
        corrected: take off what the curvature of convex surfaces adds to the kernel's inverse (`hrcjax.field.curvature`);
            False: the plain inverse, which reads too far over convex surfaces, but whose gradient has the better
            direction.
        oriented: next to surfaces the gradient is the normal on the side of the sensor; False: the derivative everywhere,
            which there fades out.

    Raises:
        ValueError: x is of integers.
    """
    require_floating("map_distance_and_gradient", x=x)
    slots = slots_near(layout, levels, x)
    near, towards = read_slots(layout, levels, ratio, slots, x, corrected)
    far, away = read_slots(layout, levels, ratio, slots_far(layout, levels, x), x, False)
    share, slope = far_share(layout, near)
    g = (1 - share) * towards + share * away + slope * (far - near) * towards
    if oriented:
        g = turned_off(g, surface_direction(layout, levels, ratio, slots, x), near, layout.scale_of(ratio))
    return near + share * (far - near) + no_number(x), g + no_number(x)


def map_distance(
    layout: MapLayout, levels: tuple[Level, ...], ratio: Scalar, x: Vector3, corrected: bool = True
) -> Float[Array, ""]:
    """Distance to the mapped surfaces [m]; FAR if the map has no points, NaN where x is not finite.

    The points of level 0 answer at any distance. Far away nothing is corrected: there it would be less than a millimetre or two.

    Args:
        ratio: length scale over spacing [1].
        corrected: take off what the curvature of convex surfaces adds to the kernel's inverse (`hrcjax.field.curvature`);
            False: the plain inverse, which reads too far over convex surfaces, but whose gradient has the better
            direction.

    Raises:
        ValueError: x is of integers.
    """
    require_floating("map_distance", x=x)
    scale = layout.scale_of(ratio)

    rows = block_rows(levels[0], slots_near(layout, levels, x))
    near = read_blocks(rows, scale, x).distance if corrected else rows_distance_and_gradient(rows, scale, x)[0]
    rows = block_rows(levels[0], slots_far(layout, levels, x))
    far, _ = rows_distance_and_gradient(rows, scale, x)
    share, _ = far_share(layout, near)
    return near + share * (far - near) + no_number(x)
