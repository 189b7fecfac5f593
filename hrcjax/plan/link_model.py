"""An arm as what its planner checks: spheres along its capsules against obstacles, and pairs of capsules against each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcjax.plan.body import cover, is_fixed, self_pairs
from hrcjax.robot import Arm


@dataclass(frozen=True, eq=False)
class LinkModel:
    """What is checked of an arm. Constant and hashable by identity: close over it."""

    arm: Arm
    spheres: tuple[tuple[int, np.ndarray, np.ndarray], ...]
    """For each link with spheres that move, from the base on: its number, their centres in its frame (sphere 3) [m], and
    radii (sphere) [m]."""
    pairs: tuple[tuple[int, int], ...]
    """Capsules that must not touch each other, the one nearer to the base first."""
    floor: float | None
    """Height that all links beyond the first keep above; None: there is no floor [m]."""

    @property
    def sphere_links(self) -> np.ndarray:
        """(sphere) the link of each."""
        return np.concatenate([np.full(len(radii), link) for link, _, radii in self.spheres])

    @property
    def radii(self) -> np.ndarray:
        """(sphere) [m]"""
        return np.concatenate([radii for _, _, radii in self.spheres])


def link_model(
    arm: Arm, inflation: float = 0.005, floor: float | None = None, tight: Sequence[tuple[str, str]] = (("forearm", "wrist 2"),)
) -> LinkModel:  # fmt: skip
    """What is checked of an arm.

    Args:
        inflation: most that a sphere stands out of its capsule: larger means fewer spheres [m].
        floor: height of a floor that all links beyond the first keep above [m]; None: there is none.
        tight: pairs of capsules by name that may overlap.
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
        moves = np.array([not is_fixed(arm, link, at) for at in centers])
        if moves.any():
            spheres.append((link, centers[moves], radii[moves]))
    return LinkModel(arm, tuple(spheres), tuple(self_pairs(arm, tight)), floor)
