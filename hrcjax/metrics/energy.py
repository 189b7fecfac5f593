"""Mechanical work of the joints."""

import jax.numpy as jnp

from hrcjax.typing import Array, Bool, Float, Scalar


def power(tau: Float[Array, "time joint"], qd: Float[Array, "time joint"]) -> Float[Array, "time"]:
    """Sum over the joints of |tau qd|: braking costs as much as driving [W].

    The Robotica paper's total work TW (table IX), a power in truth.
    """
    return jnp.sum(jnp.abs(tau * qd), axis=-1)


def energy(
    tau: Float[Array, "time joint"],
    qd: Float[Array, "time joint"],
    dt: Scalar,
    mask: Bool[Array, "time"] | None = None,
) -> Float[Array, ""]:
    """Integral of the power over the samples that count [J].

    Args:
        tau: joint torques [N m].
        qd: joint speeds [rad/s].
        dt: time of a sample [s].
        mask: samples that count.
    """
    each = power(tau, qd)
    return jnp.sum(each if mask is None else jnp.where(mask, each, 0)) * dt
