"""Which way a body faces: a trunk looks the same from both sides, but people mostly face the robot, walk forward, and bend their elbows back."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.body.skeleton import HIP, LEFT, RIGHT
from hrcjax.body.state import KNOWN, PLACES, BodyState
from hrcjax.numerics import safe_norm, unit
from hrcjax.typing import Array, Bool, Float, Scalar

OTHER_SIDE = (0, 1, 2, 4, 3, 6, 5, 8, 7, 10, 9)
"""Every joint's like on the other side."""
OTHER_PART = (0, 1, 2, 3, 5, 4, 7, 6, 9, 8)
"""And every part's."""
BASE, WALK, ELBOW = 1.0, 2.0, 1.0
"""Weights of facing the robot's base, of walking forward, and of each elbow that is behind [1]."""
WALKING = 0.5
"""Speed of the hip from which on walking counts in full [m/s]."""
ELBOW_BACK = 0.05
"""How far behind the line from shoulder to wrist an elbow is that counts in full [m]."""
SETTLE = 0.3
"""Time over which the evidence is averaged [s]."""
TURNED = -1.0
"""Evidence under which left and right are exchanged [1]."""

FASTEST_TURN = 7.0
"""Nobody beside a robot turns their shoulders faster: recorded people do not over 2, tracks that are right do not over 4 with their noise, and fits
that go over to another body do over 7 [rad/s]."""
LEAST_TIME = 1 / 30
"""Images nearer together in time count as so far apart: the noise of a fit does not shrink with the time between two [s]."""


def facing_evidence(joints: Float[Array, "joint 3"], speeds: Float[Array, "joint 3"]) -> Float[Array, ""]:
    """How much speaks for the body facing as its left and right say; negative: it faces the other way [1]."""
    left = joints[LEFT[0]] - joints[RIGHT[0]]
    forward = unit(jnp.stack([left[1], -left[0], jnp.zeros_like(left[0])]))

    hip = joints[HIP]
    to_base = unit(jnp.stack([-hip[0], -hip[1], jnp.zeros_like(hip[0])]))
    evidence = BASE * forward @ to_base + WALK * jnp.clip(speeds[HIP] @ forward / WALKING, -1.0, 1.0)
    for shoulder, elbow, wrist, _ in (LEFT, RIGHT):
        back = (0.5 * (joints[shoulder] + joints[wrist]) - joints[elbow]) @ forward
        evidence = evidence + ELBOW * jnp.clip(back / ELBOW_BACK, -1.0, 1.0)
    return evidence


def spun(before: Float[Array, "joint 3"], after: Float[Array, "joint 3"], dt: Scalar) -> Bool[Array, ""]:
    """Whether the line of the shoulders has turned faster than a person's does.

    Args:
        dt: time between the two bodies [s].
    """
    one, other = (unit(joints[LEFT[0]] - joints[RIGHT[0]]) for joints in (before, after))
    most = FASTEST_TURN * jnp.maximum(jnp.asarray(dt, one.dtype), LEAST_TIME)
    return (most < jnp.pi) & (safe_norm(other - one) > 2.0 * jnp.sin(0.5 * most))


def turned_round(state: BodyState, turn: Bool[Array, ""]) -> BodyState:
    """The state with left and right exchanged, if so told."""
    joint = jnp.asarray(OTHER_SIDE)
    place = (3 * joint[:, None] + jnp.arange(3)).reshape(-1)
    every = jnp.concatenate([place, jnp.arange(PLACES, KNOWN), KNOWN + place])
    part = jnp.asarray(OTHER_PART)
    other = (
        state.joints[joint],
        state.speeds[joint],
        state.covariance[every][:, every],
        state.scatter[joint],
        state.unseen[part],
    )
    mine = (state.joints, state.speeds, state.covariance, state.scatter, state.unseen)
    chosen = tuple(jnp.where(turn, a, b) for a, b in zip(other, mine, strict=True))
    return eqx.tree_at(lambda s: (s.joints, s.speeds, s.covariance, s.scatter, s.unseen), state, chosen)
