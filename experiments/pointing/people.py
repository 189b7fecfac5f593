"""People who stand at the table and point: trunk, head and legs of the cell's people, and an arm as slim as a real one."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.geom.capsules import Capsules
from hrcjax.typing import Array
from hrcjax.world.motions import REST
from hrcjax.world.scene import FLOOR_Z
from hrcjax.world.skeleton import FOREARM, HIP_HEIGHT, SHOULDER, TORSO, UPPER_ARM, Pose, body_capsules, body_of

from .hand import Hand

ARM_RADII = {"upper arm": 0.05, "forearm": 0.035}
"""Radii of the arm that points; those of the cell's people are for safety, and hide the hand [m]."""
TRUNK = 0.15
"""Radius of pelvis and chest, for the same reason [m]."""
REACH = 0.985 * (UPPER_ARM + FOREARM)
"""Longest way from shoulder to wrist [m]."""
NEAREST = 0.2
"""The shortest [m]."""


class Stand(NamedTuple):
    """How people stand, all facing -y; one row each."""

    hip: NDArray
    """(person 2) seen from above [m]."""
    lean: NDArray
    """(person) forward tilt of the trunk [rad]."""
    side: NDArray
    """(person) 1: the right arm points, -1: the left one."""


def shoulders(stand: Stand) -> NDArray:
    """(person 3) The shoulder of the arm that points, as `body_of` has it [m]."""
    length = TORSO - 0.05
    return np.stack(
        [
            stand.hip[:, 0] - stand.side * SHOULDER,
            stand.hip[:, 1] - np.sin(stand.lean) * length,
            FLOOR_Z + HIP_HEIGHT + np.cos(stand.lean) * length,
        ],
        axis=-1,
    )


def elbows(shoulder: NDArray, wrist: NDArray, side: NDArray) -> NDArray:
    """(person 3) Elbows of arms from shoulder to wrist, outwards and down [m]."""
    way = wrist - shoulder
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    u = way / length
    foot = (length**2 + UPPER_ARM**2 - FOREARM**2) / (2 * length)
    height = np.sqrt(np.maximum(UPPER_ARM**2 - foot**2, 0.0))
    pole = np.stack([-0.5 * side, np.zeros_like(side), -np.ones_like(side)], axis=-1)
    aside = pole - np.sum(pole * u, axis=-1, keepdims=True) * u
    return shoulder + foot * u + height * aside / np.linalg.norm(aside, axis=-1, keepdims=True)


@jax.jit
def _bodies(hip: Array, lean: Array) -> Capsules:
    rest = jnp.asarray(REST, hip.dtype)
    forward = jnp.asarray([0.0, -1.0], hip.dtype)

    def one(hip: Array, lean: Array) -> Capsules:
        return body_capsules(body_of(Pose(hip, forward, lean, (rest, rest), jnp.zeros_like(lean))))

    return jax.vmap(one)(hip, lean)


def people(stand: Stand, shoulder: NDArray, elbow: NDArray, hand: Hand, size: NDArray) -> Capsules:
    """All capsules of people who point: body, arm, hand.

    Args:
        shoulder: (person 3) of the arm that points [m].
        elbow: (person 3) [m].
        hand: its landmark 0 is the wrist.
        size: (person) factor of the arm's radii [1].
    """
    body = _bodies(jnp.asarray(stand.hip, jnp.float32), jnp.asarray(stand.lean, jnp.float32))
    a, b, radius = (np.array(x, float) for x in (body.a, body.b, body.radius))
    radius[:, :2] = TRUNK
    wrist, rows, right = hand.landmarks[:, 0], np.arange(len(a)), (stand.side > 0).astype(int)
    for first, ends, name in ((4, (shoulder, elbow), "upper arm"), (6, (elbow, wrist), "forearm")):
        a[rows, first + right], b[rows, first + right] = ends
        radius[rows, first + right] = ARM_RADII[name] * size
    radius[rows, 8 + right] = -1.0  # in place of the ball about the hand there is the hand
    joined = (np.concatenate(pair, axis=1) for pair in ((a, hand.a), (b, hand.b), (radius, hand.radius)))
    return Capsules(*(jnp.asarray(x, jnp.float32) for x in joined))
