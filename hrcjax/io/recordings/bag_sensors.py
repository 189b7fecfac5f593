"""Which topics of a bag are depth, and the parameters of their cameras."""

from collections.abc import Sequence
from dataclasses import dataclass

from hrcjax.io.recordings.bag_file import Bag
from hrcjax.io.recordings.bag_messages import frame_name, intrinsics_of
from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.lab.errors import UsageError

IMAGE, CLOUD, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/CameraInfo"
ACCEPTED = "sensor_msgs/Image of 16UC1 or 32FC1 with sensor_msgs/CameraInfo, or sensor_msgs/PointCloud2"


@dataclass(frozen=True)
class Sensor:
    """A depth camera, with intrinsics, or a source of clouds, without."""

    topic: str
    frame: str
    intrinsics: Intrinsics | None


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
        camera = None
        if bag.types[topic] == IMAGE:
            camera = intrinsics or _camera(bag, topic, info_topic)
            if (first.width, first.height) != (camera.width, camera.height):
                raise UsageError(
                    f"bag {bag.path}: {topic} has {first.width}x{first.height} pixels, its intrinsics are of "
                    f"{camera.width}x{camera.height}: name the CameraInfo topic or give the intrinsics of this camera"
                )
        sensors.append(Sensor(topic, frame_name(first.header.frame_id), camera))
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


def _camera(bag: Bag, topic: str, info_topic: str | None) -> Intrinsics:
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
    try:
        return intrinsics_of(bag.first(chosen))
    except UsageError as error:
        raise UsageError(f"bag {bag.path}: {chosen}: {error}") from None
