"""Refuses frames that cannot be mapped: too far from the origin for single precision, or smaller than a tile of the image."""

import math
from collections.abc import Iterable, Iterator

import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.lab.errors import UsageError
from hrcjax.map.view import TILE

SHARE = 20
"""The resolution of single precision must be at most the spacing divided by this [1]."""
MANTISSA = 24
"""Bits of a number in single precision."""


def farthest_coordinate(spacing: float) -> float:
    """Largest coordinate at which single precision resolves the spacing well enough [m].

    Args:
        spacing: edge of a voxel [m].
    """
    return 2.0 ** (math.floor(math.log2(spacing / SHARE)) + MANTISSA)


def check_near_origin(what: str, coordinates: np.ndarray, spacing: float) -> None:
    """Refuses coordinates [m] at which single precision does not resolve a spacing [m].

    Args:
        what: what they belong to, for the message.

    Raises:
        UsageError: one is too large.
    """
    largest, accepted = float(np.abs(coordinates).max(initial=0.0)), farthest_coordinate(spacing)
    if not largest < accepted:
        raise UsageError(
            f"{what}: a coordinate of {largest:.0f} m is too large for --spacing {spacing:g} in single precision: "
            f"accepted are less than {accepted:.0f} m; subtract an offset from poses and points first"
        )


def check_frame(frame: InputFrame, spacing: float) -> None:
    """Refuses a frame that cannot be mapped.

    Raises:
        UsageError: its sensor or a point of its cloud is too far from the origin; its image is smaller than a tile.
    """
    of = f" of {frame.camera}" if frame.camera else ""
    name = f"the frame{of} at {frame.stamp:.3f} s"
    check_near_origin(f"{name}, its sensor", frame.position, spacing)
    if frame.cloud is not None:
        check_near_origin(f"{name}, its points", frame.cloud @ frame.rotation.T + frame.position, spacing)
    elif frame.depth is not None and min(frame.depth.shape) < TILE:
        height, width = frame.depth.shape
        raise UsageError(f"{name}: an image of {width} x {height} pixels; accepted are {TILE} x {TILE} and more")


def checked(frames: Iterable[InputFrame], spacing: float) -> Iterator[InputFrame]:
    """The frames, each checked by `check_frame`.

    Raises:
        UsageError: as `check_frame`.
    """
    for frame in frames:
        check_frame(frame, spacing)
        yield frame
