"""Speed towards people near a contact over the contact speed of the region that would be met, by MuJoCo and the exact shapes.

The contact speed is F / sqrt(mu k) of the region of the nearest capsule (ISO/TS 15066, eq. A.6), 1/mu = 1/m_H + 1/m_R, with m_R
the reflected mass of the point of the arm in the direction of the person (Khatib 1995): MuJoCo's inertia and Jacobians.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

import mujoco
import numpy as np
from numpy.typing import NDArray

from hrcjax.robot import Arm
from hrcjax.robot.link_spheres import link_spheres
from hrcjax.safety import BODY_REGIONS, BodyRegion, PflParams

NEAR = 0.2
"""Nearer than this a contact can come within the reaction time: 2 m/s for 0.1 s [m]."""
REGIONS_OF = {
    "head": ("skull, forehead", "face"),
    "neck": ("neck",),
    "chest": ("chest", "back, shoulders"),
    "pelvis": ("pelvis", "abdomen"),
    "upper arm": ("upper arm, elbow",),
    "forearm": ("forearm, wrist",),
    "hand": ("hand, fingers",),
    "thigh": ("thigh, knee",),
    "lower leg": ("lower leg",),
}
"""The standard's regions that a capsule of the person may be; the slowest counts."""


def region_speed(capsule: str, mobility: NDArray) -> NDArray:
    """Largest speed of a transient contact with a capsule's region, by the robot's mobility 1/m_R [1/kg] [m/s]."""

    def speed(region: BodyRegion) -> NDArray:
        mu = 1.0 / (1.0 / region.mass + mobility)
        return region.force * region.transient / np.sqrt(mu * region.stiffness)

    return np.min([speed(r) for r in BODY_REGIONS if r.name in REGIONS_OF[capsule]], axis=0)


def slowest_region_speed(mobility: NDArray) -> NDArray:
    """The same of the most sensitive of all regions [m/s]."""
    return np.min([region_speed(capsule, mobility) for capsule in REGIONS_OF], axis=0)


class ContactRatio:
    """Of one arm with what its hand carries."""

    def __init__(self, arm: Arm, pfl: PflParams) -> None:
        """Args: pfl: masses; the payload sits at the tool point."""
        self.arm, self.model, self.data = arm, arm.model, mujoco.MjData(arm.model)
        self.payload, self.rule = float(pfl.payload), 1.0 / (float(pfl.arm_mass) / 2 + float(pfl.payload))
        self.links, self.offsets, self.radii = link_spheres(arm)

    def _jacobian(self, link: int, offset: NDArray) -> tuple[NDArray, NDArray]:
        """Place of a point of a link [m] and its Jacobian [m]."""
        body = int(self.model.jnt_bodyid[link])
        place = self.data.xpos[body] + self.data.xmat[body].reshape(3, 3) @ offset
        J = np.zeros((3, self.model.nv))
        mujoco.mj_jac(self.model, self.data, J, None, place, body)
        return place, J

    def at(
        self, q: NDArray, qd: NDArray, a: NDArray, b: NDArray, radius: NDArray, regions: tuple[str, ...]
    ) -> tuple[float, float, float]:
        """Largest ratio over all points of the arm that are near; 0: none approaches [1].

        To the speed of the nearest capsule's region by the reflected mass; to that of the most sensitive of all by the same; to that by
        the standard's mass.

        Args:
            q: joint positions [rad].
            qd: joint speeds [rad/s].
            a: ends of the person's capsules, (capsule 3) [m].
            b: the other ends [m].
            radius: of the capsules; negative: absent [m].
            regions: of the capsules.
        """
        model, data = self.model, self.data
        data.qpos[:], data.qvel[:] = q, 0.0
        mujoco.mj_forward(model, data)
        M = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, M)
        _, J_tool = self._jacobian(self.arm.tool_link, np.asarray(self.arm.tool_offset))
        inverse = np.linalg.inv(M + self.payload * J_tool.T @ J_tool)
        most = np.zeros(3)
        for link, offset, own in zip(self.links, self.offsets, self.radii, strict=True):
            place, J = self._jacobian(link, offset)
            along = b - a
            part = np.clip(((place - a) * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-12), 0, 1)
            gap = place - a - part[:, None] * along
            distance = np.linalg.norm(gap, axis=-1)
            free = np.where(radius >= 0, distance - radius - own, np.inf)
            k = int(np.argmin(free))
            if free[k] > NEAR or distance[k] < 1e-6:
                continue
            row = J.T @ (-gap[k] / distance[k])
            speed = float(row @ qd)
            mobility = np.asarray(row @ inverse @ row)
            allowed = (
                region_speed(regions[k], mobility), slowest_region_speed(mobility), slowest_region_speed(np.asarray(self.rule))
            )  # fmt: skip
            most = np.maximum(most, speed / np.asarray(allowed))
        return float(most[0]), float(most[1]), float(most[2])

    def over(
        self, q: NDArray, qd: NDArray, near: NDArray, a: NDArray, b: NDArray, radius: NDArray, regions: tuple[str, ...]
    ) -> NDArray:
        """`at` at every tick, (3 time) [1].

        Args:
            q: (time joint) [rad].
            qd: (time joint) [rad/s].
            near: (time) whether a point may be near.
            a: ends of the person's capsules, (time capsule 3) [m].
            b: the other ends [m].
            radius: (time capsule) [m].
            regions: of the capsules.
        """
        found = np.zeros((len(q), 3))
        for t in np.flatnonzero(near):
            found[t] = self.at(q[t], qd[t], a[t], b[t], radius[t], regions)
        return found.T
