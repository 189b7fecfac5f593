"""From offsets and channels of a hierarchy of joints to positions.

BVH leaves some of it open, which is read as Blender, MotionBuilder and the library bvhio do: rotations are applied in the
order of their channels, positions of a joint take the place of its OFFSET.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from hrcjax.typing import Float


@dataclass(frozen=True)
class Joint:
    """One joint of the hierarchy; every parent stands before its children."""

    name: str
    parent: int
    """Index of the parent; -1: none."""
    offset: Float[np.ndarray, "3"]
    """From the parent, in the parent's frame [file's unit]."""
    channels: tuple[tuple[str, str], ...]
    """Axis X, Y or Z and "position" or "rotation" of its numbers in a row, in their order."""


@dataclass(frozen=True)
class RecordedJoints:
    """A hierarchy of joints and its numbers, frame by frame."""

    joints: tuple[Joint, ...]
    values: Float[np.ndarray, "frame channel"]
    """Rows of numbers [file's unit, degrees]."""
    rate: float
    """Frames a second [Hz]."""

    def positions(self, frames: int | None = None) -> Float[np.ndarray, "frame joint 3"]:
        """Of all joints in the file's own axes, of the first `frames` frames [file's unit].

        The numbers of a joint other than the root that has position channels stand for its OFFSET; where they are far
        smaller than the OFFSET, they are displacements from it.
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
        """Positions of all joints where nothing is turned [file's unit]."""
        places = np.zeros((1, len(self.joints), 3))
        for j, joint in enumerate(self.joints):
            places[:, j] = joint.offset + (places[:, joint.parent] if joint.parent >= 0 else 0.0)
        return places
