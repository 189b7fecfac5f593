"""What is planned for: spheres that ride on an arm, or a single point, as functions of the configuration."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from hrcjax.robot import Arm, point_motion, points_on_links, tool_frame
from hrcjax.typing import Array, Float, Joints, Matrix3

WEIGHT_LENGTH = 0.1
"""Length of link whose repulsion counts as that of one point [m]."""
_ON_AXIS = 0.01
"""Points nearer to the axis of the first joint do not move [m]."""


class BodyPlaces(NamedTuple):
    """Where a body is."""

    points: Float[Array, "point 3"]
    """Centres of its spheres [m]."""
    tool: Float[Array, "3"]
    """Tool point [m]."""


class BodyMotion(NamedTuple):
    """Where a body is, and how the joints move it."""

    points: Float[Array, "point 3"]
    """Centres of its spheres [m]."""
    J: Float[Array, "point 3 joint"]
    """Their Jacobians [m/rad]."""
    tool: Float[Array, "3"]
    """Tool point [m]."""
    J_tool: Float[Array, "3 joint"]
    """Its Jacobian [m/rad]."""


class SpherePairs(NamedTuple):
    """Pairs of spheres that must not touch each other: some of the first spheres with some of the last."""

    rows: int
    """Number of spheres from the first on."""
    column: int
    """The sphere from which on the others are."""
    apart: np.ndarray
    """(row column) least distance of the centres; 0: they may touch [m]"""


NO_PAIRS = SpherePairs(0, 10**6, np.zeros((0, 0)))


@dataclass(frozen=True, eq=False)
class PlanBody:
    """What is planned for, as functions of one configuration. Constant and hashable by identity: close over it."""

    places: Callable[[Joints], BodyPlaces]
    """q -> centres of the spheres, tool point."""
    motion: Callable[[Joints], BodyMotion]
    """q -> the same with their Jacobians."""
    radii: np.ndarray
    """(point) of the spheres, which cover the body [m]"""
    still: int
    """Number of spheres that do not move, the first ones: obstacles do not count for them."""
    above_floor: np.ndarray
    """(exposed) whether a sphere must stay above the floor; exposed are those that move"""
    weights: np.ndarray
    """(exposed) shares in the repulsion: length of link that a sphere stands for, in units of WEIGHT_LENGTH [1]"""
    pairs: SpherePairs
    """Which spheres must not touch each other."""
    q_min: np.ndarray
    """(joint) [rad]"""
    q_max: np.ndarray
    """(joint) [rad]"""
    floor: float | None = None
    """Height of the floor; None: there is none [m]."""
    rotation: Callable[[Joints], Matrix3] | None = None
    """q -> axes of the tool; None: it has none."""

    @property
    def size(self) -> int:
        """Number of joints."""
        return len(self.q_min)


def point_body(bound: float = 100.0) -> PlanBody:
    """A point: its configuration is its place [m].

    Args:
        bound: largest coordinate [m].
    """

    def places(q: Joints) -> BodyPlaces:
        return BodyPlaces(q[None], q)

    def motion(q: Joints) -> BodyMotion:
        eye = jnp.eye(3, dtype=q.dtype)
        return BodyMotion(q[None], eye[None], q, eye)

    wide = np.full(3, bound)
    return PlanBody(places, motion, np.zeros(1), 0, np.ones(1, bool), np.ones(1), NO_PAIRS, -wide, wide)


def cover(a: np.ndarray, b: np.ndarray, radius: float, inflation: float) -> tuple[np.ndarray, float]:
    """Centres and radius of the spheres that cover a capsule and stand out by at most `inflation` [m]."""
    length = float(np.linalg.norm(b - a))
    if length / 2 <= inflation:
        return (a + b)[None] / 2, radius + length / 2
    widest = 2 * np.sqrt((radius + inflation) ** 2 - radius**2)
    count = int(np.ceil(length / widest - 1e-9)) + 1
    return np.linspace(a, b, count), float(np.hypot(radius, length / (count - 1) / 2))


def self_pairs(arm: Arm, tight: Sequence[tuple[str, str]] = ()) -> list[tuple[int, int]]:
    """Pairs of capsules that must not touch each other: those on links that are not neighbours, the one nearer to the base
    first. The base counts as part of the first link, which turns about its axis.

    Args:
        tight: pairs by name to leave out, as their shapes overlap where the real ones do not.
    """
    links, names = arm.capsule_links, arm.capsule_names
    left_out = {frozenset(pair) for pair in tight}
    every = range(len(links))
    return [
        (i, j)
        for i in every
        for j in every
        if links[j] - max(links[i], 0) > 1 and frozenset((names[i], names[j])) not in left_out
    ]


def sphere_pairs(owner: np.ndarray, radii: np.ndarray, capsules: Sequence[tuple[int, int]]) -> SpherePairs:
    """The pairs of spheres of pairs of capsules.

    Args:
        owner: (point) capsule of every sphere.
        radii: (capsule) [m].
        capsules: pairs, the one whose spheres come first before the other.
    """
    if not capsules:
        return NO_PAIRS
    apart = np.zeros((len(owner), len(owner)))
    for i, j in capsules:
        apart[np.outer(owner == i, owner == j)] = radii[i] + radii[j]
    rows, column = int(np.flatnonzero(apart.any(1))[-1]) + 1, int(np.flatnonzero(apart.any(0))[0])
    return SpherePairs(rows, column, apart[:rows, column:])


def is_fixed(arm: Arm, link: int, at: np.ndarray) -> bool:
    """Whether a point of a link cannot move: it is part of the base, or lies on the axis of the first joint."""
    local = arm.chain.link_pos[0] + arm.chain.link_rotation[0] @ at
    return link < 0 or (link == 0 and bool(np.hypot(local[0], local[1]) < _ON_AXIS))


def arm_body(
    arm: Arm, inflation: float = 0.005, floor: float | None = None, tight: Sequence[tuple[str, str]] = (("forearm", "wrist 2"),)
) -> PlanBody:  # fmt: skip
    """The moving links of an arm as spheres along its capsules.

    Args:
        inflation: most that a sphere stands out of its capsule: larger means fewer spheres [m].
        floor: height of a floor that all links beyond the first keep above [m]; None: there is none.
        tight: pairs of capsules by name that may overlap.
    """
    order = sorted(range(len(arm.capsule_links)), key=lambda k: arm.capsule_links[k])
    covers = {k: cover(arm.capsule_a[k], arm.capsule_b[k], arm.capsule_radii[k], inflation) for k in order}
    owner = np.array([k for k in order for _ in covers[k][0]])
    offsets = np.concatenate([covers[k][0] for k in order])
    fixed = np.array([is_fixed(arm, arm.capsule_links[k], at) for k, at in zip(owner, offsets, strict=True)])
    first = np.argsort(~fixed, kind="stable")
    owner, offsets, still = owner[first], offsets[first], int(fixed.sum())
    links = tuple(int(arm.capsule_links[k]) for k in owner)
    radii = np.array([covers[k][1] for k in owner])
    lengths = np.linalg.norm(arm.capsule_b - arm.capsule_a, axis=1) + 2 * arm.capsule_radii
    weights = np.array([lengths[k] / len(covers[k][0]) / WEIGHT_LENGTH for k in owner[still:]])
    pairs = sphere_pairs(owner, arm.capsule_radii, self_pairs(arm, tight))
    tool_link, tool_offset = (arm.tool_link,), arm.tool_offset[None]

    def places(q: Joints) -> BodyPlaces:
        x = points_on_links(arm.chain, q, (*links, *tool_link), np.concatenate([offsets, tool_offset]))
        return BodyPlaces(x[:-1], x[-1])

    def motion(q: Joints) -> BodyMotion:
        both = (*links, *tool_link), np.concatenate([offsets, tool_offset])
        moved = point_motion(arm.chain, q, jnp.zeros_like(q), *both)
        return BodyMotion(moved.x[:-1], moved.J[:-1], moved.x[-1], moved.J[-1])

    return PlanBody(
        places, motion, radii, still, np.array(links[still:]) > 0, weights, pairs, arm.q_min, arm.q_max, floor,
        lambda q: tool_frame(arm, q)[0],
    )  # fmt: skip
