"""How near people come: a distance from image to image, its averaged rate, and how far an approach is carried on."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.interact.seen import Seen
from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Float, Scalar, Vector3

FAR = 10.0
"""Distance where nobody is [m]."""


class NearingParams(eqx.Module):
    """Numbers of foresight; our choice."""

    foresight: float = 0.6
    """Time over which an approach is carried on [s]."""
    smoothing: float = 0.1
    """Time over which the distance's rate is averaged [s]."""
    approach_max: float = 1.5
    """Largest rate of approach that is carried on [m/s]."""


class Nearing(eqx.Module):
    """What is remembered from image to image."""

    distance: Float[Array, ""]
    """To the nearest person, in the last image [m]."""
    rate: Float[Array, ""]
    """Its rate [m/s]."""
    stamp: Float[Array, ""]
    """Of the last image [s]."""


def nobody_near(dtype: jnp.dtype | type = jnp.float32) -> Nearing:
    """Before the first image."""
    zero = jnp.zeros((), dtype)
    return Nearing(zero + FAR, zero, zero - jnp.inf)


def watch_nearing(params: NearingParams, now: Nearing, stamp: Scalar, d: Float[Array, ""]) -> Nearing:
    """What is known after a tick; it changes where an image is new. Who comes into view at once has no rate.

    Args:
        stamp: of the image in use [s].
        d: the distance in it; `FAR`: nobody is there [m].
    """
    new, known = stamp > now.stamp, jnp.isfinite(now.stamp)
    since = jnp.where(new & known, stamp - jnp.where(known, now.stamp, 0.0), 1.0)
    rate = jnp.where(known & (now.distance < FAR) & (d < FAR), (d - now.distance) / jnp.maximum(since, 1e-3), 0.0)
    weight = 1 - jnp.exp(-since / params.smoothing)
    return Nearing(
        jnp.where(new, d, now.distance),
        jnp.where(new, now.rate + weight * (rate - now.rate), now.rate),
        jnp.where(new, jnp.asarray(stamp, d.dtype), now.stamp),
    )


def carried_on(params: NearingParams, now: Nearing) -> Float[Array, ""]:
    """How much nearer they will be, should they come on as they do [m]."""
    return params.foresight * jnp.clip(-now.rate, 0.0, params.approach_max)


def nearest_to_way(seen: Seen, one: Vector3, other: Vector3) -> Float[Array, ""]:
    """Distance of the nearest sensed point to the straight way between two places; `FAR`: nobody is there [m]."""

    def from_way(p: Vector3) -> Float[Array, ""]:
        way = other - one
        share = jnp.clip(jnp.dot(p - one, way) / jnp.maximum(jnp.dot(way, way), 1e-12), 0.0, 1.0)
        return safe_norm(p - one - share * way)

    return jnp.minimum(jnp.min(jnp.where(seen.mask, jax.vmap(from_way)(seen.points), FAR)), FAR)
