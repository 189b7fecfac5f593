"""Damping leaf: a drag on every joint."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.typing import Array, Float


class DampingParams(eqx.Module):
    """Numbers of the joint damping. The HRI paper's system gives the form and no numbers."""

    k: float = 1.0
    """Damping: the kd of the target leaf, so that joints which serve no target come to rest at the same rate [1/s]."""
    weight: float = 0.005
    """Metric: that of RMP2's damping (Li et al. 2021) [1]."""


def damping(params: DampingParams, qd: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Metric and desired acceleration of one joint.

    Args:
        qd: speed of the joint [rad/s].

    Returns:
        the metric M [1] and the acceleration a [rad/s^2].

    Source: the HRI paper's system, see docs/references.md.
    """
    a = -params.k * qd
    return jnp.full_like(a, params.weight), a
