"""What is known of bodies without looking: bones, joint limits, how people stand; and joints that somebody else found."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.body.params import BodyParams
from hrcjax.body.skeleton import BONE_ENDS, BONE_LENGTH, BONES, CROWN, HIP, LEFT, NECK_BASE, RIGHT
from hrcjax.geom.segment import point_segment_distance
from hrcjax.numerics import safe_norm, safe_sqrt, unit
from hrcjax.typing import Array, Float, Scalar, Vector3
from hrcjax.world.scene import FLOOR_Z

REST = (0.10, 0.05, -0.47)
"""A hanging wrist as seen from its shoulder: forward, outside, up [m]."""
BEHIND = 0.35
"""How far behind its shoulder a wrist gets [m]."""
BENT = 0.15
"""How far before the line from shoulder to wrist an elbow gets [m]."""
APART = 0.2
"""How near to the trunk's axis elbows, wrists and fingers get [m]."""
BELOW = 0.03
"""How far the middle of the shoulders is below the neck's base [m]."""
_SOFT = tuple("collar" if bone[0] in ("collar", "shoulders") else "bone" for bone in BONES)


class Landmarks(eqx.Module):
    """Joints that another method found, as a pose network does."""

    joints: Float[Array, "joint 3"]
    """Places in the order of `JOINTS`; not a number: not given [m]."""
    weight: Float[Array, "joint"]
    """One over the variance of each [1/m^2]."""


def frame_of(joints: Float[Array, "joint 3"]) -> tuple[Vector3, Vector3, Vector3]:
    """Forward, left and up of the trunk [1]."""
    up = unit(joints[NECK_BASE] - joints[HIP])
    left = unit(joints[LEFT[0]] - joints[RIGHT[0]])
    return jnp.cross(left, up), left, up


def prior_residuals(
    params: BodyParams, joints: Float[Array, "joint 3"], lengths: Float[Array, "length"], share: Scalar
) -> Float[Array, "residual"]:
    """What the body breaks, each over its standard deviation.

    Args:
        share: how much the weak ones count: the frame's share in `params.patience` [1].
    """
    ends = joints[BONE_ENDS]
    deviation = jnp.stack([jnp.asarray(getattr(params, kind), joints.dtype) for kind in _SOFT])
    bones = (safe_norm(ends[:, 1] - ends[:, 0]) - lengths[BONE_LENGTH]) / deviation
    forward, left, up = frame_of(joints)
    middle = 0.5 * (joints[LEFT[0]] + joints[RIGHT[0]])
    girdle = (middle - joints[NECK_BASE] + BELOW * up) / params.collar
    level = (joints[LEFT[0]] - joints[RIGHT[0]]) @ up / (2 * params.collar)
    upright = jnp.asarray([0.0, 0.0, 1.0], joints.dtype)
    weak = [
        (up - upright) / params.lean,
        (joints[CROWN] - joints[NECK_BASE] - lengths[1] * unit(up + upright)) / params.head,
        ((joints[HIP, 2] - FLOOR_Z - params.hip_height) / params.hip_spread)[None],
    ]
    hard = [bones, girdle, level[None]]
    trunk = joints[HIP], joints[NECK_BASE]
    for side, sign in ((LEFT, 1.0), (RIGHT, -1.0)):
        shoulder, elbow, wrist, fingers = (joints[k] for k in side)
        straight = fingers - wrist - lengths[6] * unit(wrist - elbow)
        hang = shoulder + REST[0] * forward + (REST[1] * sign) * left + REST[2] * upright
        weak.append((wrist - hang) / params.rest)
        behind = -(wrist - shoulder) @ forward - BEHIND
        bent = (elbow - 0.5 * (shoulder + wrist)) @ forward - BENT
        inside = jnp.stack([APART - point_segment_distance(p, *trunk) for p in (elbow, wrist, fingers)])
        limits = jnp.concatenate([behind[None], bent[None], inside])
        hard += [straight / params.wrist, jnp.maximum(limits, 0.0) / params.limit]
    return jnp.concatenate([*hard, *(safe_sqrt(jnp.asarray(share, joints.dtype)) * one for one in weak)])


def landmark_residuals(joints: Float[Array, "joint 3"], found: Landmarks) -> Float[Array, "residual"]:
    """Distances to joints that were found, each over its standard deviation; 0 where none is given."""
    given = jnp.isfinite(found.joints)
    off = joints - jnp.where(given, found.joints, 0.0)
    return jnp.where(given, off * safe_sqrt(found.weight)[:, None], 0.0).reshape(-1)


def prior_slopes(
    params: BodyParams, joints: Float[Array, "joint 3"], lengths: Float[Array, "length"], share: Scalar
) -> tuple[Float[Array, "residual"], Float[Array, "residual place"], Float[Array, "residual length"]]:
    """The residuals with their slopes by the joints' coordinates and by the lengths."""

    def both(x: Array, one: Array) -> tuple[Array, Array]:
        r = prior_residuals(params, x.reshape(joints.shape), one, share)
        return r, r

    (by_x, by_length), r = jax.jacfwd(both, argnums=(0, 1), has_aux=True)(joints.reshape(-1), lengths)
    return r, by_x, by_length
