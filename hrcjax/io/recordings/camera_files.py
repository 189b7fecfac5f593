"""Camera files beside depth images: search and selection."""

import re
from dataclasses import dataclass
from pathlib import Path

from hrcjax.io.recordings.camera_text import CameraNumbers, camera_of_text
from hrcjax.io.recordings.files import files_with
from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.io.recordings.images import size_of
from hrcjax.io.recordings.lens import Lens
from hrcjax.lab.errors import UsageError

FOLDERS = (".", "intrinsic", "intrinsics", "calibration", "depth")
"""Folders that are searched."""
NAMED = re.compile(r"cam|intrin|calib|^k$|(^|[_-])k$|^transforms$|^_info$", re.IGNORECASE)
OF_OTHERS = re.compile(r"extrin|pose|traj|rgb|colou?r|imu|infra|stereo", re.IGNORECASE)
ACCEPTED = "a text, JSON or YAML file with fx fy cx cy, or a matrix 3 x 3, and where known the size, depth scale and distortion"
MIDDLE = (0.25, 0.75)
"""Plausible range of the principal point over the image's width and height [1]."""


@dataclass(frozen=True)
class DepthCamera:
    """Camera parameters of depth images."""

    intrinsics: Intrinsics
    """Intrinsics of the raw images and of the undistorted frames."""
    lens: Lens | None
    """Distortion of the raw images; None: none."""
    per_metre: float
    """Units of depth per metre."""
    note: str
    """Source of these parameters, one line."""


def depth_camera(
    folder: Path, image: Path, intrinsics: Intrinsics | None, per_metre: float | None, assumed: tuple[Intrinsics, float]
) -> DepthCamera:
    """The camera of a folder: as given, else from a camera file, else the assumed one.

    Args:
        image: one of the depth images.
        intrinsics, per_metre: as given; None: not given.
        assumed: default intrinsics and scale.

    Raises:
        UsageError: several inconsistent files, an unreadable file, or one for another image size.
    """
    size = size_of(image)
    found = None if intrinsics else camera_beside(folder)
    lens = None
    if intrinsics:
        camera = f"{_words(intrinsics)} (given)"
    elif found:
        path, numbers = found
        intrinsics, lens = _fitting(path, numbers, size), numbers.lens
        bent = f", undistorted ({lens.model})" if lens else ""
        camera = f"{_words(intrinsics)} ({path.relative_to(folder)}){bent}"
    else:
        intrinsics = assumed[0]
        camera = f"{_words(intrinsics)} (ASSUMED, no camera file found: --intrinsics)"
    scale = per_metre
    origin = "given"
    if scale is None and found and found[1].per_metre is not None:
        scale, origin = found[1].per_metre, str(found[0].relative_to(folder))
    if scale is None:
        scale, origin = assumed[1], "ASSUMED: --per-metre"
    return DepthCamera(intrinsics, lens, scale, f"depth camera: {camera}; {scale:g} per metre ({origin})")


def camera_beside(folder: Path) -> tuple[Path, CameraNumbers] | None:
    """The camera file of a folder and its content; None: no such file.

    Raises:
        UsageError: as `depth_camera`.
    """
    found: list[tuple[Path, CameraNumbers]] = []
    for place in (folder / name for name in FOLDERS):
        for path in files_with(place, (".txt", ".json", ".yaml", ".yml")) if place.is_dir() else []:
            named = bool(NAMED.search(path.stem))
            if OF_OTHERS.search(path.stem) or not (named or path.suffix.lower() in (".yaml", ".yml")):
                continue
            numbers = _read(path)
            if numbers is not None:
                found.append((path, numbers))
            elif named:
                raise UsageError(
                    f"{path} does not describe a supported camera: accepted is {ACCEPTED}; or give --intrinsics"
                )
    of_depth = [one for one in found if "depth" in one[0].stem.lower()]
    found = of_depth or found
    if len({numbers for _, numbers in found}) > 1:
        names = ", ".join(str(path.relative_to(folder)) for path, _ in found)
        raise UsageError(
            f"{folder}: {names} describe different cameras: accepted is one of the depth images; or give --intrinsics"
        )
    return found[0] if found else None


def _read(path: Path) -> CameraNumbers | None:
    try:
        return camera_of_text(path.read_text(encoding="utf-8-sig"))
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read ({type(error).__name__}): accepted is {ACCEPTED}") from None


def _fitting(path: Path, numbers: CameraNumbers, size: tuple[int, int] | None) -> Intrinsics:
    """The intrinsics of a file, checked against the image size [px]; None: size not known.

    Raises:
        UsageError: the file is for another image size.
    """
    width, height = numbers.size or size or (0, 0)
    if size and (width, height) != size:
        raise UsageError(
            f"{path} is for images of {width}x{height} pixels, the depth images have {size[0]}x{size[1]}: accepted is the "
            "depth images' own camera; or give --intrinsics"
        )
    low, high = MIDDLE
    for name, centre, length in (("cx", numbers.cx, width), ("cy", numbers.cy, height)):
        if length and not low * length <= centre <= high * length:
            raise UsageError(
                f"{path}: {name} is {centre:g}, far from the middle of depth images of {width}x{height} pixels: accepted is "
                "the depth images' own camera; or give --intrinsics"
            )
    return Intrinsics(numbers.fx, numbers.fy, numbers.cx, numbers.cy, width or 1, height or 1)


def _words(camera: Intrinsics) -> str:
    return (
        f"fx {camera.fx:g} fy {camera.fy:g} cx {camera.cx:g} cy {camera.cy:g} of {camera.width}x{camera.height} pixels"
    )
