"""Every part of a tracked body as seen from a place: how far it is, and how fast it may come."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.body.params import BodyParams
from hrcjax.body.skeleton import END_A, END_B, ENDS, HEAD_PART, part_capsules
from hrcjax.body.state import BodyFit
from hrcjax.numerics import safe_divide, safe_norm, safe_sqrt
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3

ANY_SPEED = 100.0
"""Bound of the speed of a part that is not known: more than anybody's, and finite [m/s]."""


class PartsFrom(NamedTuple):
    """The parts of the body from a place."""

    distance: Float[Array, "part"]
    """To the surface; of a part that is not known less the uncertainty of its place [m]."""
    v_h: Float[Array, "part"]
    """Bound of the speed towards the place at the image; negative: it goes away; `ANY_SPEED` where it is not known [m/s]."""
    known: Bool[Array, "part"]
    """Whether the part, or parts at both of its ends, are seen, and its place is known well."""


def seen_since(fit: BodyFit) -> Float[Array, "part"]:
    """Time since every part was seen, or parts with which it shares both of its ends, as a neck between trunk and head [s]."""
    ends = jnp.asarray(ENDS)
    joints = jnp.min(jnp.where(ends, fit.unseen[:, None], jnp.inf), axis=0)
    return jnp.minimum(fit.unseen, jnp.max(jnp.where(ends, joints[None, :], 0.0), axis=1))


def parts_from(params: BodyParams, fit: BodyFit, x: Vector3, horizon: Scalar) -> PartsFrom:
    """How far every part of the body is from a place, and how fast it may come.

    The surface that is nearest now is not the one that arrives first: the hand of a forearm across the line may. With u from the nearest
    place of the axis to x, no place of a part is nearer to x than along u, and along u both ends bound all between them: each counts
    with its speed along u, less what it is farther by over the horizon. While joints keep their speeds, this bounds every way until then.

    Args:
        fit: of one frame.
        x: the place [m].
        horizon: time until the arm may have stopped [s].
    """
    dtype = x.dtype
    capsules = part_capsules(fit.joints, fit.radii)
    axis = capsules.b - capsules.a
    nearest = jnp.clip(safe_divide(jnp.sum((x - capsules.a) * axis, axis=1), jnp.sum(axis * axis, axis=1)), 0, 1)
    along = jnp.stack([nearest, jnp.zeros_like(nearest), jnp.ones_like(nearest)])  # (place part)
    gap = x - capsules.a - along[..., None] * axis
    size = safe_norm(gap[0])
    u = safe_divide(gap[0], size[:, None])
    farther = jnp.maximum(jnp.einsum("spc,pc->sp", gap, u) - size, 0.0)
    ends = jnp.asarray(END_A, dtype), jnp.asarray(END_B, dtype)
    share = ends[0] + along[..., None] * (ends[1] - ends[0])  # (place part joint)

    def deviation(of: Float[Array, "joint 3 3"]) -> Float[Array, "place part"]:
        # joints of one part err together at worst: deviations add up; a variance below 0 is rounding, and says nothing
        square = jnp.einsum("pc,jcd,pd->pj", u, of, u)
        each = jnp.where(square < 0, ANY_SPEED, safe_sqrt(jnp.maximum(square, 0.0)))
        return jnp.sum(share * each, axis=-1)

    speed = jnp.einsum("spc,pc->sp", jnp.einsum("spj,jc->spc", share, fit.speeds), u)
    bound = speed + params.deviations * deviation(fit.speed_covariance)
    bound = jnp.max(bound - farther / horizon, axis=0)
    of_place = deviation(fit.place_covariance)[0]
    known = (seen_since(fit) <= params.sure_unseen) & (of_place < params.sure_position)
    distance = size - capsules.radius
    return PartsFrom(
        jnp.where(known, distance, distance - params.deviations * of_place), jnp.where(known, bound, ANY_SPEED), known
    )  # fmt: skip


def surface_gap(fit: BodyFit, x: Vector3) -> Float[Array, ""]:
    """Distance of a place from the body's surface, negative inside [m]."""
    capsules = part_capsules(fit.joints, fit.radii)
    axis = capsules.b - capsules.a
    along = jnp.clip(safe_divide(jnp.sum((x - capsules.a) * axis, axis=1), jnp.sum(axis * axis, axis=1)), 0, 1)
    return jnp.min(safe_norm(x - capsules.a - along[:, None] * axis) - capsules.radius)


def head_gap(
    params: BodyParams, fit: BodyFit, x: Float[Array, "point 3"], time: Scalar
) -> tuple[Float[Array, "point"], Float[Array, "point 3"]]:
    """Least distance of places from the head's surface, where it is and where it will be if it goes on as it does [m]; its gradients [1].

    Of a head that is not seen, or whose place is not known well, less the uncertainty of its place.

    Args:
        time: from the frame on [s].
    """
    of_head = np.flatnonzero(ENDS[HEAD_PART])
    unseen = seen_since(fit)[HEAD_PART] > params.sure_unseen

    def gaps(joints: Float[Array, "joint 3"]) -> tuple[Array, Array]:
        capsules = part_capsules(joints, fit.radii)
        a, axis, radius = capsules.a[HEAD_PART], (capsules.b - capsules.a)[HEAD_PART], capsules.radius[HEAD_PART]
        along = jnp.clip(safe_divide(jnp.sum((x - a) * axis, axis=1), jnp.sum(axis * axis)), 0, 1)
        gap = x - a - along[:, None] * axis
        size = safe_norm(gap)
        away = safe_divide(gap, size[:, None])
        square = jnp.einsum("pc,jcd,pd->pj", away, fit.place_covariance[of_head], away)
        of_place = jnp.max(safe_sqrt(jnp.maximum(square, 0.0)), axis=1)
        lost = unseen | (of_place >= params.sure_position)
        return size - radius - jnp.where(lost, params.deviations * of_place, 0.0), away

    distance, away = jax.vmap(gaps)(jnp.stack([fit.joints, fit.joints + time * fit.speeds]))
    return jnp.min(distance, axis=0), jnp.where((distance[0] <= distance[1])[:, None], away[0], away[1])
