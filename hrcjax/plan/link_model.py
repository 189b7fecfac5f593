"""An arm as what its planner checks: spheres along its capsules against obstacles, and pairs of capsules against each other."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hrcjax.plan.body import cover, is_fixed, self_pairs
from hrcjax.robot import Arm

MANY_PAIRS = 64
"""With more pairs of capsules only the nearest of every two links counts."""


@dataclass(frozen=True, eq=False)
class LinkModel:
    """What is checked of an arm. Constant and hashable by identity: close over it."""

    arm: Arm
    spheres: tuple[tuple[int, np.ndarray, np.ndarray], ...]
    """For each link with spheres, from the base on: its number, their centres in its frame (sphere 3) [m], and radii (sphere)
    [m]."""
    pairs: tuple[tuple[int, int], ...]
    """Capsules that must not touch each other, the one nearer to the base first."""
    floor: float | None
    """Height that all links beyond the first keep above; None: there is no floor [m]."""

    @property
    def sphere_links(self) -> np.ndarray:
        """(sphere) the link of each."""
        return np.concatenate([np.full(len(radii), link) for link, _, radii in self.spheres])

    @cached_property
    def pair_rows(self) -> tuple[np.ndarray, ...] | None:
        """For every two links their rows among the pairs, where only the nearest of them counts; None: all pairs count."""
        if len(self.pairs) <= MANY_PAIRS:
            return None
        links = self._links_of_pairs
        return tuple(np.flatnonzero((links == both).all(1)) for both in np.unique(links, axis=0))

    @cached_property
    def _links_of_pairs(self) -> np.ndarray:
        return np.array([[self.arm.capsule_links[k] for k in pair] for pair in self.pairs], int).reshape(-1, 2)

    @property
    def pair_links(self) -> np.ndarray:
        """(pair 2) the links of the pairs that count."""
        links = self._links_of_pairs
        return links if self.pair_rows is None else np.stack([links[rows[0]] for rows in self.pair_rows])

    @property
    def above_floor(self) -> int:
        """The first sphere that must stay above the floor; so must all after it, as they are sorted by link."""
        return int(np.count_nonzero(self.sphere_links <= 0))

    @property
    def radii(self) -> np.ndarray:
        """(sphere) [m]"""
        return np.concatenate([radii for _, _, radii in self.spheres])


def link_model(
    arm: Arm, inflation: float = 0.005, floor: float | None = None, tight: Sequence[tuple[str, str]] = (("forearm", "wrist 2"),),
    whole: bool = False,
) -> LinkModel:  # fmt: skip
    """What is checked of an arm.

    Args:
        inflation: most that a sphere stands out of its capsule: larger means fewer spheres [m].
        floor: height of a floor that all links beyond the first keep above [m]; None: there is none.
        tight: pairs of capsules by name that may overlap.
        whole: whether spheres on the axis of the first joint count: no path changes their distances, so that an optimiser has no
            use for them, but a check has.
    """
    moving = sorted({link for link in arm.capsule_links if link >= 0})
    spheres = []
    for link in moving:
        covers = [
            cover(arm.capsule_a[k], arm.capsule_b[k], arm.capsule_radii[k], inflation)
            for k in range(len(arm.capsule_links))
            if arm.capsule_links[k] == link
        ]
        centers = np.concatenate([points for points, _ in covers])
        radii = np.concatenate([np.full(len(points), radius) for points, radius in covers])
        moves = np.array([whole or not is_fixed(arm, link, at) for at in centers])
        if moves.any():
            spheres.append((link, centers[moves], radii[moves]))
    return LinkModel(arm, tuple(spheres), tuple(self_pairs(arm, tight)), floor)
