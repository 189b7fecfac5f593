"""Collision leaf: a control point is pushed off the nearest obstacle and slowed on its way to it."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Float, Scalar, Vector3


class CollisionParams(eqx.Module):
    """Numbers of the collision leaf: those of the HRI paper's system, where not noted."""

    k_rep: float = 0.8
    """Push at contact [m/s^2]."""
    s_rep: float = 0.1
    """Distance over which the push falls by the factor e [m]."""
    k_damp: float = 0.8
    """Damping at the distance (1 - eps) s_damp, before the gate [1/s]."""
    s_damp: float = 0.1
    """Distance that scales the damping [m]."""
    eps: float = 0.2
    """Keeps the damping finite at contact [1]."""
    v_gate: float = 0.5
    """Speed over which the damping fades in, from receding to approaching [m/s]."""
    r_act: float = 0.3
    """Distance beyond which the leaf has no metric [m]."""
    margin: float = 0.0
    """Clearance counted as contact; not given by the source [m]."""
    weight: float = 1.0
    """Metric at contact [1]."""
    isotropy: float = 1.0
    """Metric across the gradient, as a share of that along it: 1 is the source's w I, 0 is w g g^T, which leaves the
    motion along a surface to the other leaves [1]."""


def collision(params: CollisionParams, d: Scalar, g: Vector3, xd: Vector3) -> tuple[Float[Array, "3 3"], Vector3]:
    """Metric and desired acceleration of one control point.

    Args:
        d: clearance: distance of the point less the radius of its sphere; below `margin` it counts as contact [m].
        g: gradient of the distance, away from the obstacle; about 1 long, used as it is [1].
        xd: velocity of the point [m/s].

    Returns:
        the metric M [1] and the acceleration a [m/s^2].

    Not finite if: d is not; s_rep, s_damp, r_act or v_gate is 0.

    Source: the HRI paper's system, see docs/references.md, with two choices. The gate there acts on each axis of xd, so it depends on
    the frame; here it acts on g . xd, the speed away from the obstacle. Of the two metrics given, 1 - d / r_act and
    its square, this is the square: it ends without a kink. Inside contact d stops mattering: its derivative is 0.
    """
    clearance = jnp.maximum(d - params.margin, 0.0)
    gate = jax.nn.sigmoid(-jnp.dot(g, xd) / params.v_gate)  # 1 - sigmoid(g . xd / v)
    push = params.k_rep * jnp.exp(-clearance / params.s_rep)
    drag = gate * params.k_damp / (clearance / params.s_damp + params.eps)
    w = params.weight * jnp.maximum(1.0 - clearance / params.r_act, 0.0) ** 2
    M = params.isotropy * jnp.eye(3, dtype=xd.dtype) + (1.0 - params.isotropy) * g[:, None] * g[None, :]
    return w * M, push * g - drag * xd
