"""Rigid poses: from numbers, composition, interpolation in time."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

NORM_TOLERANCE = 0.01  # of a quaternion's norm and of the entries of R^T R; files with four decimals are far below


@dataclass(frozen=True, eq=False)
class Pose:
    """Rotation, float64 (3, 3), and position, float64 (3,) [m]: from the axes of a child into those of its parent."""

    rotation: np.ndarray
    position: np.ndarray

    def __matmul__(self, child: "Pose") -> "Pose":
        """Composition: from the child's child into the parent."""
        return Pose(self.rotation @ child.rotation, self.rotation @ child.position + self.position)

    def inverse(self) -> "Pose":
        """The inverse: from the parent into the child."""
        return Pose(self.rotation.T, -self.rotation.T @ self.position)


def identity() -> Pose:
    """The identity pose."""
    return Pose(np.eye(3), np.zeros(3))


def fault_of_numbers(numbers: np.ndarray) -> str:
    """The error in tx ty tz qx qy qz qw, (7,); "": none."""
    if not np.isfinite(numbers).all():
        return "a number is not finite"
    norm = float(np.linalg.norm(numbers[3:]))
    if abs(norm - 1) > NORM_TOLERANCE:
        return f"the norm of the quaternion is {norm:.4g}, not 1"
    return ""


def fault_of_rotation(rotation: np.ndarray) -> str:
    """The error in a rotation matrix (3, 3); "": none."""
    if not np.isfinite(rotation).all():
        return "a number of the rotation is not finite"
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > NORM_TOLERANCE or np.linalg.det(rotation) < 0:
        return "the rotation is not an orthonormal right-handed matrix"
    return ""


def pose_of(numbers: np.ndarray) -> Pose:
    """The pose of tx ty tz qx qy qz qw, (7,) [m, unit quaternion]."""
    return Pose(Rotation.from_quat(numbers[3:]).as_matrix(), np.array(numbers[:3], np.float64))


class Trajectory:
    """Poses over time: linear interpolation of position, spherical linear interpolation of rotation."""

    def __init__(self, rows: np.ndarray) -> None:
        """Takes rows `stamp tx ty tz qx qy qz qw` (pose, 8) [s, m, unit quaternion], at least one, in any order."""
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        self.stamps = rows[:, 0]
        self._numbers = rows[:, 1:]

    def at(self, stamp: float, tolerance: float) -> Pose | None:
        """The pose at `stamp` [s], or None if the nearest recorded one is further away than `tolerance` [s].

        Interpolated between the neighbours; held before the first and after the last.
        """
        upper = int(np.searchsorted(self.stamps, stamp))
        lower, upper = max(upper - 1, 0), min(upper, len(self.stamps) - 1)
        before, after = self.stamps[lower], self.stamps[upper]
        if not min(abs(stamp - before), abs(stamp - after)) <= tolerance:
            return None
        fraction = float(np.clip((stamp - before) / (after - before), 0, 1)) if after > before else 0.0
        pair = self._numbers[[lower, upper]]
        rotation = Slerp([0, 1], Rotation.from_quat(pair[:, 3:]))(fraction).as_matrix()
        return Pose(rotation, (1 - fraction) * pair[0, :3] + fraction * pair[1, :3])
