"""Repulsion leaf: the potential field of the planner, alive in the loop, as a push on every control point."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import safe_divide
from hrcjax.typing import Array, Float, Scalar, Vector3


class RepulsionParams(eqx.Module):
    """Numbers that turn the potential's force, a length per step, into a leaf. All but the rate are our choice."""

    rate: float = 30.0
    """Steps of the potential in a second (Robotica 2025: q' = F(q) 30 / s) [1/s]."""
    speed_max: float = 0.5
    """Speed away from the surface that the strongest force asks for [m/s]."""
    speed_half: float = 0.05
    """Speed asked for at which the metric is half of what the distance gives [m/s]."""
    gain: float = 6.0
    """Acceleration per speed asked for, and per speed of approach [1/s]."""
    v_smooth: float = 0.05
    """Speed of approach at which half of it is damped [m/s]."""
    weight: float = 10.0
    """Metric at contact [1]."""
    rho_min: float = 0.005
    """Distance below which 1 / d is continued by its tangent [m]."""


class Repel(eqx.Module):
    """Surfaces that repel the control points, and how. Any number of such sets act at once."""

    k_rep: Scalar
    """K_rep, as `PotentialParams.k_rep`; 0: off [m^(4-n)/step]."""
    reach: Float[Array, "point"]
    """Distance where repulsion begins, zeta times the radius of what repels; 0: never [m]."""
    fade: Float[Array, "point"]
    """Factor on the force: that of the goal's distance d^n for what stands, constant for people [m^n]."""
    d: Float[Array, "point"]
    """Clearance of the control points from these surfaces [m]."""
    g: Float[Array, "point 3"]
    """Its gradient [1]."""


def repulsion(
    params: RepulsionParams, k_rep: Scalar, reach: Scalar, fade: Scalar, d: Scalar, g: Vector3, xd: Vector3
) -> tuple[Float[Array, "3 3"], Vector3]:
    """Metric and desired acceleration of one control point.

    The force F = K_rep (1/d - 1/reach) / d^2 fade of the potential (Robotica 2025, eq. 3c) asks for the speed v = F rate, bounded as
    v / (1 + v / speed_max). The push is this speed times the gain; an approach is damped with the same gain. The metric acts along g
    alone, fades towards the reach, and is 0 where nothing is asked for. Half of `speed_max` is asked for at about the distance
    (2 rate K_rep fade / speed_max)^(1/3): each decade of K_rep doubles it, from 4 cm at 1e-6 m^2 to 39 cm at 1e-3 m^2, if the reach
    lets it.

    Args:
        k_rep, reach, fade, d, g: as `Repel`, of one point.
        xd: velocity of the point [m/s].

    Returns:
        the metric M [1] and the acceleration a [m/s^2].

    Not finite if: d is not; rho_min, speed_max, speed_half or v_smooth is 0.
    """
    dtype = xd.dtype
    d, reach = jnp.asarray(d, dtype), jnp.asarray(reach, dtype)
    rho_min = jnp.asarray(params.rho_min, dtype)
    far = jnp.maximum(d, rho_min)
    inverse = jnp.where(d < rho_min, 2.0 / rho_min - d / rho_min**2, 1.0 / far)
    inside = (d < reach) & (reach > 0)
    excess = jnp.where(inside, inverse - safe_divide(jnp.ones_like(reach), reach), 0.0)
    force = k_rep * excess / far**2 * fade  # eq. 3c: minus the gradient of eq. 3b
    asked = params.rate * force
    speed = asked / (1.0 + asked / params.speed_max)
    near = jnp.where(inside, 1.0 - safe_divide(d, reach, 1.0), 0.0)
    w = params.weight * near**2 * speed / (speed + params.speed_half)
    towards = jnp.maximum(-jnp.dot(g, xd), 0.0)
    damped = towards * towards / (towards + params.v_smooth)
    return w * g[:, None] * g[None, :], jnp.asarray(params.gain * (speed + damped)) * g
