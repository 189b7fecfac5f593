"""Whether frames that see the same surfaces put them into the same place, and if not, whether another reading of their poses
would: inverted (world to camera), or with the quaternion's scalar first."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from hrcjax.io.recordings.frame import InputFrame, Intrinsics

MOST = 8
"""Frames that are compared."""
MOVED = (0.02, 0.02)
"""A frame is compared if its camera has moved or turned this much since the last one [m], [rad]; where there are more than
MOST of them every second one goes, and the others must have moved twice as much."""
FARTHEST = 8.0
"""Up to so many times as much."""
NEIGHBOURS = 2
"""Each of them with so many that follow."""
PIXELS = 2000
"""Of a frame that are compared, about."""
LIMITS = (0.1, 10.0)
"""Of depth [m]."""
SHARE = 0.3
"""Of the pixels that must fall into the other image, onto a measurement."""
CLEAR = 0.01
"""Relative disagreement above which another reading is asked for [1]."""
BETTER, GOOD = 0.5, 0.03
"""Another reading is named if it disagrees by less than this share, and by less than this in all [1]."""
WRONG = 0.05
"""Relative disagreement that is told even if no other reading is better [1]."""

Pose = tuple[np.ndarray, np.ndarray]  # rotation (3, 3), position (3,) [m]


def inverted(pose: Pose) -> Pose:
    """The pose if the recording tells camera from world."""
    rotation, position = pose
    return rotation.T, -rotation.T @ position


def scalar_first(pose: Pose) -> Pose:
    """The pose if the recording's quaternion is w x y z, read as x y z w."""
    rotation, position = pose
    w, x, y, z = Rotation.from_matrix(rotation).as_quat()
    return Rotation.from_quat([x, y, z, w]).as_matrix(), position


READINGS: dict[str, Callable[[Pose], Pose]] = {
    "inverted (world to camera)": inverted,
    "scalar first (qw qx qy qz)": scalar_first,
    "scalar first (qw qx qy qz) and inverted (world to camera)": lambda pose: inverted(scalar_first(pose)),
}
"""In words, and what the pose would be."""


@dataclass(frozen=True, eq=False)
class _Kept:
    points: np.ndarray
    """In the camera's axes (point, 3) [m]."""
    depth: np.ndarray
    intrinsics: Intrinsics
    pose: Pose


class Agreement:
    """Compares some depth images of each camera."""

    def __init__(self) -> None:
        self._kept: dict[str, list[_Kept]] = {}
        self._moved: dict[str, float] = {}

    def add(self, frame: InputFrame) -> None:
        """Keeps the frame if it is a depth image and its camera has moved."""
        kept = self._kept.setdefault(frame.camera, [])
        if frame.depth is None or frame.intrinsics is None:
            return
        times = self._moved.setdefault(frame.camera, 1.0)
        pose = frame.rotation, frame.position
        if kept:
            rotation, position = kept[-1].pose
            turn = float(np.linalg.norm(Rotation.from_matrix(rotation.T @ pose[0]).as_rotvec()))
            if np.linalg.norm(position - pose[1]) < times * MOVED[0] and turn < times * MOVED[1]:
                return
        if len(kept) == MOST:
            if times >= FARTHEST:
                return
            del kept[1::2]
            self._moved[frame.camera] = 2 * times
        kept.append(_Kept(_some_points(frame.depth, frame.intrinsics), frame.depth, frame.intrinsics, pose))

    def disagreement(self, reading: Callable[[Pose], Pose] | None = None) -> tuple[float, float]:
        """Median distance along the ray between what one frame saw and what another one sees there [m], and the same over the
        depth [1]; infinity where hardly any two frames see the same place; NaN if too few frames were kept."""
        pairs = [
            (one, two)
            for kept in self._kept.values()
            for (i, one), (j, two) in combinations(enumerate(kept), 2)
            if j - i <= NEIGHBOURS
        ]
        if not pairs:
            return np.nan, np.nan
        found = np.array([_disagreement(*pair, reading or (lambda pose: pose)) for pair in pairs])
        return float(np.median(found[:, 0])), float(np.median(found[:, 1]))

    def line(self) -> str:
        """What is to be said; "": nothing."""
        here, relative = self.disagreement()
        if not relative > CLEAR:
            return ""
        others = {name: self.disagreement(reading) for name, reading in READINGS.items()}
        name, (there, least) = min(others.items(), key=lambda item: item[1][1])
        as_given = "hardly any two frames see the same place" if np.isinf(here) else f"frames disagree by {here:.3f} m"
        if least < min(BETTER * relative, GOOD):
            return (
                f"poses: {as_given} as they are read (camera to world, qx qy qz qw), by {there:.3f} m if they are "
                f"{name}: then convert them first"
            )
        if relative > WRONG:
            return f"{as_given} ({100 * relative:.0f} % of the depth, median): intrinsics, depth scale or poses may be wrong"
        return ""


def _some_points(depth: np.ndarray, camera: Intrinsics) -> np.ndarray:
    step = max(1, int(np.sqrt(depth.size / PIXELS)))
    z = depth[::step, ::step].astype(np.float64)
    v, u = np.mgrid[0 : depth.shape[0] : step, 0 : depth.shape[1] : step]
    points = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z], axis=-1)
    return points[(z > LIMITS[0]) & (z < LIMITS[1])]


def _disagreement(one: _Kept, two: _Kept, reading: Callable[[Pose], Pose]) -> tuple[float, float]:
    (rotation, position), (other, there) = reading(one.pose), reading(two.pose)
    x, y, z = ((one.points @ rotation.T + position - there) @ other).T
    camera, safe = two.intrinsics, np.where(z > LIMITS[0], z, 1.0)
    u, v = np.rint(x / safe * camera.fx + camera.cx), np.rint(y / safe * camera.fy + camera.cy)
    inside = (z > LIMITS[0]) & (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    seen = two.depth[np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)]
    both = inside & (seen > 0)
    if both.sum() < SHARE * max(len(z), 1):
        return np.inf, np.inf
    difference = np.abs(z - seen)[both]
    return float(np.median(difference)), float(np.median(difference / z[both]))
