"""Folders of depth images with poses: numbered images with pose.txt, and the layout of the TUM RGB-D benchmark."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hrcjax.io.recordings.camera_files import DepthCamera, depth_camera
from hrcjax.io.recordings.files import files_with, text_lines
from hrcjax.io.recordings.frame import InputFrame, Intrinsics
from hrcjax.io.recordings.images import DEPTH_SUFFIXES, read_depth
from hrcjax.io.recordings.lens import without_distortion
from hrcjax.io.recordings.pose import Pose, Trajectory, pose_of
from hrcjax.io.recordings.pose_files import read_pose_folder, read_poses
from hrcjax.io.recordings.source import InputSource, Skip
from hrcjax.io.recordings.stamps import UNITS, stamp_unit
from hrcjax.lab.errors import UsageError

NUMBERED_CAMERA = (Intrinsics(518.0, 519.0, 325.5, 253.5, 640, 480), 1000.0)
TUM_CAMERA = (Intrinsics(525.0, 525.0, 319.5, 239.5, 640, 480), 5000.0)
RATE = 30.0  # [Hz]
TUM_TOLERANCE = 0.02  # [s], as in the benchmark's own association of files


def open_numbered_folder(
    folder: Path, intrinsics: Intrinsics | None = None, per_metre: float | None = None, rate: float | None = None
) -> InputSource:
    """A folder with depth/*.pgm or *.png (16 bits) and pose.txt, or a folder pose/ with a matrix for each image.

    The images are in natural order (2 before 10); line i of pose.txt belongs to image i. An image with an invalid pose (zeros,
    infinities) is skipped. There are no stamps: frame i is at i / `rate`. Colour is not read.

    Args:
        folder: the folder.
        intrinsics: of the depth camera; if None those of a camera file (`camera_files`), or else fx 518, fy 519, cx 325.5,
            cy 253.5 of 640x480 pixels, with a note.
        per_metre: units of depth per metre; if None that of the camera file, or 1000, with a note.
        rate: frame rate [Hz]; if None 30, and speeds are not checked.

    Raises:
        UsageError: no images, another number of poses, a broken line of pose.txt, a camera file for another image size.
    """
    folder = Path(folder)
    scale = None if per_metre is None else _positive("the scale of depth", per_metre)
    timed, rate = rate is not None, RATE if rate is None else _positive("the rate of frames", rate)
    images = files_with(folder / "depth", DEPTH_SUFFIXES) if (folder / "depth").is_dir() else []
    if not images:
        raise UsageError(f"{folder} holds no depth images: accepted are depth/*.pgm or depth/*.png with pose.txt")
    in_files = not (folder / "pose.txt").exists() and (folder / "pose").is_dir()
    name = "pose/" if in_files else "pose.txt"
    poses, faults = read_pose_folder(folder / "pose") if in_files else read_poses(folder / name, stamped=False)
    if len(poses) != len(images):
        raise UsageError(
            f"{folder} holds {len(images)} depth images and {name} {len(poses)} poses: accepted is one pose per image"
        )
    camera = depth_camera(folder, images[0], intrinsics, scale, NUMBERED_CAMERA)

    def read(skip: Skip) -> Iterator[InputFrame]:
        for index, (path, numbers) in enumerate(zip(images, poses, strict=True)):
            if index in faults:
                where, fault = faults[index]
                skip(f"{path.name}, {name} {where}: no pose ({fault})")
                continue
            yield _frame(index / rate, path, pose_of(numbers), camera, timed)

    notes = (
        camera.note,
        *([] if timed else ["no stamps: speeds are not checked; give the frame rate by --rate"]),
    )
    return InputSource(folder, "folder of numbered depth images", len(images), read, notes=notes)


def open_tum_folder(
    folder: Path,
    intrinsics: Intrinsics | None = None,
    per_metre: float | None = None,
    tolerance: float | None = None,
) -> InputSource:
    """A folder with depth.txt (`stamp filename`) and groundtruth.txt (`stamp tx ty tz qx qy qz qw`).

    The pose of an image is interpolated between its two neighbours of groundtruth.txt (before the first and after the
    last, these are held) if the nearer one is within `tolerance`; an image without a pose is skipped and reported, an
    invalid pose (zeros, infinities) ignored. Stamps of each file are in seconds, or in milliseconds, microseconds or
    nanoseconds, inferred from their magnitude. Colour is not read.

    Args:
        folder: the folder.
        intrinsics: of the depth camera; if None those of a camera file (`camera_files`), or else fx = fy = 525, cx 319.5,
            cy 239.5 of 640x480 pixels, with a note.
        per_metre: units of depth per metre; if None that of the camera file, or 5000, with a note.
        tolerance: between the stamps of images and poses [s]; if None 0.02, as in the benchmark's own tool.

    Raises:
        UsageError: a missing or broken list, a listed image that is missing, no image with a pose, a camera file for another
            image size.
    """
    folder = Path(folder)
    scale = None if per_metre is None else _positive("the scale of depth", per_metre)
    near = _positive("the tolerance of stamps", TUM_TOLERANCE if tolerance is None else tolerance)
    images = _listed_images(folder / "depth.txt")
    rows, faults = read_poses(folder / "groundtruth.txt", stamped=True)
    rows = np.delete(rows, list(faults), axis=0)
    units = [stamp_unit(np.array([stamp for stamp, _ in images])), stamp_unit(rows[:, 0])]
    images = [(stamp / UNITS[units[0]], path) for stamp, path in images]
    rows[:, 0] /= UNITS[units[1]]
    trajectory = Trajectory(rows)
    placed = [(stamp, path, trajectory.at(stamp, near)) for stamp, path in images]
    found = sum(pose is not None for _, _, pose in placed)
    if found == 0:
        raise UsageError(
            f"{folder}: none of the {len(images)} depth images has a pose within {near:g} s (images from "
            f"{images[0][0]:.3f} to {images[-1][0]:.3f} s, poses from {trajectory.stamps[0]:.3f} to "
            f"{trajectory.stamps[-1]:.3f} s): accepted are depth.txt and groundtruth.txt with stamps of the same clock"
        )
    camera = depth_camera(folder, images[0][1], intrinsics, scale, TUM_CAMERA)

    def read(skip: Skip) -> Iterator[InputFrame]:
        for where, fault in faults.values():
            skip(f"groundtruth.txt {where}: no pose ({fault})")
        for stamp, path, pose in placed:
            if pose is None:
                skip(f"{path.name} at {stamp:.6f} s: no pose of groundtruth.txt within {near:g} s")
                continue
            yield _frame(stamp, path, pose, camera)

    odd = [
        f"{name} in {unit}"
        for name, unit in zip(("depth.txt", "groundtruth.txt"), units, strict=True)
        if unit != "seconds"
    ]
    notes = (camera.note, *([f"stamps, inferred from their magnitude: {', '.join(odd)}"] if odd else []))
    return InputSource(folder, "TUM RGB-D folder", found, read, notes=notes)


def _frame(stamp: float, path: Path, pose: Pose, camera: DepthCamera, timed: bool = True) -> InputFrame:
    intrinsics = camera.intrinsics
    depth = read_depth(path, camera.per_metre, intrinsics)
    if camera.lens is not None:
        depth = without_distortion(depth, camera.lens, intrinsics, intrinsics)
    return InputFrame(stamp, "", depth, None, intrinsics, pose.rotation, pose.position, timed)


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
