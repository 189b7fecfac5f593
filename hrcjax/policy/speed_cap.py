"""Speed-cap leaf: a joint is braked in a band below its top speed."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.typing import Array, Float


class SpeedCapParams(eqx.Module):
    """Numbers of the speed cap: those of the HRI paper's system, where not noted."""

    v_max: float = 1.7
    """Top speed [rad/s]."""
    region: float = 0.15
    """Width of the band below the top speed in which the brake acts [rad/s]."""
    k: float = 1.5
    """Brake per speed above the lower edge of the band [1/s]."""
    weight: float = 0.05
    """Metric at the lower edge of the band [1]."""
    ratio_max: float = 0.99
    """Share of the band at which the metric stops growing, so that it stays finite; ours, as the source's limit of
    1 - 1e-6 is lost in float32 [1]."""


def speed_cap(params: SpeedCapParams, qd: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Metric and desired acceleration of one joint. Both are 0 below the band; the metric jumps at its lower edge.

    Args:
        qd: speed of the joint [rad/s].

    Returns:
        the metric M [1] and the acceleration a [rad/s^2].

    Not finite if: region is 0 or ratio_max is 1.

    Source: the HRI paper's system, see docs/references.md.
    """
    excess = jnp.abs(qd) - (params.v_max - params.region)
    ratio = jnp.clip(excess / params.region, 0.0, params.ratio_max)
    M = jnp.where(excess > 0, params.weight / (1.0 - ratio**2), 0.0)
    return M, -params.k * jnp.maximum(excess, 0.0) * jnp.sign(qd)
