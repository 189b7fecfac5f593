"""Whether a person can point so: nothing of the arm that points lies within the rest of the body, and the wrist bends no further than wrists do."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import FAR, capsules_distances
from hrcjax.hand import BONES, PALM, WRIST
from hrcjax.typing import Array
from hrcjax.world.person import REGIONS

BEND = 75.0
"""The most that a wrist bends, between forearm and palm: the mean of 80 degrees of flexion and 70 of extension (American Academy of
Orthopaedic Surgeons 1965, *Joint Motion*) [deg]."""


class _Pairs(NamedTuple):
    """Capsules of an arm that points, and those that it must keep out of."""

    own: NDArray
    """(capsule) numbers."""
    apart: NDArray
    """(capsule capsule) whether a pair is asked."""


def _pairs(right: int) -> _Pairs:
    """Of a right arm (1) or a left one (0). What a joint connects overlaps: chest and upper arm, this and forearm, forearm and wrist."""
    numbers = {region: REGIONS.index(region) for region in REGIONS}
    upper, fore, ball = (numbers[region] + right for region in ("upper arm", "forearm", "hand"))
    hand = len(REGIONS) + np.arange(len(BONES))
    own = np.array([upper, fore, *hand])
    apart = np.ones((len(own), len(REGIONS) + len(BONES)), bool)
    apart[:, [ball, *hand]] = False
    apart[0, [numbers["chest"], upper, fore]] = False
    apart[1, [upper, fore]] = False
    joined = [WRIST in bone or 1 in bone for bone in BONES]  # landmark 1 is the root of the thumb
    apart[2:, fore] = ~np.array(joined)
    return _Pairs(own, apart)


@partial(jax.jit, static_argnums=1)
def _room(people: Capsules, right: int) -> Array:
    own, apart = _pairs(right)

    def one(person: Capsules) -> Array:
        arm = jax.tree.map(lambda a: a[own], person)
        return jnp.min(jnp.where(apart, capsules_distances(arm, person), FAR))

    return jax.vmap(one)(people)


def room_beside_oneself(people: Capsules, side: NDArray) -> NDArray:
    """(person) The least distance of the arm that points, and of its hand, from the rest of the body [m]; negative: within it.

    Args:
        people: of `people.people`.
        side: (person) 1: the right arm points, -1: the left one.
    """
    left, right = (np.asarray(_room(people, k), float) for k in (0, 1))
    return np.where(side > 0, right, left)


def bends(elbow: NDArray, landmarks: NDArray) -> NDArray:
    """(person) Angle between forearm and palm [deg].

    Args:
        elbow: (person 3) [m].
        landmarks: (person 21 3) of the hand [m].
    """
    fore, palm = landmarks[:, WRIST] - elbow, landmarks[:, PALM[2]] - landmarks[:, WRIST]
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(fore, palm), axis=1), np.sum(fore * palm, axis=1)))
