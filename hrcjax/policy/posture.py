"""Posture leaf: the joints are drawn to a posture, which decides what the tool leaves open."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Float, Joints


class PostureParams(eqx.Module):
    """Numbers of the posture leaf: gains of RMP2 (Li et al. 2021). The HRI paper's system has it
    off, and so has this default."""

    weight: float = 0.0
    """Metric; RMP2 has 0.005, 0 is off [1]."""
    kp: float = 100.0
    """Pull per distance [1/s^2]."""
    kd: float = 50.0
    """Damping of the speed [1/s]."""
    reach: float = 0.5
    """Distance in joint space beyond which the pull stops growing [rad]."""


def posture(
    params: PostureParams, q: Joints, qd: Joints, goal: Joints
) -> tuple[Float[Array, "joint"], Float[Array, "joint"]]:
    """Diagonal of the metric and desired acceleration of all joints.

    Args:
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        goal: the posture [rad].

    Returns:
        the diagonal of M [1] and the acceleration a [rad/s^2].

    Not finite if: reach is 0 and q is the posture.
    """
    delta = goal - q
    pull = params.kp * params.reach / jnp.maximum(safe_norm(delta), params.reach)
    a = pull * delta - params.kd * qd
    return jnp.full_like(a, params.weight), a
