"""Spheres that stand for the capsules of an arm's moving links, for measures of every point of them."""

import numpy as np

from hrcjax.robot.body import Arm

GAP = 0.03
"""Largest distance between two neighbours of the spheres of a capsule [m]."""


def link_spheres(arm: Arm) -> tuple[tuple[int, ...], np.ndarray, np.ndarray]:
    """Links, offsets (sphere 3) [m] and radii (sphere) [m] of spheres along the capsules that the control points cover."""
    links, offsets, radii = [], [], []
    for k in np.flatnonzero(np.asarray(arm.capsule_links) >= min(arm.control_links)):
        a, b = np.asarray(arm.capsule_a[k]), np.asarray(arm.capsule_b[k])
        count = max(int(np.ceil(np.linalg.norm(b - a) / GAP)) + 1, 2)
        offsets.append(np.linspace(a, b, count))
        links += [int(arm.capsule_links[k])] * count
        radii += [float(arm.capsule_radii[k])] * count
    return tuple(links), np.concatenate(offsets), np.asarray(radii)
