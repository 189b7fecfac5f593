"""Rotation matrices: roll-pitch-yaw, rotation vector, and the view of a camera that looks at a point."""

import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt, unit
from hrcjax.typing import Array, Float, Matrix3, Scalar, Vector3


def rotation_z(angle: Scalar) -> Matrix3:
    """Rotation about the z axis by an angle [rad]."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    zero, one = jnp.zeros_like(c), jnp.ones_like(c)
    return jnp.stack([jnp.stack([c, -s, zero]), jnp.stack([s, c, zero]), jnp.stack([zero, zero, one])])


def rotation_rpy(roll: Scalar, pitch: Scalar, yaw: Scalar) -> Matrix3:
    """Rz(yaw) Ry(pitch) Rx(roll): turns about the fixed axes x, then y, then z [rad]."""
    cr, sr, cp, sp = jnp.cos(roll), jnp.sin(roll), jnp.cos(pitch), jnp.sin(pitch)
    cy, sy = jnp.cos(yaw), jnp.sin(yaw)
    return jnp.stack(
        [
            jnp.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr]),
            jnp.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr]),
            jnp.stack([-sp, cp * sr, cp * cr]),
        ]
    )


def skew(v: Vector3) -> Matrix3:
    """The matrix of the cross product: skew(v) w = v x w."""
    zero = jnp.zeros_like(v[0])
    return jnp.stack(
        [jnp.stack([zero, -v[2], v[1]]), jnp.stack([v[2], zero, -v[0]]), jnp.stack([-v[1], v[0], zero])],
    )


def rotation_vector(v: Vector3) -> Matrix3:
    """Rotation by |v| [rad] about v (Rodrigues). Smooth at v = 0: a series replaces the quotients for small angles."""
    square = v @ v
    small = square < 1e-4
    angle = safe_sqrt(jnp.where(small, 1, square))
    sine = jnp.where(small, 1 - square / 6 + square**2 / 120, jnp.sin(angle) / angle)  # sin t / t
    versine = jnp.where(
        small, 0.5 - square / 24 + square**2 / 720, (1 - jnp.cos(angle)) / angle**2
    )  # (1 - cos t) / t^2
    K = skew(v)
    return jnp.eye(3, dtype=v.dtype) + sine * K + versine * (K @ K)


def look_at(eye: Vector3, target: Vector3, up: Float[Array, "3"] | None = None) -> Matrix3:
    """World-from-camera rotation of a camera at `eye` that sees `target` in its middle.

    Camera axes: x right, y down, z forward. `up` is the world's z unless given; where the view runs along it, the world's
    y is up instead.

    Not a rotation if: eye and target coincide (forward is then 0).
    """
    up = jnp.asarray([0.0, 0.0, 1.0], eye.dtype) if up is None else up
    forward = unit(target - eye)
    side = jnp.cross(forward, up)
    along = side @ side < 1e-8
    other = jnp.cross(forward, jnp.asarray([0.0, 1.0, 0.0], eye.dtype))
    right = unit(jnp.where(along, other, side))
    return jnp.stack([right, jnp.cross(forward, right), forward], axis=1)
