"""Where a gripper comes from: directions across the closing axis, and whether its body is free on the way."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.grasp.gripper import Gripper
from hrcjax.numerics import safe_norm, unit
from hrcjax.typing import Array, DistanceFn, Float, Matrix3, Scalar, Vector3

TURNS = tuple(np.deg2rad([0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0]).tolist())
"""Turns of the approach about the closing axis, from as steep as it can be [rad]."""
STOPS = (0.0, 0.5, 1.0)
"""Shares of the approach at which the body is checked: the fingers' length covers what lies between, on an approach of
at most twice that length [1]."""


def gripper_axes(axis: Vector3, turn: Scalar, up: Vector3) -> Matrix3:
    """Axes of the gripper, as columns: y along the closing axis, z the approach.

    Args:
        axis: unit closing axis [1].
        turn: about it, from the direction nearest to straight down [rad].
        up: against gravity; where it runs along the closing axis, there is no steepest direction, and one across is taken [1].
    """
    down = -up + jnp.sum(up * axis) * axis
    least = jnp.argmin(jnp.abs(axis))
    other = jnp.cross(axis, jnp.zeros_like(axis).at[least].set(1))
    steep = unit(jnp.where(safe_norm(down) > 1e-3, down, other))
    z = jnp.cos(turn) * steep + jnp.sin(turn) * jnp.cross(axis, steep)
    return jnp.stack([jnp.cross(axis, z), axis, z], axis=1)


def body_clearance(
    gripper: Gripper, R: Matrix3, p: Vector3, opening: Scalar, approach: Scalar, clearance: DistanceFn
) -> Float[Array, ""]:
    """Least distance of the gripper's body from what must not be touched, on the approach and at the grasp [m].

    Args:
        R: axes of the gripper in the world.
        p: its tool point at the grasp [m].
        opening: between the pads [m].
        approach: length of the approach [m].
        clearance: point -> distance to object and table.
    """
    centres, moved, radii = (jnp.asarray(a, p.dtype) for a in gripper.spheres())
    local = centres + jnp.stack([jnp.zeros_like(moved), moved * opening / 2, jnp.zeros_like(moved)], axis=1)
    body = p + local @ R.T
    back = jnp.asarray(approach, p.dtype) * R[:, 2]

    def at(share: Array) -> Float[Array, ""]:
        return jnp.min(jax.vmap(clearance)(body - share * back) - radii)

    return jnp.min(jax.lax.map(at, jnp.asarray(STOPS, p.dtype)))
