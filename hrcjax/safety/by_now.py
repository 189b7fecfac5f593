"""Which surface of a person is the nearest changes between images: the others count as near as they may be by now."""

import jax.numpy as jnp

from hrcjax.safety.params import SafetyParams
from hrcjax.typing import Array, Float, Scalar


def nearest_by_now(
    params: SafetyParams, d: Float[Array, "row"], nearest: Float[Array, "row"], age: Scalar, dt: Scalar
) -> Float[Array, "row"]:
    """The distance by which the speed towards a surface is limited [m].

    v of the distance to the nearest surface of a point holds towards each of its surfaces that may be as near by the end of this tick, at up
    to `v_h_near` since the image was taken: an arm that comes past the nearer trunk. Farther ones count with the way that remains.
    Only surfaces that the field reads count. What a stop asks of a point besides, to retreat, follows its own distance.

    Args:
        d: distance of a control point to one of its surfaces [m].
        nearest: to the nearest of these [m].
        age: of the person data; infinite: there are none [s].
        dt: time since the last tick [s].
    """
    moved = params.ssm.v_h_near * (jnp.clip(jnp.asarray(age), 0.0, params.max_age) + dt)
    return jnp.maximum(jnp.minimum(d, nearest), d - moved)
