"""Joint positions from offsets and channels of a hierarchy of joints.

Where BVH is ambiguous, files are read as by Blender, MotionBuilder and the library bvhio: rotations are applied in the order of
their channels, position channels of a joint replace its OFFSET.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from hrcjax.typing import Float


@dataclass(frozen=True)
class Joint:
    """One joint of the hierarchy; parents precede their children."""

    name: str
    parent: int
    """Index of the parent; -1: none."""
    offset: Float[np.ndarray, "3"]
    """Offset from the parent in the parent's frame [file's unit]."""
    channels: tuple[tuple[str, str], ...]
    """Axis X, Y or Z and "position" or "rotation" of each channel, in order."""


@dataclass(frozen=True)
class RecordedJoints:
    """A hierarchy of joints and its channel values, frame by frame."""

    joints: tuple[Joint, ...]
    values: Float[np.ndarray, "frame channel"]
    """Channel values [file's unit, degrees]."""
    rate: float
    """Frame rate [Hz]."""

    def positions(self, frames: int | None = None) -> Float[np.ndarray, "frame joint 3"]:
        """Positions of all joints in the file's axes in the first `frames` frames [file's unit].

        Position channels of a joint other than the root replace its OFFSET; where their values are far smaller than the
        OFFSET, they are displacements from it.
        """
        rows = self.values[:frames]
        places = np.empty((len(rows), len(self.joints), 3))
        turns: list[Rotation] = []
        first = 0
        for j, joint in enumerate(self.joints):
            columns = rows[:, first : first + len(joint.channels)]
            first += len(joint.channels)
            local = np.tile(joint.offset, (len(rows), 1))
            moved = [(column, "XYZ".index(axis)) for column, (axis, kind) in zip(columns.T, joint.channels, strict=True) if kind == "position"]  # fmt: skip
            for column, axis in moved:
                local[:, axis] = column
            if moved and joint.parent >= 0:
                size = np.median(np.linalg.norm([column for column, _ in moved], axis=0))
                if size < 0.5 * np.linalg.norm([joint.offset[axis] for _, axis in moved]):
                    for _, axis in moved:
                        local[:, axis] += joint.offset[axis]
            turning = [i for i, (_, kind) in enumerate(joint.channels) if kind == "rotation"]
            order = "".join(joint.channels[i][0] for i in turning)
            turn = Rotation.from_euler(order, columns[:, turning], degrees=True) if turning else None
            if joint.parent < 0:
                places[:, j] = local
            else:
                above = turns[joint.parent]
                places[:, j] = places[:, joint.parent] + above.apply(local)
                turn = above if turn is None else above * turn
            turns.append(Rotation.identity() if turn is None else turn)
        return places

    def rest_pose(self) -> Float[np.ndarray, "1 joint 3"]:
        """Positions of all joints with zero rotations [file's unit]."""
        places = np.zeros((1, len(self.joints), 3))
        for j, joint in enumerate(self.joints):
            places[:, j] = joint.offset + (places[:, joint.parent] if joint.parent >= 0 else 0.0)
        return places
