"""Whether two contacts hold between two fingers: the line between them within both cones of friction (Nguyen 1988)."""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.grasp.gripper import Gripper
from hrcjax.grasp.params import GraspParams
from hrcjax.numerics import safe_divide, safe_norm
from hrcjax.typing import Array, Bool, Float, Vector3


class Pair(NamedTuple):
    """Two contacts."""

    cone: Float[Array, ""]
    """How far the closing axis is within the narrower fit of the two cones: 1 along the normal, 0 at the edge, negative outside [1]."""
    width: Float[Array, ""]
    """Between the contacts [m]."""
    ok: Bool[Array, ""]
    """True if friction holds and the gripper opens wide enough."""


def antipodal(
    a: Vector3, normal_a: Vector3, b: Vector3, normal_b: Vector3, gripper: Gripper, params: GraspParams
) -> Pair:
    """Two contacts at a and b [m] with unit normals out of the object.

    By tangents, as those are what friction bounds: |tangential force| <= friction x normal force.
    """
    line = b - a
    width = safe_norm(line)
    axis = safe_divide(line, width)

    def inside(n: Vector3, push: Vector3) -> Float[Array, ""]:
        along = -jnp.sum(n * push)  # a finger pushes against the normal
        across = safe_norm(push + along * n)
        tangent = safe_divide(across, along, jnp.inf)
        return jnp.where(along > 0, 1 - tangent / params.friction, -1.0)

    cone = jnp.minimum(inside(normal_a, axis), inside(normal_b, -axis))
    fits = (width >= params.least_width) & (width + 2 * params.least_clearance <= gripper.stroke)
    return Pair(cone, width, fits & (cone >= 0))
