"""The arm as spheres that cover its capsules, for many configurations at once in NumPy."""

import numpy as np
from numpy.typing import NDArray

from hrcjax.plan.body import cover, self_pairs, sphere_pairs
from hrcjax.robot import Arm

INFLATION = 0.0125
"""Most that a sphere stands out of its capsule [m]."""
TIGHT = (("forearm", "wrist 2"),)
"""Capsules that may overlap, as in our own planner."""


class ArmSpheres:
    """Where the arm is, and whether it touches itself or the table."""

    def __init__(self, arm: Arm) -> None:
        self.arm, chain = arm, arm.chain
        order = sorted(range(len(arm.capsule_links)), key=lambda k: arm.capsule_links[k])
        covers = {k: cover(arm.capsule_a[k], arm.capsule_b[k], arm.capsule_radii[k], INFLATION) for k in order}
        owner = np.array([k for k in order for _ in covers[k][0]])
        self.radii = np.array([covers[k][1] for k in owner])
        self.links = np.array([arm.capsule_links[k] for k in owner])
        local = np.concatenate([covers[k][0] for k in order])
        self.base = local[self.links < 0]
        self._local = [self._in_joint(i, local[self.links == i]) for i in range(chain.size)]
        self._tool = self._in_joint(arm.tool_link, arm.tool_offset[None])
        self.moving, self.high = self.links >= 0, self.links >= 1
        self.pairs = sphere_pairs(owner, arm.capsule_radii, self_pairs(arm, TIGHT))

    def _in_joint(self, i: int, local: NDArray) -> NDArray:
        return self.arm.chain.link_pos[i] + local @ self.arm.chain.link_rotation[i].T

    def _frames(self, q: NDArray) -> list[tuple[NDArray, NDArray]]:
        """Axes and origin of every joint frame."""
        chain = self.arm.chain
        R, p = np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3))
        frames = []
        c, s = np.cos(q), np.sin(q)
        for i in range(chain.size):
            p = p + R @ chain.pos[i]
            A = R @ chain.rotation[i]
            ci, si = c[:, i, None], s[:, i, None]
            R = np.stack([A[..., 0] * ci + A[..., 1] * si, A[..., 1] * ci - A[..., 0] * si, A[..., 2]], axis=-1)
            frames.append((R, p))
        return frames

    def centres(self, q: NDArray) -> NDArray:
        """(configuration sphere 3) middles of all spheres; base first [m]

        Args:
            q: (configuration joint) [rad].
        """  # fmt: skip
        parts = [np.broadcast_to(self.base, (len(q), *self.base.shape))]
        for (R, p), local in zip(self._frames(q), self._local, strict=True):
            parts.append(p[:, None] + local @ R.swapaxes(-1, -2))
        return np.concatenate(parts, axis=1)

    def tool(self, q: NDArray) -> NDArray:
        """(configuration 3) tool points [m]"""
        R, p = self._frames(q)[self.arm.tool_link]
        return p + (self._tool @ R.swapaxes(-1, -2))[:, 0]

    def at_ease(self, q: NDArray, centres: NDArray) -> NDArray:
        """(configuration) whether joints are in their ranges, links apart, and all but the first above the table"""
        arm, pairs = self.arm, self.pairs
        within = ((q >= arm.q_min) & (q <= arm.q_max)).all(1)
        above = (centres[:, self.high, 2] > self.radii[self.high]).all(1)
        gap = centres[:, : pairs.rows, None] - centres[:, None, pairs.column :]
        apart = (np.einsum("nijk,nijk->nij", gap, gap) >= pairs.apart**2).all((1, 2))
        return within & above & apart
