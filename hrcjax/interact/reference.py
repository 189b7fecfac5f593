"""References that never jump: a point that goes to a moving place with bounded speed and acceleration, and a share that rises and falls."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import safe_norm
from hrcjax.typing import Array, Bool, Float, Scalar, Vector3


class ReferenceParams(eqx.Module):
    """Numbers of a moving point; our choice."""

    gain: float = 6.0
    """Speed towards the place per distance [1/s]."""
    velocity_gain: float = 24.0
    """Acceleration per velocity that is missing; four times `gain` is critical [1/s]."""
    speed: float = 0.5
    """Largest speed relative to the place [m/s]."""
    acceleration: float = 1.5
    """Largest acceleration beside that of the place [m/s^2]."""
    leash: float = 0.03
    """How far it may be from the tool [m]."""
    velocity_leash: float = 0.06
    """And its velocity from that of the tool [m/s]."""


class Tool(eqx.Module):
    """The tool point as it is measured."""

    x: Vector3
    """[m]"""
    v: Vector3
    """[m/s]"""


class Reference(eqx.Module):
    """A point that is led."""

    x: Vector3
    """[m]"""
    v: Vector3
    """[m/s]"""
    a: Vector3
    """[m/s^2]"""


def at_rest(x: Vector3) -> Reference:
    """A point that stands."""
    return Reference(x, jnp.zeros_like(x), jnp.zeros_like(x))


def bounded(u: Vector3, most: Scalar) -> Vector3:
    """u, shortened to a length."""
    return u / jnp.maximum(safe_norm(u) / most, 1.0)


def led_to(
    params: ReferenceParams, now: Reference, tool: Tool, x: Vector3, v: Vector3, a: Vector3, dt: Scalar, speed: Scalar | None = None
) -> Reference:  # fmt: skip
    """The point after a tick on its way to a moving place, near the tool; on it, it stays on it.

    Far from the place it comes with `speed`, nearer with what it can still brake with half of its acceleration, and in the end in
    proportion to the distance.

    Args:
        x: the place [m].
        v: its velocity [m/s].
        a: its acceleration [m/s^2].
        dt: length of the tick [s].
        speed: largest speed relative to the place; None: `params.speed` [m/s].
    """
    now = near(params, now, tool)
    way = x - now.x
    far = safe_norm(way)
    most = jnp.minimum(params.speed if speed is None else speed, jnp.sqrt(params.acceleration * far + 1e-12))
    wanted = v + bounded(params.gain * way, most)
    given = a + bounded(params.velocity_gain * (wanted - now.v), params.acceleration)
    after = now.v + given * dt
    return Reference(now.x + after * dt, after, given)


def near(params: ReferenceParams, now: Reference, tool: Tool) -> Reference:
    """The led point, brought back to a tool that could not follow it: within `leash` of it and `velocity_leash` of its velocity, so that
    what the policy asks for when it may move again is bounded."""
    return Reference(
        tool.x + bounded(now.x - tool.x, params.leash), tool.v + bounded(now.v - tool.v, params.velocity_leash), now.a
    )


class Share(eqx.Module):
    """A number between 0 and 1 with continuous rate and acceleration."""

    s: Float[Array, ""]
    """[1]"""
    rate: Float[Array, ""]
    """[1/s]"""
    curve: Float[Array, ""]
    """Second derivative [1/s^2]."""


def no_share(dtype: jnp.dtype | type = jnp.float32) -> Share:
    """0, at rest."""
    zero = jnp.zeros((), dtype)
    return Share(zero, zero, zero)


def shifted(quickness: Scalar, share: Share, on: Bool[Array, ""], dt: Scalar) -> Share:
    """The share after a tick on its way to 1 (on) or 0: three equal real poles, so that it neither overshoots nor jumps in its second
    derivative.

    Args:
        quickness: the poles; 90 % are there after 5.3 over this [1/s].
        dt: length of the tick [s].
    """
    k = quickness
    jerk = k**3 * (jnp.where(on, 1.0, 0.0) - share.s) - 3 * k**2 * share.rate - 3 * k * share.curve
    curve = share.curve + jerk * dt
    rate = share.rate + curve * dt
    return Share(share.s + rate * dt, rate, curve)
