"""The strongest stop along a motion, within the joints' accelerations."""

import numpy as np
from numpy.typing import NDArray


def brake(qd: NDArray, qdd: NDArray, rate: float, limits: NDArray, dt: float) -> float:
    """Rate of change of the pace at which a motion is played, to stop on its path [1/s].

    Played at pace v, a motion with speeds qd and accelerations qdd has the accelerations qdd v^2 + qd v'. The least v' that
    keeps every joint within its limits; if no v' does, the one that exceeds them least is near the middle of what two joints
    ask. Never above 0, and no more than ends the motion in this period.

    Args:
        qd: speeds of the motion at pace 1 [rad/s].
        qdd: its accelerations [rad/s^2].
        rate: pace now, 0 to 1 [1].
        limits: largest accelerations [rad/s^2].
        dt: control period [s].
    """  # fmt: skip
    moves = np.abs(qd) > 1e-9
    if not moves.any():
        return -rate / dt
    bent = qdd[moves] * rate**2
    one, two = (-limits[moves] - bent) / qd[moves], (limits[moves] - bent) / qd[moves]
    least, most = np.minimum(one, two).max(), np.maximum(one, two).min()
    wanted = least if least <= most else (least + most) / 2
    return float(max(min(wanted, 0.0), -rate / dt))
