"""Folders of depth images with poses: numbered images with pose.txt, and the layout of the TUM RGB-D benchmark."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hrcjax.io.recordings.files import files_with, text_lines
from hrcjax.io.recordings.frame import InputFrame, Intrinsics
from hrcjax.io.recordings.images import COLOR_SUFFIXES, DEPTH_SUFFIXES, read_color, read_depth
from hrcjax.io.recordings.pose import Pose, Trajectory, pose_of
from hrcjax.io.recordings.pose_files import read_poses
from hrcjax.io.recordings.source import InputSource, Skip
from hrcjax.lab.errors import UsageError

NUMBERED_INTRINSICS = Intrinsics(518.0, 519.0, 325.5, 253.5, 640, 480)
NUMBERED_PER_METRE = 1000.0
TUM_INTRINSICS = Intrinsics(525.0, 525.0, 319.5, 239.5, 640, 480)
TUM_PER_METRE = 5000.0
TUM_TOLERANCE = 0.02  # [s], as in the benchmark's own association of files


def open_numbered_folder(
    folder: Path, intrinsics: Intrinsics | None = None, per_metre: float | None = None, rate: float = 30.0
) -> InputSource:
    """A folder with depth/*.pgm or *.png (16 bits), pose.txt and optionally color/ with images of the same names.

    The images are taken in natural order (2 before 10); line i of pose.txt, `tx ty tz qx qy qz qw` (camera to world),
    belongs to image i. There are no stamps: frame i is at i / `rate`.

    Args:
        folder: the folder.
        intrinsics: of the depth camera; without it fx 518, fy 519, cx 325.5, cy 253.5 of 640x480 pixels.
        per_metre: the images' number for one metre; 1000 without it.
        rate: frames a second [Hz].

    Raises:
        UsageError: no images, another count of poses, a broken line of pose.txt.
    """
    folder = Path(folder)
    intrinsics = intrinsics or NUMBERED_INTRINSICS
    scale = _positive("the scale of depth", NUMBERED_PER_METRE if per_metre is None else per_metre)
    rate = _positive("the rate of frames", rate)
    images = files_with(folder / "depth", DEPTH_SUFFIXES) if (folder / "depth").is_dir() else []
    if not images:
        raise UsageError(f"{folder} holds no depth images: accepted are depth/*.pgm or depth/*.png with pose.txt")
    poses = read_poses(folder / "pose.txt", stamped=False)
    if len(poses) != len(images):
        raise UsageError(
            f"{folder} holds {len(images)} depth images and pose.txt {len(poses)} poses: accepted is one pose an image"
        )
    colors = {p.stem: p for p in files_with(folder / "color", COLOR_SUFFIXES)} if (folder / "color").is_dir() else {}

    def read(_: Skip) -> Iterator[InputFrame]:
        for index, (path, numbers) in enumerate(zip(images, poses, strict=True)):
            yield _frame(index / rate, path, colors.get(path.stem), pose_of(numbers), scale, intrinsics)

    return InputSource(folder, "folder of numbered depth images", len(images), read)


def open_tum_folder(
    folder: Path,
    intrinsics: Intrinsics | None = None,
    per_metre: float | None = None,
    tolerance: float | None = None,
) -> InputSource:
    """A folder with depth.txt (`stamp filename`), groundtruth.txt (`stamp tx ty tz qx qy qz qw`), optionally rgb.txt.

    The pose of an image is interpolated between its two neighbours of groundtruth.txt (before the first and after the
    last, these are held) if the nearer one is within `tolerance`; an image without a pose is skipped and named. The
    color is that of the nearest stamp within `tolerance`.

    Args:
        folder: the folder.
        intrinsics: of the depth camera; without it fx = fy = 525, cx 319.5, cy 239.5 of 640x480 pixels.
        per_metre: the images' number for one metre; 5000 without it.
        tolerance: between the stamps of images and poses [s]; 0.02 without it, as in the benchmark's own tool.

    Raises:
        UsageError: a missing or broken list, an image that is listed and not there, no image with a pose.
    """
    folder = Path(folder)
    intrinsics = intrinsics or TUM_INTRINSICS
    scale = _positive("the scale of depth", TUM_PER_METRE if per_metre is None else per_metre)
    near = _positive("the tolerance of stamps", TUM_TOLERANCE if tolerance is None else tolerance)
    images = _listed_images(folder / "depth.txt")
    rows = read_poses(folder / "groundtruth.txt", stamped=True)
    trajectory = Trajectory(rows)
    colors = _listed_images(folder / "rgb.txt") if (folder / "rgb.txt").is_file() else []
    color_stamps = np.array([stamp for stamp, _ in colors])
    placed = [(stamp, path, trajectory.at(stamp, near)) for stamp, path in images]
    found = sum(pose is not None for _, _, pose in placed)
    if found == 0:
        raise UsageError(
            f"{folder}: none of the {len(images)} depth images has a pose within {near:g} s (images from "
            f"{images[0][0]:.3f} to {images[-1][0]:.3f} s, poses from {trajectory.stamps[0]:.3f} to "
            f"{trajectory.stamps[-1]:.3f} s): accepted are depth.txt and groundtruth.txt of one clock"
        )

    def read(skip: Skip) -> Iterator[InputFrame]:
        for stamp, path, pose in placed:
            if pose is None:
                skip(f"{path.name} at {stamp:.6f} s: no pose of groundtruth.txt within {near:g} s")
                continue
            color = int(np.abs(color_stamps - stamp).argmin()) if colors else -1
            close = color >= 0 and abs(colors[color][0] - stamp) <= near
            yield _frame(stamp, path, colors[color][1] if close else None, pose, scale, intrinsics)

    return InputSource(folder, "TUM RGB-D folder", found, read)


def _frame(
    stamp: float, path: Path, color: Path | None, pose: Pose, per_metre: float, intrinsics: Intrinsics
) -> InputFrame:
    depth = read_depth(path, per_metre, intrinsics)
    pixels = None if color is None else read_color(color, intrinsics.height, intrinsics.width)
    return InputFrame(stamp, "", depth, None, intrinsics, pose.rotation, pose.position, pixels)


def _listed_images(path: Path) -> list[tuple[float, Path]]:
    """Stamp [s] and file of each line, in the order of the list."""
    accepted = "a line 'stamp filename' for each image, the file's name relative to the folder"
    listed = []
    for number, line in text_lines(path, accepted):
        words = line.split(maxsplit=1)
        try:
            stamp = float(words[0])
        except ValueError:
            stamp = np.nan
        if len(words) != 2 or not np.isfinite(stamp):
            raise UsageError(f"{path} line {number}: no stamp with a file's name; accepted is {accepted}")
        image = path.parent / words[1]
        if not image.is_file():
            raise UsageError(f"{path} line {number}: {image} is missing; accepted is {accepted}")
        listed.append((stamp, image))
    if not listed:
        raise UsageError(f"{path} lists no image: accepted is {accepted}")
    return listed


def _positive(what: str, number: float) -> float:
    if not (np.isfinite(number) and number > 0):
        raise UsageError(f"{what} is {number}: accepted is a positive number")
    return float(number)
