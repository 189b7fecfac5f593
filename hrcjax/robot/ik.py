"""Joint positions that bring the tool to a pose: damped least squares."""

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_norm, solve_spd, unit
from hrcjax.robot.body import Arm, tool_frame
from hrcjax.robot.kinematics import link_frames, point_jacobians
from hrcjax.typing import Array, Float, Joints, Matrix3, Vector3

LEVER = 0.3
"""Length that weighs an angle against a distance: 1 rad counts as this much [m]."""
LONGEST_STEP = 0.5
"""Largest change of the joints in one iteration, as a norm [rad]."""


def rotation_error(R_to: Matrix3, R_from: Matrix3) -> Vector3:
    """The rotation vector, in world axes, that takes R_from to R_to; length 0 to pi [rad].

    By the quaternion whose largest entry is divided by, so that half a turn is as exact as a small one.
    """
    E = R_to @ R_from.T
    trace = E[0, 0] + E[1, 1] + E[2, 2]
    vector = jnp.stack([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])  # 4 w v
    outer = E + E.T + (1 - trace) * jnp.eye(3, dtype=E.dtype)  # 4 v v^T
    four = jnp.concatenate(  # 4 p p^T of the quaternion p = (w, v)
        [jnp.concatenate([(1 + trace)[None], vector])[None], jnp.concatenate([vector[:, None], outer], axis=1)]
    )
    row = unit(four[jnp.argmax(jnp.diagonal(four))])
    w, v = row[0], row[1:]
    v = jnp.where(w < 0, -v, v)
    length = safe_norm(v)
    angle_by_length = 2 * jnp.arctan2(length, jnp.abs(w)) / jnp.where(length > 0, length, 1)
    return v * jnp.where(length > 0, angle_by_length, 2)


def _tool_jacobian(arm: Arm, q: Joints) -> Float[Array, "6 joint"]:
    """Velocity of the tool point, and LEVER times its angular velocity, by the joint speeds."""
    size = arm.chain.size
    link = (arm.tool_link,)
    linear = point_jacobians(arm.chain, q, link, arm.tool_offset[None])[0]
    R, _ = link_frames(arm.chain, q)
    axes = jnp.einsum(
        "iab,ib->ai", R, jnp.asarray(arm.chain.link_rotation[:, 2, :], q.dtype)
    )  # joint axes, in the world
    moved = jnp.asarray(np.arange(size) <= arm.tool_link)
    return jnp.concatenate([linear, LEVER * jnp.where(moved, axes, 0)])


def inverse_kinematics(
    arm: Arm, R: Matrix3, p: Vector3, q_guess: Joints, iterations: int = 60
) -> tuple[Joints, Float[Array, ""], Float[Array, ""]]:
    """Joint positions near a guess that bring the tool to axes R and origin p.

    Levenberg-Marquardt: the damping falls after a step that helped and grows after one that did not, which is then
    not taken. Of the many solutions the guess decides which; where none is found the nearest pose seen is returned
    with its errors. Joint limits are ignored.

    Args:
        R: axes of the tool in the world.
        p: tool point in the world [m].
        q_guess: where to start [rad].
        iterations: number of steps tried.

    Returns:
        q [rad], the error of the position [m] and that of the rotation [rad].
    """

    def error(q: Joints) -> Float[Array, "6"]:
        R_now, p_now = tool_frame(arm, q)
        return jnp.concatenate([p - p_now, LEVER * rotation_error(R, R_now)])

    def iterate(carry: tuple[Array, Array, Array], _: None) -> tuple[tuple[Array, Array, Array], None]:
        q, e, damping = carry
        J = _tool_jacobian(arm, q)
        change = solve_spd(J.T @ J + damping * jnp.eye(arm.chain.size, dtype=q.dtype), J.T @ e)
        length = safe_norm(change)
        change = change * jnp.where(length > LONGEST_STEP, LONGEST_STEP / jnp.where(length > 0, length, 1), 1)
        tried = error(q + change)
        better = jnp.sum(tried * tried) < jnp.sum(e * e)
        damping = jnp.clip(jnp.where(better, 0.2 * damping, 4.0 * damping), 1e-7, 1e2)
        return (jnp.where(better, q + change, q), jnp.where(better, tried, e), damping), None

    start = (q_guess, error(q_guess), jnp.asarray(1e-2, q_guess.dtype))
    (q, e, _), _ = jax.lax.scan(iterate, start, length=iterations)
    return q, safe_norm(e[:3]), safe_norm(e[3:]) / LEVER
