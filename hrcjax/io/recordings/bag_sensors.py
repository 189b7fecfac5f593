"""Depth topics of a bag, and the parameters of their cameras."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from hrcjax.io.recordings.bag_file import Bag
from hrcjax.io.recordings.bag_messages import frame_name, pinhole_of
from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.io.recordings.lens import Lens
from hrcjax.lab.errors import UsageError

IMAGE, CLOUD, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/CameraInfo"
ACCEPTED = "sensor_msgs/Image of 16UC1 or 32FC1 with sensor_msgs/CameraInfo, or sensor_msgs/PointCloud2"
RECTIFIED = re.compile(r"(^|[/_])rect(ified)?([/_]|$)")
"""Topic names of rectified images, whose CameraInfo may still have the distortion of the raw images."""


@dataclass(frozen=True)
class Sensor:
    """A depth camera, with intrinsics, or a source of point clouds, without."""

    topic: str
    frame: str
    intrinsics: Intrinsics | None
    lens: Lens | None = None
    """Distortion of its images; None: none."""
    note: str = ""
    """Source of its camera parameters, one line."""


def find_sensors(
    bag: Bag, topics: Sequence[str], info_topic: str | None, intrinsics: Intrinsics | None
) -> list[Sensor]:
    """The sensors of the named topics; without names, all depth images, or else the only point cloud.

    Depth images are the topics of encoding 16UC1 or 32FC1; if there are several, those with "depth" in their name.

    Raises:
        UsageError: no such topic, no depth, several candidates, no or an uncalibrated CameraInfo, images of a size
            that is not the camera's.
    """
    for topic in topics:
        if bag.types.get(topic) not in (IMAGE, CLOUD) or not bag.counts[topic]:
            there = ", ".join(bag.of_type(IMAGE, CLOUD)) or "none"
            raise UsageError(
                f"bag {bag.path} has no depth at {topic}: accepted is {ACCEPTED}; images and clouds here: {there}"
            )
    sensors = []
    for topic in topics or _found(bag):
        first = bag.first(topic)
        camera, lens, note = intrinsics, None, ""
        if bag.types[topic] == CLOUD:
            camera = None
        elif camera is None:
            chosen = _info_topic(bag, topic, info_topic)
            try:
                camera, lens = pinhole_of(bag.first(chosen), rectified=bool(RECTIFIED.search(topic)))
            except UsageError as error:
                raise UsageError(f"bag {bag.path}: {chosen}: {error}") from None
            if lens is not None:
                note = f"{topic}: undistorted by {chosen} ({lens.model}); give --intrinsics if these images are rectified already"
        if camera is not None and (first.width, first.height) != (camera.width, camera.height):
            raise UsageError(
                f"bag {bag.path}: {topic} has {first.width}x{first.height} pixels, its intrinsics are of "
                f"{camera.width}x{camera.height}: name the CameraInfo topic or give the intrinsics of this camera"
            )
        sensors.append(Sensor(topic, frame_name(first.header.frame_id), camera, lens, note))
    return sensors


def _found(bag: Bag) -> list[str]:
    images = [name for name in bag.of_type(IMAGE) if bag.first(name).encoding in ("16UC1", "32FC1")]
    if len(images) > 1:
        named = [name for name in images if "depth" in name.lower()]
        if not named:
            raise UsageError(f"bag {bag.path}: {', '.join(images)} may be depth: name the topics that are")
        return named
    clouds = bag.of_type(CLOUD)
    if not images and len(clouds) > 1:
        raise UsageError(f"bag {bag.path} has the point clouds {', '.join(clouds)}: name the topics to read")
    if not images and not clouds:
        there = ", ".join(sorted(bag.types)) or "none"
        raise UsageError(f"bag {bag.path} has no topic of depth: accepted is {ACCEPTED}; topics here: {there}")
    return images or clouds


def _info_topic(bag: Bag, topic: str, info_topic: str | None) -> str:
    there = bag.of_type(INFO)
    sibling = topic.rsplit("/", 1)[0] + "/camera_info"
    chosen = info_topic or (sibling if sibling in there else there[0] if len(there) == 1 else "")
    if chosen not in there:
        names = ", ".join(there) or "none"
        missing = info_topic or sibling
        raise UsageError(
            f"bag {bag.path} has no sensor_msgs/CameraInfo at {missing} for {topic}: "
            f"accepted is one of {names}, or intrinsics"
        )
    return chosen
