"""The nearest points of a cloud on several surfaces: everybody about a place, and every arm, not only the nearest.

A frame's points are sorted once along a Hilbert curve into groups of neighbours. At a query the nearest point of each group
is known at the price of one more minimum over distances that the field's kernels need anyway; among the groups, those
that lie in another direction than all nearer ones or in front of them are chosen, and only their few points are looked at again.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.ad_checkpoint import checkpoint_name

from hrcjax.field.gp import FAR, GPField
from hrcjax.field.moments import ELSEWHERE
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.hilbert import hilbert_index
from hrcjax.numerics import CHOICE, safe_norm, unit
from hrcjax.typing import Array, Bool, Float, Int, Vector3

MEMBERS = 16
"""Points of a group: patches of some 20 cm of a surface sampled at 5 cm."""
GAPS = (0.15, 0.25, 0.5, float("inf"))
"""Ways between points of one group that are too long [m]."""
CURVE_FROM, CURVE_STEP, CURVE_BITS = -2.56, 0.02, 8
"""Least coordinate [m], resolution [m] and bits an axis of the Hilbert curve; points beyond share its borders."""
OTHER_WAY = 0.5
"""Cosine of the angle over which two directions differ: 60 degrees [1]."""
SAME_WAY = 0.99
"""Cosine of the angle up to which the nearest point stands for the nearest surface: 8 degrees. Between two parts that are equally near the
direction of the kernel is between both [1]."""
IN_FRONT = 0.01
"""The mean of a group is so much in front of a plane: more than noise [m]."""
SLANT = 0.1
"""Slope by which that plane may be off, since the nearest point of a cloud is not that of the surface [1]."""


class Groups(eqx.Module):
    """Groups of a field whose cloud is in the order of `grouped`."""

    centre: Float[Array, "*frame group 3"]
    """Mean of the points of each group [m]."""
    some: Bool[Array, "*frame group"]
    """Whether it has any."""


class Nearest(NamedTuple):
    """The nearest point of one surface."""

    some: Bool[Array, ""]
    """Whether there is any."""
    distance: Float[Array, ""]
    """To it; FAR without [m]."""
    offset: Vector3
    """From it to the query; 0 without [m]."""


def grouped(cloud: Cloud, members: int = MEMBERS) -> Cloud:
    """The same points, neighbours together: point m of group g is at place m * groups + g, so that the minima of all groups
    are minima of vectors. A group ends where the next point along the curve is far, as another person's: at the least of
    the GAPS with which the groups suffice. Places left over hold no point.
    """
    count = -(-cloud.mask.shape[0] // members)
    steps = (jnp.where(cloud.mask[:, None], cloud.points, 0.0) - CURVE_FROM) / CURVE_STEP
    cells = jnp.clip(steps, 0.0, 2.0**CURVE_BITS - 1.0).astype(jnp.int32)
    order = jnp.argsort(jnp.where(cloud.mask, hilbert_index(cells, CURVE_BITS), jnp.iinfo(jnp.int32).max))
    points, mask = cloud.points[order], cloud.mask[order]
    jump = safe_norm(jnp.diff(points, axis=0, prepend=points[:1]))
    number = jnp.arange(mask.shape[0])
    place = jnp.zeros_like(number)
    for gap in sorted(GAPS, reverse=True):
        rank = number - jax.lax.cummax(jnp.where(jump > gap, number, 0))
        group = jnp.cumsum((rank % members == 0) & mask) - 1
        fits = jnp.max(jnp.where(mask, group, 0)) < count
        place = jnp.where(fits, rank % members * count + group, place)
    place = jnp.where(mask, place, members * count)  # nowhere
    empty = jnp.full((members * count, 3), ELSEWHERE, points.dtype)
    there = jnp.zeros(members * count, bool)
    return Cloud(empty.at[place].set(points, mode="drop"), there.at[place].set(True, mode="drop"))


def groups_of(cloud: Cloud, members: int = MEMBERS) -> Groups:
    """The groups of a cloud in the order of `grouped`."""
    mask = cloud.mask.reshape(members, -1)
    points = jnp.where(mask[..., None], cloud.points.reshape(members, -1, 3), 0.0)
    count = jnp.sum(mask, axis=0).astype(points.dtype)
    return Groups(jnp.sum(points, axis=0) / jnp.maximum(count, 1.0)[:, None], jnp.any(mask, axis=0))


def nearest_of_groups(field: GPField, x: Vector3, groups: int) -> Int[Array, "group"]:
    """The nearest point of every group: the bits of its squared distance [m^2], with its place in the cloud as the lowest.

    Numbers of 0 or more are in the order of their bits, so that one minimum finds both. Distances are cut to 13 bits in single
    precision, for 1,024 points: 0.01 % of a squared distance, which decides nothing but who is nearest.
    """
    # in the form of the kernels' distances, so that the compiler computes both at once
    count = jnp.maximum(jnp.sum(field.mask.astype(field.points.dtype)), 1.0)
    origin = jnp.sum(jnp.where(field.mask[:, None], field.points, 0.0), axis=0) / count
    points = jnp.where(field.mask[:, None], field.points - origin, 0.0)
    placed, at = jnp.where(field.mask[:, None], points, ELSEWHERE), x - origin
    dx, dy, dz = placed[:, 0] - at[0], placed[:, 1] - at[1], placed[:, 2] - at[2]
    bits = _bits(jax.lax.stop_gradient(dx * dx + dy * dy + dz * dz))
    place = jnp.arange(field.points.shape[0], dtype=bits.dtype)
    return jnp.min(((bits & ~_places(field)) | place).reshape(-1, groups), axis=0)


def _bits(v: Float[Array, "*point"]) -> Int[Array, "*point"]:
    return jax.lax.bitcast_convert_type(v, jnp.int32 if v.dtype == jnp.float32 else jnp.int64)


def _number(bits: Int[Array, ""], dtype: jnp.dtype) -> Float[Array, ""]:
    """The number of some bits."""
    return jax.lax.bitcast_convert_type(bits, dtype)


def _places(field: GPField) -> int:
    """The bits that the place of a point needs."""
    return (1 << (field.points.shape[0] - 1).bit_length()) - 1


def another(groups: Groups, x: Vector3, away: Vector3, distance: Float[Array, ""]) -> Bool[Array, "group"]:
    """Which groups do not belong to a nearer surface: their direction differs from its direction by more than 60 degrees, or they
    are in front of the plane through its nearest point, as a hand before a trunk. Points of a convex body never are.

    Args:
        x: query [m].
        away: unit vector away from the nearer surface, or 0: then all [1].
        distance: of x to that plane [m].
    """
    way = [x[i] - groups.centre[:, i] for i in range(3)]
    along = way[0] * away[0] + way[1] * away[1] + way[2] * away[2]
    square = way[0] * way[0] + way[1] * way[1] + way[2] * way[2]
    aside = jnp.sqrt(jnp.maximum(square - along * along, 0.0))  # not differentiated
    return (along * jnp.abs(along) <= OTHER_WAY**2 * square) | (along < distance - IN_FRONT - SLANT * aside)


def nearest_others(
    field: GPField, groups: Groups, x: Vector3, away: Vector3, distance: Float[Array, ""], count: int
) -> list[Nearest]:
    """The nearest points of further surfaces: of groups that are `another` than all nearer ones, one after the other.

    A group counts by the place of its mean and the distance of its nearest point, once.

    Args:
        field: with its cloud in the order of `grouped`.
        groups: of that cloud.
        x: query [m].
        away: unit vector away from the nearest surface of all [1].
        distance: of x to that surface, if it has no points; FAR if it has [m].
        count: how many are wanted.
    """
    x_, away, distance = jax.lax.stop_gradient((x, away, distance))
    nearest = nearest_of_groups(field, x_, groups.some.shape[0])
    nobody = jnp.iinfo(nearest.dtype).max
    nearest = jnp.where(groups.some, nearest, nobody)
    first = jnp.min(nearest)
    reach = jnp.where(first < nobody, jnp.sqrt(_number(first, x.dtype)), FAR)
    offset = x_ - field.points[(first & _places(field)).astype(jnp.int32)]
    nearer = (reach <= distance) & (jnp.sum(offset * away) > SAME_WAY * reach)
    first = jnp.where(nearer, first, nobody)  # that of the nearest surface
    distance = jnp.minimum(reach, distance)
    found: list[Nearest] = []
    for _ in range(count):
        # a group is taken once, wherever its mean is
        nearest = jnp.where(another(groups, x_, away, distance) & (nearest != first), nearest, nobody)
        first = checkpoint_name(jnp.min(nearest), CHOICE)
        some = first < nobody
        offset = x - field.points[(first & _places(field)).astype(jnp.int32)]
        found.append(Nearest(some, jnp.where(some, safe_norm(offset), FAR), jnp.where(some, offset, 0.0)))
        away, distance = jax.lax.stop_gradient((unit(found[-1].offset), found[-1].distance))
    return found
