"""Which way a body faces: a trunk looks the same from both sides, but arms and trunks bend forward."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.body.skeleton import CROWN, HIP, LEFT, NECK_BASE, RIGHT
from hrcjax.body.state import KNOWN, PLACES, BodyState
from hrcjax.numerics import unit
from hrcjax.typing import Array, Bool, Float

OTHER_SIDE = (0, 1, 2, 4, 3, 6, 5, 8, 7, 10, 9)
"""Every joint's like on the other side."""
OTHER_PART = (0, 1, 2, 3, 5, 4, 7, 6, 9, 8)
"""And every part's."""
SCALES = {"wrist": 0.15, "elbow": 0.05, "lean": 0.1, "head": 0.1, "walk": 0.5}
"""How far before shoulder, shoulder-wrist line, hip and neck something is for an evidence of 1 [m]; of the hip's speed [m/s]."""
SETTLE = 0.3
"""Time over which the evidence is averaged [s]."""
TURNED = -0.7
"""Evidence under which left and right are exchanged [1]."""


def facing_evidence(joints: Float[Array, "joint 3"], speeds: Float[Array, "joint 3"]) -> Float[Array, ""]:
    """How much speaks for the body facing as its left and right say; negative: it faces the other way [1]."""
    left = joints[LEFT[0]] - joints[RIGHT[0]]
    forward = unit(jnp.stack([left[1], -left[0], jnp.zeros_like(left[0])]))

    def before(one: Array, other: Array, kind: str, most: float) -> Array:
        return jnp.clip((one - other) @ forward / SCALES[kind], -most, most)

    evidence = before(joints[NECK_BASE], joints[HIP], "lean", 2.0) + before(
        joints[CROWN], joints[NECK_BASE], "head", 1.0
    )
    evidence = evidence + 0.5 * jnp.clip(speeds[HIP] @ forward / SCALES["walk"], -1.0, 1.0)
    for shoulder, elbow, wrist, _ in (LEFT, RIGHT):
        evidence = evidence + before(joints[wrist], joints[shoulder], "wrist", 2.0)
        evidence = evidence + before(0.5 * (joints[shoulder] + joints[wrist]), joints[elbow], "elbow", 1.0)
    return evidence


def turned_round(state: BodyState, turn: Bool[Array, ""]) -> BodyState:
    """The state with left and right exchanged, if so told."""
    joint = jnp.asarray(OTHER_SIDE)
    place = (3 * joint[:, None] + jnp.arange(3)).reshape(-1)
    every = jnp.concatenate([place, jnp.arange(PLACES, KNOWN), KNOWN + place])
    part = jnp.asarray(OTHER_PART)
    other = (state.joints[joint], state.speeds[joint], state.covariance[every][:, every], state.unseen[part])
    mine = (state.joints, state.speeds, state.covariance, state.unseen)
    chosen = tuple(jnp.where(turn, a, b) for a, b in zip(other, mine, strict=True))
    return eqx.tree_at(lambda s: (s.joints, s.speeds, s.covariance, s.unseen), state, chosen)
