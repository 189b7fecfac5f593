"""Distance leaf: a control point is kept at a set distance from people, softly, long before a contact."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Float, Scalar, Vector3


class KeepDistanceParams(eqx.Module):
    """Numbers of the distance leaf; all are our choice."""

    distance: float = 0.7
    """Distance that is kept, above the one from which the safety layer's red zone begins [m]."""
    k: float = 40.0
    """Push per distance that is missing [1/s^2]."""
    damping: float = 8.0
    """Damping of an approach [1/s]."""
    retreat_damping: float = 2.0
    """And of a retreat, which follows a person who comes [1/s]."""
    band: float = 0.05
    """Distance over which the metric fades in below the set distance, and out beyond it [m]."""
    weight: float = 20.0
    """Metric along the direction to the person; 0: off [1]."""


def keep_distance(
    params: KeepDistanceParams, d: Scalar, g: Vector3, xd: Vector3
) -> tuple[Float[Array, "3 3"], Vector3]:
    """Metric and desired acceleration of one control point.

    a = (k max(distance - d, 0) - damping g . xd) g; the metric is weight sigmoid((distance - d) / (band / 4)) g g^T, so that motion along
    the surface of the person is left to the other leaves, and the leaf comes and goes without a step.

    Args:
        d: distance of the point's sphere to the nearest person [m].
        g: its gradient, away from the person [1].
        xd: velocity of the point [m/s].

    Not finite if: d is not; band is 0.
    """
    short = params.distance - d
    away = jnp.dot(g, xd)
    # softplus: no kink where the leaf begins
    scale = params.band / 4
    push = params.k * scale * jax.nn.softplus(short / scale)
    drag = jnp.where(away < 0, params.damping, params.retreat_damping) * away
    w = params.weight * jax.nn.sigmoid(short / scale)
    return w * g[:, None] * g[None, :], (push - drag) * g
