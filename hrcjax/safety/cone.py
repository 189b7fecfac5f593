"""Directions to a person are known up to an angle: how fast a motion may approach in the worst of them.

Somebody who is e beside where an image shows them, across the line to a point at distance D, is seen off by up to theta,
sin theta = e / D. A velocity v that approaches along the direction seen by a approaches along those within theta of it by at most

    |v| cos(max(phi - theta, 0)) = a cos theta + b sin theta,   |v| where theta >= phi,

with a = |v| cos phi and b = |v| sin phi, its part across. It is at most 0 for a retreat with a <= -b tan theta: v lies in
the cone of 90 degrees less theta about the direction away.
"""

import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt
from hrcjax.typing import Array, Float, Scalar

FLATTEST = 0.1
"""The smallest cosine by which a retreat is asked to make up for motion across [1]."""


def direction_sine(
    D: Float[Array, "*#row"], aside: Float[Array, "*#row"], widest: Scalar = 1.0
) -> Float[Array, "*#row"]:
    """sin theta, at most `widest`, which is 1 where the person may be on any side [1].

    Args:
        D: distance of a point's centre to the surface of the person [m].
        aside: e, how far the person may be beside where they are seen; 0: not at all [m].
        widest: the largest sine that counts [1].
    """
    some = aside > 0
    return jnp.minimum(jnp.where(some, aside / jnp.where(some, jnp.maximum(D, aside), 1.0), 0.0), widest)


def worst_approach(
    along: Float[Array, "*#row"], across: Float[Array, "*#row"], sine: Float[Array, "*#row"]
) -> Float[Array, "*#row"]:
    """The largest approach along any direction within theta of that seen; `along` itself where the sine is 0 [m/s].

    Args:
        along: a, speed along the direction seen; negative: a retreat [m/s].
        across: b, speed across it, not negative [m/s].
        sine: sin theta in [0, 1] [1].
    """
    cosine = safe_sqrt(1.0 - sine * sine)
    every = along * sine > across * cosine  # theta > phi
    worst = jnp.where(every, safe_sqrt(along * along + across * across), along * cosine + across * sine)
    return jnp.where(sine <= 0, along, worst)


def steep_limit(
    limit: Float[Array, "*#row"], across: Float[Array, "*#row"], sine: Float[Array, "*#row"]
) -> Float[Array, "*#row"]:
    """The limit of approach, less b tan theta: what keeps the worst approach within it, where it is 0 [m/s].

    Args:
        limit: of the approach along any direction within theta of that seen [m/s].
        across: b, speed across, as `worst_approach` [m/s].
        sine: sin theta in [0, 1] [1].
    """
    cosine = safe_sqrt(1.0 - sine * sine)
    return limit - across * sine / jnp.maximum(cosine, FLATTEST)
