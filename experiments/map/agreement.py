"""Consistency of poses: whether overlapping depth images agree, and if not, whether they would under another pose convention:
inverted (world to camera), or quaternions with the scalar first."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.spatial.transform import Rotation

from hrcjax.io.recordings.frame import InputFrame, Intrinsics

MOST = 8
"""Frames that are compared."""
MOVED = (0.02, 0.02)
"""A frame is compared if its camera has moved or turned this much since the last compared frame [m], [rad]. Once there are
MOST frames, every second one is dropped and the threshold doubles."""
FARTHEST = 8.0
"""Largest factor of that threshold [1]."""
NEIGHBOURS = 2
"""Each frame is compared with this many later ones."""
PIXELS = 2000
"""Pixels of a frame that are compared, approximately."""
LIMITS = (0.1, 10.0)
"""Range of depth that is compared [m]."""
SHARE = 0.3
"""Least share of pixels that project onto a measurement of the other image [1]."""
CLEAR = 0.01
"""Relative disagreement above which other pose conventions are tested [1]."""
BETTER, GOOD = 0.5, 0.03
"""Another convention is reported if its disagreement is below this share of the given one's, and below this value [1]."""
WRONG = 0.05
"""Relative disagreement that is reported even if no other convention is better [1]."""

Pose = tuple[np.ndarray, np.ndarray]  # rotation (3, 3), position (3,) [m]


def inverted(pose: Pose) -> Pose:
    """The pose if the recording holds world-to-camera poses."""
    rotation, position = pose
    return rotation.T, -rotation.T @ position


def scalar_first(pose: Pose) -> Pose:
    """The pose if a quaternion w x y z was read as x y z w."""
    rotation, position = pose
    w, x, y, z = Rotation.from_matrix(rotation).as_quat()
    return Rotation.from_quat([x, y, z, w]).as_matrix(), position


READINGS: dict[str, Callable[[Pose], Pose]] = {
    "inverted (world to camera)": inverted,
    "scalar first (qw qx qy qz)": scalar_first,
    "scalar first (qw qx qy qz) and inverted (world to camera)": lambda pose: inverted(scalar_first(pose)),
}
"""Pose convention in words -> the pose under it."""


@dataclass(frozen=True, eq=False)
class _Kept:
    points: np.ndarray
    """Points in camera axes (point, 3) [m]."""
    depth: np.ndarray
    intrinsics: Intrinsics
    pose: Pose


class Agreement:
    """Compares a few depth images of each camera with each other."""

    def __init__(self) -> None:
        self._kept: dict[str, list[_Kept]] = {}
        self._moved: dict[str, float] = {}

    def add(self, frame: InputFrame) -> None:
        """Keeps the frame for comparison if it is a depth image and its camera has moved."""
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
        """Median depth difference between the points of one frame, projected into another, and that frame's measurements [m], and
        the same relative to the depth [1]; infinity where the frames do not overlap; NaN if too few frames were kept."""
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
        """The warning; "": none."""
        here, relative = self.disagreement()
        if not relative > CLEAR:
            return ""
        others = {name: self.disagreement(reading) for name, reading in READINGS.items()}
        name, (there, least) = min(others.items(), key=lambda item: item[1][1])
        as_given = "hardly any two frames overlap" if np.isinf(here) else f"frames disagree by {here:.3f} m"
        if least < min(BETTER * relative, GOOD):
            return (
                f"poses: {as_given} with the poses as read (camera to world, qx qy qz qw), and by {there:.3f} m if they are "
                f"{name}; convert the poses first"
            )
        if relative > WRONG:
            return f"{as_given} ({100 * relative:.0f} % of the depth, median): check intrinsics, depth scale and poses"
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
