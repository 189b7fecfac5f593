"""Collision leaf: a control point is pushed off the nearest obstacle and slowed on its way to it."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt
from hrcjax.typing import Array, Float, Scalar, Vector3


class CollisionParams(eqx.Module):
    """Numbers of the collision leaf. Its form is that of the HRI paper's system; the numbers there, given below, are for spheres of
    12 cm, a target metric of 1.5 and 0.5 m/s. These hold a tool of 1 m/s off, against a target metric of 10."""

    k_rep: float = 2.0
    """Push at contact; 0.8 there [m/s^2]."""
    s_rep: float = 0.1
    """Distance over which the push falls by the factor e [m]."""
    k_damp: float = 8.0
    """Damping at the distance (1 - eps) s_damp, before the gate; 0.8 there. From `r_act` to contact it takes away
    k_damp s_damp ln((r_act / s_damp + eps) / eps), 1.7 m/s over 15 cm [1/s]."""
    s_damp: float = 0.1
    """Distance that scales the damping [m]."""
    eps: float = 0.2
    """Keeps the damping finite at contact [1]."""
    v_gate: float = 0.2
    """Speed over which damping and metric fade in, from receding to approaching; 0.5 there [m/s]."""
    r_act: float = 0.3
    """Distance beyond which the leaf has no metric [m]."""
    margin: float = 0.0
    """Clearance counted as contact; not given by the source [m]."""
    weight: float = 3.0
    """Metric where the clearance is half of `r_act`, before the gate [1]."""
    d_min: float = 0.01
    """Least distance that the metric counts with: at contact it is weight (r_act / d_min - 1)^2 [m]."""
    isotropy: float = 0.05
    """Metric and damping across the gradient, as a share of those along it: 1 is the source's w I, 0 is w g g^T, which leaves
    the motion along a surface to the other leaves [1]."""


def collision(params: CollisionParams, d: Scalar, g: Vector3, xd: Vector3) -> tuple[Float[Array, "3 3"], Vector3]:
    """Metric and desired acceleration of one control point.

    Args:
        d: clearance: distance of the point less the radius of its sphere; below `margin` it counts as contact [m].
        g: gradient of the distance, away from the obstacle; about 1 long, used as it is [1].
        xd: velocity of the point [m/s].

    Returns:
        the metric M [1] and the acceleration a [m/s^2].

    Not finite if: d is not; s_rep, s_damp, d_min or v_gate is 0.

    Source: the HRI paper's system, see docs/references.md, with these choices. The gate there acts on each axis of xd, so it depends on
    the frame; here it acts on g . xd, the speed away from the obstacle, and on the metric too: who recedes is free. The metric there
    is 1 - d / r_act or its square, of 1 at contact, over which any other leaf may outweigh it; here it is (r_act / d - 1)^2, which
    grows towards contact as far as `d_min` lets it. Both end without a kink at r_act. Inside contact d stops mattering.
    """
    clearance = jnp.maximum(d - params.margin, 0.0)
    away = jnp.dot(g, xd)
    gate = jax.nn.sigmoid(-away / params.v_gate)  # 1 - sigmoid(g . xd / v)
    push = params.k_rep * jnp.exp(-clearance / params.s_rep)
    drag = gate * params.k_damp / (clearance / params.s_damp + params.eps)
    effective = safe_sqrt(clearance * clearance + jnp.asarray(params.d_min, xd.dtype) ** 2)
    w = params.weight * gate * jnp.maximum(params.r_act / effective - 1.0, 0.0) ** 2
    across = params.isotropy
    M = across * jnp.eye(3, dtype=xd.dtype) + (1.0 - across) * g[:, None] * g[None, :]
    return w * M, push * g - drag * (across * xd + (1.0 - across) * away * g)
