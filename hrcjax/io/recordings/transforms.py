"""Trees of moving coordinate frames, as in ROS's tf and tf_static."""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from hrcjax.io.recordings.bag_messages import frame_name, pose_row, stamp_of
from hrcjax.io.recordings.pose import Pose, Trajectory, fault_of_numbers, identity
from hrcjax.lab.errors import UsageError


class NoPoseError(LookupError):
    """The pose of a frame is not known at a time; the message names frame and reason."""


class TransformTree:
    """Poses of frames relative to their parents over time."""

    def __init__(self) -> None:
        self.faults: list[str] = []
        self._rows: dict[str, dict[str, list[tuple[float, ...]]]] = {}  # by child, then by parent
        self._bad: dict[tuple[str, str], int] = {}
        self._static: set[tuple[str, str]] = set()
        self._trajectories: dict[tuple[str, str], Trajectory] = {}

    def add(self, transforms: Iterable, static: bool) -> None:
        """Adds geometry_msgs/TransformStamped; of a static transform the last one is used for all times."""
        for item in transforms:
            child, parent = frame_name(item.child_frame_id), frame_name(item.header.frame_id)
            row = pose_row(stamp_of(item.header), item.transform.translation, item.transform.rotation)
            if fault_of_numbers(np.array(row[1:])):
                self._bad[child, parent] = self._bad.get((child, parent), 0) + 1
                continue
            rows = self._rows.setdefault(child, {}).setdefault(parent, [])
            if static:
                rows.clear()
                self._static.add((child, parent))
            elif (child, parent) in self._static:
                continue
            rows.append(row)

    def close(self) -> None:
        """To be called after the last transform: builds the trajectories and lists invalid transforms in `faults`."""
        for child, parents in self._rows.items():
            for parent, rows in parents.items():
                self._trajectories[child, parent] = Trajectory(np.array(rows, np.float64))
        self.faults = [
            f"tf {parent} -> {child}: {count} transforms are not finite or have no unit quaternion"
            for (child, parent), count in self._bad.items()
        ]

    def chain(self, frame: str) -> list[str]:
        """The frame, its parent, and so on up to the root.

        Raises:
            UsageError: a frame with two parents, or one that is its own ancestor.
        """
        names = [frame]
        while parents := self._rows.get(names[-1]):
            if len(parents) > 1:
                raise UsageError(
                    f"frame {names[-1]} has the parents {', '.join(sorted(parents))} in tf: accepted is one parent per frame"
                )
            parent = next(iter(parents))
            if parent in names:
                raise UsageError(f"tf has a cycle at frame {parent}: accepted is a tree of frames")
            names.append(parent)
        return names

    def pose(self, world: str, frame: str, stamp: float, tolerance: float) -> Pose:
        """Pose of `frame` in `world` at `stamp` [s], interpolated.

        Raises:
            NoPoseError: no common root, or a moving transform between them without a record within `tolerance` [s].
            UsageError: see `chain`.
        """
        up, down = self.chain(frame), self.chain(world)
        common = next((name for name in up if name in down), None)
        if common is None:
            raise NoPoseError(f"tf does not connect {frame} to {world}")
        pose = self._climb(down[: down.index(common) + 1], stamp, tolerance).inverse()
        return pose @ self._climb(up[: up.index(common) + 1], stamp, tolerance)

    def _climb(self, names: list[str], stamp: float, tolerance: float) -> Pose:
        """Pose of the first frame of a chain in the last."""
        pose = identity()
        for child, parent in pairwise(names):
            static = (child, parent) in self._static
            step = self._trajectories[child, parent].at(stamp, np.inf if static else tolerance)
            if step is None:
                raise NoPoseError(f"tf {parent} -> {child} has nothing within {tolerance:g} s")
            pose = step @ pose
        return pose
