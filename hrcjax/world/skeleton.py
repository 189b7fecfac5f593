"""From the points of a body to its capsules, and the body of a person of 1.75 m who stands, walks and reaches.

Bone lengths are 1.75 m times the segment proportions of Winter, Biomechanics and Motor Control of Human Movement
(2009), fig. 4.1, rounded to the centimetre.
"""

from typing import NamedTuple

import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.numerics import safe_sqrt, unit
from hrcjax.typing import Array, Float, Scalar, Vector3
from hrcjax.world.person import RADII, REGIONS
from hrcjax.world.scene import FLOOR_Z

HIP_HEIGHT = 0.93
"""Of the hip's middle over the floor [m]."""
TORSO = 0.50
"""Hip's middle to the neck's base [m]."""
NECK = 0.14
"""Neck's base to the middle of the head's lower half [m]."""
HEAD = 0.06
"""Length of the head's axis [m]."""
SHOULDER = 0.20
"""Half the distance between the shoulders [m]."""
UPPER_ARM = 0.33
"""Shoulder to elbow [m]."""
FOREARM = 0.26
"""Elbow to wrist [m]."""
HAND = 0.10
"""Wrist to the middle of the fingers [m]."""
HIP = 0.10
"""Half the distance between the hip joints [m]."""
THIGH = 0.43
"""Hip joint to knee [m]."""
SHANK = HIP_HEIGHT - THIGH - 0.07
"""Knee to the middle of the ankle [m]."""


class Body(NamedTuple):
    """The points that the capsules join [m]; pairs are left and right."""

    hip: Vector3
    waist: Vector3
    collar: Vector3
    chin: Vector3
    crown: Vector3
    shoulder: tuple[Vector3, Vector3]
    elbow: tuple[Vector3, Vector3]
    wrist: tuple[Vector3, Vector3]
    hand: tuple[Vector3, Vector3]
    hip_joint: tuple[Vector3, Vector3]
    knee: tuple[Vector3, Vector3]
    ankle: tuple[Vector3, Vector3]


class Pose(NamedTuple):
    """What moves a standing body; every number may depend on time."""

    hip: Float[Array, "2"]
    """Where the hip is, seen from above [m]."""
    forward: Float[Array, "2"]
    """Where the body faces, of length 1."""
    lean: Scalar
    """Forward tilt of the trunk [rad]."""
    hand: tuple[Vector3, Vector3]
    """Each hand as seen from its shoulder: forward, to the body's outside, up [m]."""
    stride: Scalar
    """Forward swing of the left thigh, the right one's opposite [rad]."""


def bend_arm(shoulder: Vector3, hand: Vector3, pole: Vector3) -> tuple[Vector3, Vector3, Vector3]:
    """Elbow, wrist and hand of an arm that reaches for `hand` with its elbow towards `pole` [m].

    Wrist and hand go on along the forearm. A hand out of reach is brought in, onto the line from the shoulder, to 99.5 %
    of the arm's length, so the bones keep their lengths.
    """
    lower = FOREARM + HAND
    way = hand - shoulder
    length = safe_sqrt(way @ way)
    reach = jnp.clip(length, 0.15, 0.995 * (UPPER_ARM + lower))
    u = unit(way)
    aside = unit(pole - (pole @ u) * u)
    foot = (reach * reach + UPPER_ARM**2 - lower**2) / (2 * reach)
    height = safe_sqrt(UPPER_ARM**2 - foot * foot)
    elbow = shoulder + foot * u + height * aside
    along = unit(shoulder + reach * u - elbow)
    return elbow, elbow + FOREARM * along, elbow + lower * along


def body_of(pose: Pose) -> Body:
    """The points of a standing body."""
    dtype = pose.hip.dtype
    zero = jnp.zeros((1,), dtype)
    up = jnp.asarray([0.0, 0.0, 1.0], dtype)
    forward = jnp.concatenate([pose.forward, zero])
    left = jnp.cross(up, forward)
    hip = jnp.concatenate([pose.hip, zero + (FLOOR_Z + HIP_HEIGHT)])
    spine = jnp.cos(pose.lean) * up + jnp.sin(pose.lean) * forward
    collar = hip + TORSO * spine
    face = unit(spine + up)  # the head tilts half as far
    chin = collar + NECK * face
    arms, legs = [], []
    for side, hand, swing in ((1.0, pose.hand[0], pose.stride), (-1.0, pose.hand[1], -jnp.asarray(pose.stride, dtype))):
        outside = side * left
        shoulder = collar - 0.05 * spine + SHOULDER * outside
        target = shoulder + hand[0] * forward + hand[1] * outside + hand[2] * up
        arms.append((shoulder, *bend_arm(shoulder, target, 0.7 * outside - 0.7 * forward - 0.3 * up)))
        joint = hip + HIP * outside
        thigh = jnp.sin(swing) * forward - jnp.cos(swing) * up
        fold = swing - jnp.abs(jnp.sin(swing)) * jnp.abs(jnp.sin(swing))  # the knee bends where the leg swings
        shank = jnp.sin(fold) * forward - jnp.cos(fold) * up
        knee = joint + THIGH * thigh
        legs.append((joint, knee, knee + SHANK * shank))
    (ls, le, lw, lh), (rs, re, rw, rh) = arms
    (lj, lk, la), (rj, rk, ra) = legs
    return Body(
        hip=hip,
        waist=hip + 0.45 * TORSO * spine,
        collar=collar,
        chin=chin,
        crown=chin + HEAD * face,
        shoulder=(ls, rs),
        elbow=(le, re),
        wrist=(lw, rw),
        hand=(lh, rh),
        hip_joint=(lj, rj),
        knee=(lk, rk),
        ankle=(la, ra),
    )


def body_capsules(body: Body) -> Capsules:
    """The capsules of a body, in the order of REGIONS.

    The trunk's capsules end a radius short of neck and waist where they would swallow the head.
    """
    chest_top = body.collar + 0.35 * (body.waist - body.collar)
    pairs = (
        (body.hip, body.waist),
        (body.waist, chest_top),
        (body.collar, body.chin),
        (body.chin, body.crown),
        *((body.shoulder[i], body.elbow[i]) for i in (0, 1)),
        *((body.elbow[i], body.wrist[i]) for i in (0, 1)),
        *((body.wrist[i], body.hand[i]) for i in (0, 1)),
        *((body.hip_joint[i], body.knee[i]) for i in (0, 1)),
        *((body.knee[i], body.ankle[i]) for i in (0, 1)),
    )
    radius = jnp.asarray([RADII[region] for region in REGIONS], body.hip.dtype)
    return Capsules(a=jnp.stack([p[0] for p in pairs]), b=jnp.stack([p[1] for p in pairs]), radius=radius)
