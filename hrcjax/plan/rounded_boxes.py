"""Obstacles as boxes that are grown by a radius, and the surfaces nearest to many points at once.

A sphere is such a box of no extent, an upright capsule one of no width. One formula for all keeps the program small: a
choice between kinds would compute each of them.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp

from hrcjax.geom.segment import FAR
from hrcjax.numerics import computed
from hrcjax.typing import Array, Float, Int

_OFFSET = 2.0
"""Makes distances positive, so that their bits are ordered as they are; points deeper inside than that count as equally deep [m]."""
_INDEX_BITS = 10
"""Most lowest bits of a distance that carry the number of its obstacle: with all of them the order is that of distances to
0.3 mm at a surface."""
_UNROLLED = 32
"""Up to as many obstacles a program holds the distance to each of them; beyond, it has a loop."""
_State = TypeVar("_State")


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


def surface_distance(
    solids: RoundedBoxes, box: Int[Array, ""] | int, x: list[Float[Array, "*points"]]
) -> Float[Array, "*points"]:
    """Signed distance of points to one obstacle, FAR where it is absent [m].

    Args:
        x: the three coordinates of the points [m].
    """
    distance = _signed(_local(solids, box, x), [solids.half[box, k] for k in range(3)])[0] - solids.radius[box]
    return jnp.where(solids.radius[box] < 0, jnp.asarray(FAR, distance.dtype), distance)


def _over_boxes(count: int, step: Callable[[Int[Array, ""] | int, _State], _State], state: _State) -> _State:
    """What some steps, one for each obstacle, make of a state."""
    if count > _UNROLLED:
        return jax.lax.fori_loop(0, count, step, state)
    for box in range(count):
        state = step(box, state)
    return state


def least_distance(solids: RoundedBoxes, x: list[Float[Array, "*points"]]) -> Float[Array, "*points"]:
    """Signed distance of points to the nearest obstacle; FAR at most [m]."""

    def nearer(box: Int[Array, ""] | int, least: Array) -> Array:
        return jnp.minimum(least, surface_distance(solids, box, x))

    return _over_boxes(solids.center.shape[0], nearer, jnp.full_like(x[0], FAR))


def nearest_obstacles(solids: RoundedBoxes, x: list[Float[Array, "point sample"]], count: int) -> Nearest:
    """The obstacles nearest to each point, with normals.

    The lowest bits of a distance carry the number of its obstacle, so that one pass finds both; the distance itself is computed
    again for the chosen ones.

    Args:
        x: the three coordinates of the points [m].
        count: how many for each point.

    Raises: ValueError if there are more obstacles than the lowest bits can number, 1024.
    """
    boxes = solids.center.shape[0]
    if boxes > 1 << _INDEX_BITS:
        raise ValueError(f"{boxes} obstacles; accepted are at most {1 << _INDEX_BITS}")
    mask = jnp.int32((1 << max(boxes - 1, 1).bit_length()) - 1)
    nothing = jnp.iinfo(jnp.int32).max

    def ranked(box: Int[Array, ""] | int, best: list[Array]) -> list[Array]:
        shifted = jnp.maximum(surface_distance(solids, box, x).astype(jnp.float32) + jnp.float32(_OFFSET), 0)
        key = (jax.lax.bitcast_convert_type(shifted, jnp.int32) & ~mask) | jnp.asarray(box, jnp.int32)
        ordered = []
        for old in best:
            ordered.append(jnp.minimum(old, key))
            key = jnp.maximum(old, key)
        return ordered

    best = _over_boxes(boxes, ranked, [jnp.full(x[0].shape, nothing, jnp.int32)] * count)
    best = computed(jnp.stack(best))
    chosen = jnp.minimum(best & mask, boxes - 1)
    there = best < nothing

    def of(values: Float[Array, "box"]) -> Array:
        if boxes > _UNROLLED:
            return values[chosen]
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
