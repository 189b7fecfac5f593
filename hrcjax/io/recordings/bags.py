"""ROS bags: depth images or point clouds, with poses from tf or a topic."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hrcjax.io.recordings.bag_file import ACCEPTED, BAG_SUFFIXES, opened_bag
from hrcjax.io.recordings.bag_messages import MessageError, depth_of, frame_name, points_of, stamp_of
from hrcjax.io.recordings.bag_poses import poses_of_tf, poses_of_topic, read_transforms
from hrcjax.io.recordings.bag_sensors import Sensor, find_sensors
from hrcjax.io.recordings.files import files_with
from hrcjax.io.recordings.frame import InputFrame, Intrinsics
from hrcjax.io.recordings.lens import without_distortion
from hrcjax.io.recordings.npz_file import measured_points
from hrcjax.io.recordings.pose import Pose
from hrcjax.io.recordings.source import InputSource, Skip
from hrcjax.io.recordings.transforms import NoPoseError
from hrcjax.lab.errors import UsageError

TOLERANCE = 0.1  # [s]: one period of tf at 10 Hz


def is_bag(path: Path) -> bool:
    """Whether a file or folder looks like a ROS bag."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file() or bool(files_with(path, BAG_SUFFIXES))
    return path.suffix.lower() in BAG_SUFFIXES


def open_bag(
    path: Path,
    topics: Sequence[str] = (),
    info_topic: str | None = None,
    intrinsics: Intrinsics | None = None,
    per_metre: float | None = None,
    world_frame: str | None = None,
    pose_topic: str | None = None,
    body_frame: str | None = None,
    tolerance: float | None = None,
) -> InputSource:
    """A ROS 1 bag (*.bag, or a folder of its parts) or a ROS 2 bag (a folder with metadata.yaml, *.mcap, *.db3).

    The frames are in recorded order, of all selected topics. Their cameras are named by topic if there are several. tf and
    the pose topic are read here, images and clouds while the source is iterated.

    Args:
        path: the file or folder.
        topics: sensor_msgs/Image of 16UC1 or 32FC1, or sensor_msgs/PointCloud2. Without names: all depth images, or
            else the only point cloud.
        info_topic: sensor_msgs/CameraInfo of the images; without it the one beside the topic, or else the only one.
        intrinsics: instead of a CameraInfo, of images without distortion.
        per_metre: the number of images and clouds for one metre; without it 1000 for 16UC1, and 1 for 32FC1 and clouds.
        world_frame: the frame of tf that is the world; without it the root above the sensors.
        pose_topic: geometry_msgs/PoseStamped or nav_msgs/Odometry, world from body, instead of tf's world.
        body_frame: the frame whose pose `pose_topic` holds; if None Odometry's child frame, or the sensor's frame.
        tolerance: how far the nearest recorded pose may be from a frame [s]; 0.1 without it. Between two poses is
            interpolated, before the first and after the last these are held.

    Raises:
        UsageError: the library rosbags is missing; no bag, a broken one, no depth, no camera, no poses in it.
    """
    path = Path(path)
    near = TOLERANCE if tolerance is None else tolerance
    for what, number in (("the tolerance of stamps", near), ("the scale of depth", per_metre)):
        if number is not None and not (np.isfinite(number) and number > 0):
            raise UsageError(f"{what} is {number}: accepted is a positive number")
    if pose_topic and world_frame:
        raise UsageError(
            "a pose topic defines its own world: accepted is either a pose topic or a world frame, not both"
        )
    if body_frame and not pose_topic:
        raise UsageError(f"body frame {body_frame} needs a pose topic: accepted are both together")
    parts = _parts(path)
    with opened_bag(parts) as bag:
        sensors = {sensor.topic: sensor for sensor in find_sensors(bag, topics, info_topic, intrinsics)}
        frames = {sensor.frame for sensor in sensors.values()}
        length = sum(bag.counts[topic] for topic in sensors)
        tree = read_transforms(bag)
        if pose_topic:
            poses = poses_of_topic(bag, tree, frames, pose_topic, body_frame, near)
        else:
            poses = poses_of_tf(bag, tree, frames, world_frame, near)

    def read(skip: Skip) -> Iterator[InputFrame]:
        for fault in tree.faults:
            skip(fault)
        used, reason = 0, ""
        with opened_bag(parts) as bag:
            for topic, message in bag.messages(*sensors):
                stamp = stamp_of(message.header)
                try:
                    pose = poses(sensors[topic].frame, stamp)
                    frame = _frame(message, sensors[topic], topic if len(sensors) > 1 else "", stamp, pose, per_metre)
                except (NoPoseError, MessageError) as error:
                    reason = f"{topic} at {stamp:.6f} s: {error}"
                    skip(reason)
                    continue
                used += 1
                yield frame
        if not used:
            raise UsageError(
                f"bag {path}: none of its {length} frames can be used, accepted are whole ones with a pose; {reason}"
            )

    notes = tuple(sensor.note for sensor in sensors.values() if sensor.note)
    return InputSource(path, "ROS bag", length, read, notes=notes)


def _frame(message: Any, sensor: Sensor, camera: str, stamp: float, pose: Pose, per_metre: float | None) -> InputFrame:
    if frame_name(message.header.frame_id) != sensor.frame:
        raise MessageError(f"its frame is {message.header.frame_id}, that of the first message {sensor.frame}")
    if sensor.intrinsics is None:
        cloud = measured_points(points_of(message) / (per_metre or 1.0))
        if len(cloud) == 0:
            raise MessageError("no finite point")
        return InputFrame(stamp, camera, None, cloud, None, pose.rotation, pose.position)
    depth = depth_of(message, per_metre)
    if depth.shape != (sensor.intrinsics.height, sensor.intrinsics.width):
        raise MessageError(f"{depth.shape[1]}x{depth.shape[0]} pixels, the first image had another size")
    if sensor.lens is not None:
        depth = without_distortion(depth, sensor.lens, sensor.intrinsics, sensor.intrinsics)
    return InputFrame(stamp, camera, depth, None, sensor.intrinsics, pose.rotation, pose.position)


def _parts(path: Path) -> list[Path]:
    """The files the library wants for a bag."""
    if not path.is_dir() or (path / "metadata.yaml").is_file():
        return [path]
    parts = files_with(path, BAG_SUFFIXES[:1])
    stores = files_with(path, BAG_SUFFIXES[1:])
    if len(parts) + len(stores) == 0 or (stores and len(parts) + len(stores) > 1):
        names = ", ".join(p.name for p in parts + stores) or "no bag"
        raise UsageError(f"{path} holds {names}: accepted is {ACCEPTED}")
    return parts or stores
