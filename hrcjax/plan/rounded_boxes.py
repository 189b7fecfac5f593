"""Obstacles as boxes that are grown by a radius, and the surfaces nearest to many points at once.

A sphere is such a box of no extent, an upright capsule one of no width. One formula for all keeps the program small: a
choice between kinds would compute each of them.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp

from hrcjax.geom.segment import FAR
from hrcjax.numerics import computed
from hrcjax.typing import Array, Float, Int

_OFFSET = 16.0
"""Makes all distances positive, so that their bits are ordered as they are [m]."""
_INDEX_BITS = 5


class RoundedBoxes(NamedTuple):
    """Some obstacles; one of negative radius is absent."""

    center: Float[Array, "box 3"]
    """[m]"""
    half: Float[Array, "box 3"]
    """Half extents, before growing [m]."""
    radius: Float[Array, "box"]
    """How far they are grown [m]."""
    rotation: Float[Array, "box 3 3"] | None = None
    """Their axes in the world, as columns; None: those of the world, which takes less time."""


class Nearest(NamedTuple):
    """The obstacles nearest to some points, the nearest first."""

    distance: Float[Array, "count point sample"]
    """Signed distance to the surface; FAR where there are fewer obstacles [m]."""
    normal: list[Float[Array, "count point sample"]]
    """Its gradient: of length 1, from the obstacle to the point [1]."""


def _dot3(a: Sequence[Array] | Array, b: Sequence[Array]) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _local(solids: RoundedBoxes, box: Int[Array, ""] | int, x: list[Array]) -> list[Array]:
    """Points in the axes of a box, from its middle."""
    away = [x[k] - solids.center[box, k] for k in range(3)]
    if solids.rotation is None:
        return away
    R = solids.rotation[box]
    return [_dot3(R[:, k], away) for k in range(3)]


def _signed(local: list[Array], half: list[Array]) -> tuple[Array, list[Array], list[Array]]:
    """Signed distance to a box, and what it is made of: how far the point is beyond each face, that clipped at 0."""
    beyond = [jnp.abs(local[k]) - half[k] for k in range(3)]
    out = [jnp.maximum(e, 0) for e in beyond]
    deepest = jnp.maximum(beyond[0], jnp.maximum(beyond[1], beyond[2]))
    square = out[0] * out[0] + out[1] * out[1] + out[2] * out[2]
    return jnp.sqrt(square) + jnp.minimum(deepest, 0), beyond, out


def surface_distances(solids: RoundedBoxes, x: list[Float[Array, "*points"]]) -> list[Float[Array, "*points"]]:
    """Signed distance of points to every obstacle, FAR where it is absent [m].

    Args:
        x: the three coordinates of the points [m].
    """
    found = []
    for box in range(solids.center.shape[0]):
        distance = _signed(_local(solids, box, x), [solids.half[box, k] for k in range(3)])[0] - solids.radius[box]
        found.append(jnp.where(solids.radius[box] < 0, jnp.asarray(FAR, distance.dtype), distance))
    return found


def least_distance(solids: RoundedBoxes, x: list[Float[Array, "*points"]]) -> Float[Array, "*points"]:
    """Signed distance of points to the nearest obstacle; FAR at most [m]."""
    least = jnp.full_like(x[0], FAR)
    for distance in surface_distances(solids, x):
        least = jnp.minimum(least, distance)
    return least


def nearest_obstacles(solids: RoundedBoxes, x: list[Float[Array, "point sample"]], count: int) -> Nearest:
    """The obstacles nearest to each point, with normals.

    The lowest bits of a distance carry the number of its obstacle, so that one pass finds both; the distance itself is computed
    again for the chosen ones.

    Args:
        x: the three coordinates of the points [m].
        count: how many for each point.

    Raises: ValueError if there are more obstacles than the lowest bits can number, 32.
    """
    boxes = solids.center.shape[0]
    if boxes > 1 << _INDEX_BITS:
        raise ValueError(f"{boxes} obstacles; accepted are at most {1 << _INDEX_BITS}")
    mask = jnp.int32((1 << _INDEX_BITS) - 1)
    keys = []
    for box, distance in enumerate(surface_distances(solids, x)):
        bits = jax.lax.bitcast_convert_type(distance.astype(jnp.float32) + jnp.float32(_OFFSET), jnp.int32)
        keys.append((bits & ~mask) | jnp.int32(box))
    best = [jnp.full(x[0].shape, jnp.iinfo(jnp.int32).max, jnp.int32)] * count
    for key in keys:
        for place in range(count):
            best[place], key = jnp.minimum(best[place], key), jnp.maximum(best[place], key)
    best = computed(jnp.stack(best))
    chosen = jnp.minimum(best & mask, boxes - 1)
    there = best < jnp.iinfo(jnp.int32).max

    def of(values: Float[Array, "box"]) -> Array:
        picked = jnp.zeros(chosen.shape, values.dtype)
        for box in range(boxes):
            picked = jnp.where(chosen == box, values[box], picked)
        return picked

    picked = computed(
        [of(solids.center[:, k]) for k in range(3)] + [of(solids.half[:, k]) for k in range(3)] + [of(solids.radius)]
    )
    center, half, radius = picked[:3], picked[3:6], picked[6]
    away = [x[k] - center[k] for k in range(3)]
    axes = None
    if solids.rotation is not None:
        axes = [[of(solids.rotation[:, m, k]) for k in range(3)] for m in range(3)]
        away = [_dot3([axes[m][k] for m in range(3)], away) for k in range(3)]
    distance, beyond, out = _signed(away, half)
    outside = jnp.maximum(jnp.maximum(beyond[0], beyond[1]), beyond[2]) > 0
    norm = jnp.where(outside, distance, 1)
    first = (beyond[0] >= beyond[1]) & (beyond[0] >= beyond[2])
    second = ~first & (beyond[1] >= beyond[2])
    facing = [first, second, ~first & ~second]
    normal = [
        jnp.where(outside, out[k] / norm, facing[k].astype(norm.dtype))
        * jnp.where(away[k] < 0, -1, 1).astype(norm.dtype)
        for k in range(3)
    ]
    if axes is not None:
        normal = [_dot3(axes[m], normal) for m in range(3)]
    distance = jnp.where(there & (radius >= 0), distance - radius, jnp.asarray(FAR, distance.dtype))
    return Nearest(*computed((distance, normal)))
