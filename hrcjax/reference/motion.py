"""Kinematics of points and joint limits: NumPy twins of `PointMotion` and `JointLimits`."""

from typing import NamedTuple

from numpy.typing import NDArray


class Motion(NamedTuple):
    """Positions of points and their differential kinematics: xdd = J qdd + Jd_qd."""

    x: NDArray
    """Positions, (point 3) [m]."""
    xd: NDArray
    """Velocities, (point 3) [m/s]."""
    J: NDArray
    """Jacobians, (point 3 joint) [m/rad]."""
    Jd_qd: NDArray
    """Accelerations at qdd = 0, (point 3) [m/s^2]."""


class Limits(NamedTuple):
    """Limits of the joints, each (joint)."""

    q_min: NDArray
    """[rad]"""
    q_max: NDArray
    """[rad]"""
    qd_max: NDArray
    """[rad/s]"""
    qdd_max: NDArray
    """[rad/s^2]"""
