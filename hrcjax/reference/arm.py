"""The arm in C MuJoCo: motion of the control points, and the servo by computed torque."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

import copy

import mujoco
import numpy as np
from numpy.typing import NDArray

from hrcjax.reference.motion import Motion
from hrcjax.sim import Cell


def spin(v: NDArray) -> NDArray:
    """The matrices of the cross product v x, (... 3 3)."""
    S = np.zeros((*v.shape, 3))
    S[..., 2, 1], S[..., 0, 2], S[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return S - S.swapaxes(-1, -2)


class SerialArm:
    """One arm with its state and servo rate."""

    def __init__(self, cell: Cell) -> None:
        """A copy of the cell's model, stepped at the servo's rate."""
        arm = cell.arm
        self.model = copy.copy(arm.model)
        self.model.opt.timestep = self.h = cell.dt / cell.substeps
        self.substeps, self.top = cell.substeps, arm.tau_max
        self.data = mujoco.MjData(self.model)
        links = (*arm.control_links, *(arm.tool_link,) * 3)
        used, self.row = np.unique(links, return_inverse=True)
        self.bodies = [int(self.model.jnt_bodyid[link]) for link in used]
        self.offsets = cell.control_offsets[:, :, None]
        self.jacobians = np.zeros((4, len(used), 3, self.model.nv))

    def reset(self, q: NDArray) -> None:
        """Sets the arm at rest at q [rad]."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = q
        mujoco.mj_step1(self.model, self.data)

    def motion(self) -> Motion:
        """Motion of the control points and, last, of the three tool points."""
        model, data, row = self.model, self.data, self.row
        position, rotation, position_dot, rotation_dot = self.jacobians
        for k, body in enumerate(self.bodies):
            origin = data.xpos[body]
            mujoco.mj_jac(model, data, position[k], rotation[k], origin, body)
            mujoco.mj_jacDot(model, data, position_dot[k], rotation_dot[k], origin, body)
        qd = data.qvel
        R, origins = data.xmat[self.bodies].reshape(-1, 3, 3), data.xpos[self.bodies]
        around, turning = spin(rotation @ qd), spin(rotation_dot @ qd)
        r = R[row] @ self.offsets
        J = position[row] - spin(r[..., 0]) @ rotation[row]
        return Motion(
            x=origins[row] + r[..., 0],
            xd=J @ qd,
            J=J,
            Jd_qd=(position_dot @ qd)[row] + ((turning + around @ around)[row] @ r)[..., 0],
        )

    def servo(self, gain: float, qdd: NDArray) -> tuple[NDArray, bool, bool]:
        """Moves the arm by one control period under computed torque with velocity feedback at every substep.

        Args:
            gain: velocity feedback [1/s].
            qdd: acceleration commanded [rad/s^2].

        Returns:
            the torque at the start [N m], whether a torque was saturated, whether one was not finite.
        """
        model, data, top = self.model, self.data, self.top
        start, first = data.qvel.copy(), np.zeros_like(qdd)
        tau, clipped, broken = np.zeros_like(qdd), False, False
        for k in range(self.substeps):
            mujoco.mj_mulM(model, data, tau, qdd + gain * (start + qdd * (k * self.h) - data.qvel))
            tau += data.qfrc_bias
            tau -= data.qfrc_passive
            if not np.isfinite(tau).all():
                broken, tau = True, self._weight()
            applied = np.minimum(np.maximum(tau, -top), top)
            clipped = clipped or bool((applied != tau).any())
            data.qfrc_applied[:] = applied
            if k == 0:
                first = applied
            mujoco.mj_step2(model, data)
            mujoco.mj_step1(model, data)
        return first, clipped, broken

    def _weight(self) -> NDArray:
        """Gravity compensation torques [N m]."""
        rest = mujoco.MjData(self.model)
        rest.qpos[:] = self.data.qpos
        mujoco.mj_forward(self.model, rest)
        return rest.qfrc_bias.copy()
