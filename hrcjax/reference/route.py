"""The route of the arm, with the forward kinematics of C MuJoCo; as `hrcjax.sim.route`."""

import numpy as np
from numpy.typing import NDArray

from hrcjax.plan import PotentialParams
from hrcjax.reference.arm import SerialArm
from hrcjax.reference.curve import Curve
from hrcjax.sim import Cell
from hrcjax.sim.route import JOINT_LENGTH


class SerialRoute:
    """Reference motion of tool and joints along a path."""

    def __init__(self, cell: Cell, waypoints: NDArray, joints: NDArray, ratio: NDArray | None = None) -> None:
        """Args: waypoints: of the tool (waypoint 3) [m]; joints: (waypoint joint) [rad]; ratio: U_rep / U_att (waypoint,) [1]."""
        arm = SerialArm(cell)
        tool = []
        for q in joints:
            arm.reset(q)
            tool.append(arm.motion().x[-3:].ravel())
        measured = np.hstack([waypoints, JOINT_LENGTH * joints])
        self.curve = Curve(np.hstack([tool, joints]), measured)
        self.ratio = np.zeros(len(joints)) if ratio is None else np.asarray(ratio, np.float64)
        self.end = np.reshape(tool[-1], (3, 3))

    def pace(self, potential: PotentialParams, s: float) -> float:
        """Speed of the law of motion after the length s [m/s]."""
        places = np.linspace(0.0, self.curve.length, len(self.ratio))
        return law_speed(potential, self.curve.length - s, float(np.interp(s, places, self.ratio)))


def law_speed(potential: PotentialParams, remaining: float, ratio: float) -> float:
    """30 K_att min(r, d*) / (1 + U_rep / U_att) [m/s]."""
    return 30.0 * potential.k_att * min(remaining, potential.d_star) / (1.0 + ratio)
