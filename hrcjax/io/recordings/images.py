"""Depth images, read by the library Pillow."""

from pathlib import Path

import numpy as np
from PIL import Image

from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.lab.errors import UsageError

DEPTH_SUFFIXES = (".pgm", ".png")
ACCEPTED_DEPTH = "a whole PGM or PNG image of one channel with 16 bits"


def clean_depth(depth: np.ndarray) -> np.ndarray:
    """Depth as float32 [m]; values that are not finite or negative become 0, no measurement."""
    depth = np.asarray(depth, np.float32)
    return np.where(np.isfinite(depth) & (depth > 0), depth, np.float32(0))


def read_depth(path: Path, per_metre: float, intrinsics: Intrinsics) -> np.ndarray:
    """Depth, float32 (height, width) [m]; 0: no measurement.

    Args:
        path: a 16-bit PGM or PNG image.
        per_metre: units of depth per metre.
        intrinsics: of the camera; their size must be that of the image.

    Raises:
        UsageError: a missing or truncated image, another kind of image, another size than that of the intrinsics.
    """
    try:
        with Image.open(path) as image:
            # Pillow rescales PGM values whose maximum is not 65535; its decoder "ppm" has that maximum.
            stretched = next((tile for tile in image.tile if tile[0].startswith("ppm")), None)
            mode, raw = image.mode, np.asarray(image)
    except Exception as error:  # the library raises errors of many types on broken files
        raise _unreadable(path, error) from error
    if not mode.startswith("I") or raw.ndim != 2:
        raise UsageError(f"depth image {path} has pixels of type {mode}: accepted is {ACCEPTED_DEPTH}")
    if raw.shape != (intrinsics.height, intrinsics.width):
        raise UsageError(
            f"depth image {path} has {raw.shape[1]}x{raw.shape[0]} pixels, the intrinsics are for "
            f"{intrinsics.width}x{intrinsics.height}: give the intrinsics of this camera"
        )
    numbers = raw.astype(np.float64)
    if stretched is not None:
        arguments = stretched[3]
        numbers = np.round(numbers * (arguments[-1] if isinstance(arguments, tuple) else arguments) / 65535)
    return clean_depth(numbers / per_metre)


def size_of(path: Path) -> tuple[int, int] | None:
    """Width and height of an image [px]; None: unreadable, which `read_depth` reports."""
    try:
        with Image.open(path) as image:
            return image.size
    except Exception:
        return None


def _unreadable(path: Path, error: Exception) -> UsageError:
    if isinstance(error, FileNotFoundError):
        return UsageError(f"depth image {path} is missing: accepted is {ACCEPTED_DEPTH}")
    detail = " ".join(str(error).split()).replace(repr(str(path)), "it")
    return UsageError(
        f"depth image {path} cannot be read ({detail or type(error).__name__}): accepted is {ACCEPTED_DEPTH}"
    )
