"""Opens a recording of any supported kind."""

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hrcjax.io.recordings.bags import is_bag, open_bag
from hrcjax.io.recordings.clouds import SUFFIXES, open_clouds
from hrcjax.io.recordings.files import files_with
from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.io.recordings.rgbd_folder import open_numbered_folder, open_tum_folder
from hrcjax.io.recordings.source import InputSource
from hrcjax.lab.errors import UsageError

ACCEPTED = (
    "a folder with depth/ and pose.txt (or pose/), a TUM RGB-D folder (depth.txt, groundtruth.txt), "
    "PLY or NPZ files or a folder of them, a ROS 1 or ROS 2 bag"
)


def open_input(
    path: str | Path,
    *,
    intrinsics: Intrinsics | None = None,
    per_metre: float | None = None,
    rate: float | None = None,
    tolerance: float | None = None,
    origin: Sequence[float] | None = None,
    topics: Sequence[str] | None = None,
    info_topic: str | None = None,
    world_frame: str | None = None,
    pose_topic: str | None = None,
    body_frame: str | None = None,
) -> InputSource:
    """The frames of a recording, read while they are iterated: `for frame in open_input("recording"): ...`.

    An option that is None has the default of the recording's kind, documented at its reader; one that does not apply to the
    kind is refused.

    Args:
        path: a folder or file; its content selects the reader.
        intrinsics: of the depth camera, of images without distortion. Folders of images, bags.
        per_metre: units of depth and points per metre. All kinds.
        rate: frame rate if there are no stamps [Hz]. Folders with pose.txt, PLY, NPZ.
        tolerance: largest time between a frame and the nearest pose [s]. TUM folders, bags.
        origin: of the sensor in the world (3,) [m]. PLY.
        topics: of depth images or clouds. Bags.
        info_topic: of the CameraInfo. Bags.
        world_frame: the tf frame used as the world frame. Bags.
        pose_topic: of poses, instead of tf. Bags.
        body_frame: the tf frame whose pose `pose_topic` holds. Bags.

    Raises:
        UsageError: no such path, an unsupported kind, an option that does not apply, and errors of the reader.
    """
    given: dict[str, Any] = {
        "intrinsics": intrinsics,
        "per_metre": per_metre,
        "rate": rate,
        "tolerance": tolerance,
        "origin": origin,
        "topics": topics,
        "info_topic": info_topic,
        "world_frame": world_frame,
        "pose_topic": pose_topic,
        "body_frame": body_frame,
    }
    given = {name: value for name, value in given.items() if value is not None}
    path = Path(path)
    reader, kind = _reader(path)
    accepted = list(inspect.signature(reader).parameters)[1:]
    foreign = [name for name in given if name not in accepted]
    if foreign:
        raise UsageError(f"{path} is {kind}, {', '.join(foreign)} does not apply: accepted are {', '.join(accepted)}")
    return reader(path, **given)


def _reader(path: Path) -> tuple[Callable[..., InputSource], str]:
    """The reader for the path, and a description of the path."""
    if not path.exists():
        raise UsageError(f"nothing at {path}: accepted is {ACCEPTED}")
    if path.is_dir():
        try:
            empty = not any(path.iterdir())
        except OSError as error:
            raise UsageError(f"folder {path} cannot be read ({type(error).__name__}): accepted is {ACCEPTED}") from None
        if empty:
            raise UsageError(f"folder {path} is empty: accepted is {ACCEPTED}")
        if (path / "depth.txt").is_file():
            return open_tum_folder, "a TUM RGB-D folder"
        if (path / "depth").is_dir():
            return open_numbered_folder, "a folder of numbered depth images"
        if is_bag(path):
            return open_bag, "a ROS bag"
        if files_with(path, SUFFIXES):
            return open_clouds, "a folder of point clouds"
    elif is_bag(path):
        return open_bag, "a ROS bag"
    elif path.suffix.lower() in SUFFIXES:
        return open_clouds, "a file of frames or points"
    raise UsageError(f"{path} is not a supported recording: accepted is {ACCEPTED}")
