"""One recorded frame: a measurement of a depth camera, and its pose."""

from dataclasses import dataclass

import numpy as np

from hrcjax.lab.errors import UsageError


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera without distortion [px].

    Raises:
        UsageError: a focal length that is not positive, a number that is not finite, a size below one pixel.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        numbers = (self.fx, self.fy, self.cx, self.cy)
        if not np.isfinite(numbers).all() or min(self.fx, self.fy) <= 0 or min(self.width, self.height) < 1:
            raise UsageError(
                f"intrinsics fx {self.fx} fy {self.fy} cx {self.cx} cy {self.cy} of {self.width}x{self.height} pixels: "
                "accepted are finite numbers with fx, fy > 0 and a size of at least one pixel"
            )


@dataclass(frozen=True, eq=False)
class InputFrame:
    """A depth image or a cloud with the pose of the sensor. Exactly one of `depth` and `cloud` is given.

    Camera axes: x right, y down, z forward. A cloud may be in other axes (those of a lidar, or a PLY file in world axes);
    `rotation` and `position` are the pose of the cloud's axes.

    Attributes:
        stamp: time [s].
        camera: name of the camera, "" if there is only one.
        depth: float32 (height, width), distance along z [m]; 0: no measurement.
        cloud: float32 (point, 3) in the axes of the sensor [m], all finite.
        intrinsics: given with depth.
        rotation: float64 (3, 3), world from camera.
        position: float64 (3,), of the camera in the world [m].
        timed: whether the stamp was recorded; False: it was generated from a rate, so speeds are not checked.

    Raises:
        ValueError: both or none of depth and cloud, or an array of another shape.
    """

    stamp: float
    camera: str
    depth: np.ndarray | None
    cloud: np.ndarray | None
    intrinsics: Intrinsics | None
    rotation: np.ndarray
    position: np.ndarray
    timed: bool = True

    def __post_init__(self) -> None:
        if (self.depth is None) == (self.cloud is None):
            raise ValueError("a frame has exactly one of depth and cloud")
        if self.rotation.shape != (3, 3) or self.position.shape != (3,):
            raise ValueError("the pose of a frame is a rotation (3, 3) and a position (3,)")
        if self.cloud is not None and (self.cloud.ndim != 2 or self.cloud.shape[1] != 3):
            raise ValueError(f"a cloud is (point, 3), not {self.cloud.shape}")
        if self.depth is not None:
            size = None if self.intrinsics is None else (self.intrinsics.height, self.intrinsics.width)
            if self.depth.shape != size:
                raise ValueError(f"depth has the shape {self.depth.shape}, its intrinsics {size}")
