"""ROS messages as arrays: depth images, camera parameters, point clouds, poses."""

from typing import Any

import numpy as np

from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.io.recordings.images import clean_depth
from hrcjax.io.recordings.lens import Lens, lens_of

DEPTH_ENCODINGS = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}
CLOUD_TYPES = {7: "f4", 8: "f8"}  # FLOAT32 and FLOAT64 of sensor_msgs/PointField
PER_METRE = 1000.0  # of integer images; floating-point images are in metres


class MessageError(ValueError):
    """A message whose content does not match its type."""


def frame_name(name: str) -> str:
    """A frame name without the leading slash of old recordings."""
    return name.lstrip("/")


def stamp_of(header: Any) -> float:
    """Time of a message [s]."""
    return header.stamp.sec + 1e-9 * header.stamp.nanosec


def pose_row(stamp: float, position: Any, orientation: Any) -> tuple[float, ...]:
    """stamp tx ty tz qx qy qz qw [s, m, unit quaternion]."""
    q = orientation
    return (stamp, position.x, position.y, position.z, q.x, q.y, q.z, q.w)


def depth_of(image: Any, per_metre: float | None) -> np.ndarray:
    """Depth of a sensor_msgs/Image, float32 (height, width) [m]; 0: no measurement.

    Args:
        image: of encoding 16UC1, mono16 or 32FC1.
        per_metre: units per metre; if None 1000, for 32FC1 1.

    Raises:
        MessageError: another encoding, or fewer bytes than the size needs.
    """
    kind = DEPTH_ENCODINGS.get(image.encoding)
    if kind is None:
        raise MessageError(f"encoding {image.encoding}, accepted are {', '.join(DEPTH_ENCODINGS)}")
    dtype = np.dtype((">" if image.is_bigendian else "<") + kind)
    raw = _grid(image.data, dtype, image.height, image.width, image.step, dtype.itemsize)
    return clean_depth(raw / (per_metre or (1.0 if kind == "f4" else PER_METRE)))


def pinhole_of(info: Any, rectified: bool) -> tuple[Intrinsics, Lens | None]:
    """The intrinsics of a sensor_msgs/CameraInfo, and the distortion of its images; None: no distortion.

    Rectified images and lenses without distortion use the matrix P, or K where P is empty; others use K.

    Args:
        rectified: whether the images are rectified; the message then still has the distortion of the raw images.

    Raises:
        UsageError: a camera that is not calibrated, an unknown distortion model.
    """

    def field(name: str) -> Any:
        return getattr(info, name.upper()) if hasattr(info, name.upper()) else getattr(info, name)

    lens = None if rectified else lens_of(info.distortion_model, field("d"))
    camera = field("p")
    fx, cx, fy, cy = camera[0], camera[2], camera[5], camera[6]
    if fx == 0 or lens is not None:
        camera = field("k")
        fx, cx, fy, cy = camera[0], camera[2], camera[4], camera[5]
    return Intrinsics(float(fx), float(fy), float(cx), float(cy), int(info.width), int(info.height)), lens


def points_of(cloud: Any) -> np.ndarray:
    """All points of a sensor_msgs/PointCloud2, float64 (point, 3) [m], in the axes of the message's frame.

    Raises:
        MessageError: no x, y, z of type FLOAT32 or FLOAT64, or fewer bytes than the size needs.
    """
    fields = {field.name: field for field in cloud.fields}
    if any(name not in fields or fields[name].datatype not in CLOUD_TYPES for name in "xyz"):
        raise MessageError(f"fields {', '.join(fields) or 'none'}, accepted are x, y, z of FLOAT32 or FLOAT64")
    order = ">" if cloud.is_bigendian else "<"
    try:
        layout = np.dtype(
            {
                "names": list("xyz"),
                "formats": [order + CLOUD_TYPES[fields[name].datatype] for name in "xyz"],
                "offsets": [fields[name].offset for name in "xyz"],
                "itemsize": cloud.point_step,
            }
        )
    except ValueError as error:
        raise MessageError(f"a point of {cloud.point_step} bytes does not hold its x, y, z") from error
    grid = _grid(cloud.data, layout, cloud.height, cloud.width, cloud.row_step, cloud.point_step)
    return np.column_stack([grid[name].ravel() for name in "xyz"]).astype(np.float64)


def _grid(data: Any, dtype: np.dtype, height: int, width: int, row: int, item: int) -> np.ndarray:
    """View of bytes as (height, width): `item` bytes from column to column, `row` bytes from row to row."""
    needed = (height - 1) * row + width * item if height and width else 0
    if row < width * item or len(data) < needed:
        raise MessageError(f"{len(data)} bytes, {height} rows of {width} x {item} bytes are needed")
    return np.ndarray((height, width), dtype, buffer=data, strides=(row, item))
