"""What a function is told of people at a tick, and the hand in it: the ball that fits the points nearest to the arm's tool."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import safe_norm, solve_spd, unit
from hrcjax.typing import Array, Bool, Float, Vector3

FITS = 4
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

    radius: float = 0.1
    """Of the ball that stands for a hand with its fingers [m]."""
    near: float = 0.08
    """Points count by exp(-s^2 / 2 near^2), s their distance from the one nearest to the tool [m]."""
    depth: float = 0.05
    """And by exp(-e / depth), e how much farther from the tool they are: hidden space behind a hand has points too [m]."""
    stiffness: float = 0.02
    """Share of the points' weight that holds the ball where the nearest point alone puts it [1]."""
    reach: float = 1.5
    """A person farther from the tool than this has no hand for it [m]."""


class Hand(eqx.Module):
    """A hand in one image."""

    there: Bool[Array, ""]
    """False: nobody is near."""
    x: Vector3
    """Its middle [m]."""


def find_hand(params: HandParams, seen: Seen, tool: Vector3) -> Hand:
    """The ball of `params.radius` that fits the points about the one nearest to the tool, by weighted least squares of their distances
    from its surface.

    Args:
        tool: the tool point [m].
    """
    dtype = tool.dtype
    radius, away = jnp.asarray(params.radius, dtype), safe_norm(seen.points - tool)
    away = jnp.where(seen.mask, away, jnp.inf)
    first = seen.points[jnp.argmin(away)]
    least = jnp.min(away)
    there = least < params.reach
    behind = jnp.where(seen.mask, away - jnp.where(there, least, 0.0), 0.0)
    spread = jnp.sum((seen.points - first) ** 2, axis=1)
    w = jnp.where(seen.mask, jnp.exp(-spread / (2 * params.near**2) - behind / params.depth), 0.0)
    start = first + radius * unit(first - tool)
    x = start
    for _ in range(FITS):
        off = x - seen.points
        n = unit(off)
        short = jnp.where(seen.mask, safe_norm(off) - radius, 0.0)
        hold = params.stiffness * jnp.sum(w) + 1e-6
        A = jnp.sum(w[:, None, None] * n[:, :, None] * n[:, None, :], axis=0) + hold * jnp.eye(3, dtype=dtype)
        b = jnp.sum((w * short)[:, None] * n, axis=0) + hold * (x - start)
        x = x - solve_spd(A, b)
    return Hand(there, jnp.where(there, x, tool))
