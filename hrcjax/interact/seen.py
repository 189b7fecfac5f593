"""What a function is told of people at a tick, and the hand in it: the ball that fits the end of what a person reaches out with."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.numerics import safe_norm, solve_spd, unit
from hrcjax.typing import Array, Bool, Float, Vector3

FITS = 6
"""Gauss-Newton steps of the ball."""


class Seen(eqx.Module):
    """Sensed points of people."""

    points: Float[Array, "point 3"]
    """Of the image in use; a field of people has them [m]."""
    mask: Bool[Array, "point"]
    """True where a point exists."""
    stamp: Float[Array, ""]
    """When that image was taken; minus infinity: there is none [s]."""
    t: Float[Array, ""]
    """Now [s]."""


class HandParams(eqx.Module):
    """How a hand is found; our choice."""

    radius: float = 0.103
    """Of the ball that stands for a hand with its fingers: that of our people's hands [m]."""
    near: float = 0.15
    """Points count by exp(-s^2 / 2 near^2), s their distance from the nearest one [m]."""
    arm: float = 0.3
    """Points up to here from the ball tell where the arm comes from [m]."""
    edge: float = 0.02
    """Points count by sigmoid(e / edge), e how far they are before the middle of the ball, as seen from the arm: farther up a hand is no
    ball, and the fit would slide [m]."""
    stiffness: float = 0.005
    """Share of the points' weight that holds the ball where the nearest point alone puts it [1]."""
    height: float = 0.3
    """People reach towards the place so high above the arm's base [m]."""
    reach: float = 1.5
    """A person farther from there than this has no hand for it [m]."""


class Hand(eqx.Module):
    """A hand in one image."""

    there: Bool[Array, ""]
    """False: nobody is near."""
    x: Vector3
    """Its middle [m]."""


def find_hand(params: HandParams, seen: Seen) -> Hand:
    """The ball of `params.radius` that fits the end of what a person reaches out with: the points about the one nearest to the arm's base,
    on the side away from the body, by weighted least squares of their distances from the ball's surface."""
    dtype = seen.points.dtype
    base = jnp.asarray([0.0, 0.0, 1.0], dtype) * params.height
    radius, away = jnp.asarray(params.radius, dtype), safe_norm(seen.points - base)
    away = jnp.where(seen.mask, away, jnp.inf)
    first = seen.points[jnp.argmin(away)]
    there = jnp.min(away) < params.reach
    spread = jnp.sum((seen.points - first) ** 2, axis=1)
    about = jnp.where(seen.mask, jnp.exp(-spread / (2 * params.near**2)), 0.0)
    start = first + radius * unit(first - base)
    x = start
    for _ in range(FITS):
        off = x - seen.points
        far = safe_norm(off)
        body = jnp.where(seen.mask & (far > 1.5 * radius) & (far < params.arm + radius), 1.0, 0.0).astype(dtype)
        axis = unit(jnp.sum(body[:, None] * off, axis=0))  # from the arm to the hand
        w = about * jax.nn.sigmoid(-jnp.sum(off * axis, axis=1) / params.edge)
        n = unit(off)
        short = jnp.where(seen.mask, far - radius, 0.0)
        hold = params.stiffness * jnp.sum(w) + 1e-6
        A = jnp.sum(w[:, None, None] * n[:, :, None] * n[:, None, :], axis=0) + hold * jnp.eye(3, dtype=dtype)
        b = jnp.sum((w * short)[:, None] * n, axis=0) + hold * (x - start)
        x = x - solve_spd(A, b)
    return Hand(there, jnp.where(there, x, base))
