"""The tracked body: eleven joints, and ten capsules whose ends are fixed mixtures of them.

Positions of joints, not angles, are what is fitted: a distance to a capsule is then linear in them but for one direction,
nothing is singular, and lengths of bones are residuals like any other.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from hrcjax.geom.capsules import Capsules
from hrcjax.safety.pfl import BODY_REGIONS
from hrcjax.typing import Array, Float
from hrcjax.world.person import RADII, REGIONS, Person
from hrcjax.world.skeleton import HEAD, NECK

JOINTS = (
    "hip", "neck", "crown", "left shoulder", "right shoulder", "left elbow", "right elbow", "left wrist", "right wrist",
    "left fingers", "right fingers",
)  # fmt: skip
"""Joints in the order of all arrays; "fingers" is the middle of the fingers, "crown" the upper end of the head's axis."""
HIP, NECK_BASE, CROWN = 0, 1, 2
LEFT, RIGHT = (3, 5, 7, 9), (4, 6, 8, 10)
"""Shoulder, elbow, wrist and fingers of each side."""

LOW, HIGH = 0.45, 0.35
"""Shares of the trunk at which its two capsules meet, from the hip, and at which the upper one ends, from the neck to there [1]."""
CHIN = NECK / (NECK + HEAD)
"""Share of the way from the neck's base to the crown at which the head's capsule begins [1]."""


class Part(NamedTuple):
    """One capsule."""

    region: str
    """Its body region, a word of `hrcjax.world.person.REGIONS`."""
    size: str
    """Which learnt radius it has."""
    a: dict[int, float]
    """Shares of joints in one end."""
    b: dict[int, float]
    """Shares of joints in the other."""


def _between(one: int, other: int, share: float) -> dict[int, float]:
    return {one: 1.0 - share, other: share}


_TOP = LOW + (1 - LOW) * (1 - HIGH)
PARTS = (
    Part("pelvis", "trunk", {HIP: 1.0}, _between(HIP, NECK_BASE, LOW)),
    Part("chest", "trunk", _between(HIP, NECK_BASE, LOW), _between(HIP, NECK_BASE, _TOP)),
    Part("neck", "neck", {NECK_BASE: 1.0}, _between(NECK_BASE, CROWN, CHIN)),
    Part("head", "head", _between(NECK_BASE, CROWN, CHIN), {CROWN: 1.0}),
    *(Part("upper arm", "upper arm", {side[0]: 1.0}, {side[1]: 1.0}) for side in (LEFT, RIGHT)),
    *(Part("forearm", "forearm", {side[1]: 1.0}, {side[2]: 1.0}) for side in (LEFT, RIGHT)),
    *(Part("hand", "hand", {side[2]: 1.0}, {side[3]: 1.0}) for side in (LEFT, RIGHT)),
)
"""The capsules, in the order of the first ten of `hrcjax.world.person.REGIONS`."""
TRUNK, HEAD_PART = (0, 1), 3
ARMS = ((4, 6, 8), (5, 7, 9))
"""Upper arm, forearm and hand of each side: indices into `PARTS`."""

BONES = (
    ("trunk", HIP, NECK_BASE), ("head", NECK_BASE, CROWN), ("shoulders", LEFT[0], RIGHT[0]),
    ("collar", NECK_BASE, LEFT[0]), ("collar", NECK_BASE, RIGHT[0]),
    ("upper arm", LEFT[0], LEFT[1]), ("upper arm", RIGHT[0], RIGHT[1]),
    ("forearm", LEFT[1], LEFT[2]), ("forearm", RIGHT[1], RIGHT[2]),
    ("hand", LEFT[2], LEFT[3]), ("hand", RIGHT[2], RIGHT[3]),
)  # fmt: skip
"""Distances of joints that are constant, and the length that each has: both sides share one."""
LENGTHS = ("trunk", "head", "shoulders", "collar", "upper arm", "forearm", "hand")
USUAL_LENGTHS = (0.42, 0.27, 0.35, 0.17, 0.30, 0.265, 0.10)
"""Between those of a person of 1.75 m (Winter 2009, as `hrcjax.world.skeleton`) and those of the joints of motion capture, whose neck is lower and
whose shoulders are farther inwards; our choice [m]."""
LENGTH_SPREADS = (0.08, 0.07, 0.05, 0.04, 0.03, 0.02, 0.01)
"""Standard deviations of these: both kinds are within one [m]."""
RADIUS_NAMES = ("trunk", "neck", "head", "upper arm", "forearm", "hand")
USUAL_RADII = (RADII["pelvis"], *(RADII[name] for name in RADIUS_NAMES[1:]))
"""As in use for capsule models of people, see `hrcjax.world.person` [m]."""

BONE_ENDS = np.asarray([bone[1:] for bone in BONES])
BONE_LENGTH = np.asarray([LENGTHS.index(bone[0]) for bone in BONES])
PART_RADIUS = np.asarray([RADIUS_NAMES.index(part.size) for part in PARTS])


def _mixture(ends: list[dict[int, float]]) -> np.ndarray:
    rows = np.zeros((len(ends), len(JOINTS)))
    for row, end in zip(rows, ends, strict=True):
        for joint, share in end.items():
            row[joint] = share
    return rows


END_A = _mixture([part.a for part in PARTS])
END_B = _mixture([part.b for part in PARTS])
"""Ends of the capsules as mixtures of joints (part joint) [1]."""

ENDS = (END_A > 0) | (END_B > 0)
"""Which joints are in the ends of a part (part joint)."""

_WORDS = {"pelvis": "pelvis", "chest": "chest", "neck": "neck", "head": "face"}
PART_REGION = np.asarray(
    [
        next(k for k, region in enumerate(BODY_REGIONS) if region.name.startswith(_WORDS.get(part.region, part.region)))
        for part in PARTS
    ]
)
"""Index into `hrcjax.safety.pfl.BODY_REGIONS` of every part. A head is its most sensitive region, the face: which way it looks is not known."""


def part_capsules(joints: Float[Array, "*batch joint 3"], radii: Float[Array, "*batch radius"]) -> Capsules:
    """The capsules of a body [m]."""
    a = jnp.einsum("pj,...jc->...pc", jnp.asarray(END_A, joints.dtype), joints)
    b = jnp.einsum("pj,...jc->...pc", jnp.asarray(END_B, joints.dtype), joints)
    return Capsules(a, b, radii[..., PART_RADIUS])


def joints_of(person: Person) -> Float[Array, "frame joint 3"]:
    """The joints of a person of the project's own shape, frame by frame: what a perfect fit would find [m].

    Raises:
        ValueError: a person of other capsules.
    """
    if person.regions[: len(PARTS)] != tuple(part.region for part in PARTS) or person.regions != REGIONS:
        raise ValueError(f"a person of capsules {person.regions}; accepted: one person of {REGIONS}")
    a, b = person.a, person.b
    arms = [a[:, 4], a[:, 5], b[:, 4], b[:, 5], b[:, 6], b[:, 7], b[:, 8], b[:, 9]]
    return jnp.stack([a[:, 0], a[:, 2], b[:, 3], *arms], axis=1)
