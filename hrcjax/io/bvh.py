"""Motion capture files in the BVH format."""

from pathlib import Path

import numpy as np

from hrcjax.io.motions.bvh_text import ACCEPTED, BvhError, BvhText
from hrcjax.io.motions.joints import RecordedJoints


def read_bvh(path: str | Path, unit: float = 0.001) -> tuple[np.ndarray, tuple[str, ...], float]:
    """Joint positions in the file's own axes, joint names, and the rate.

    Args:
        path: the file.
        unit: length of the file's unit [m]; BVH does not specify it. Default: millimetres.

    Returns:
        Positions (frame, joint, 3) [m], names, frame rate [Hz].

    Raises:
        BvhError: a missing or broken file; one line says what, where, and what is accepted.
    """
    bvh = open_bvh(path)
    return bvh.positions() * unit, tuple(joint.name for joint in bvh.joints), bvh.rate


def open_bvh(path: str | Path) -> RecordedJoints:
    """Reads a file.

    Raises:
        BvhError: a missing or broken file; one line says what, where, and what is accepted.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise BvhError(f"no motion file at {path}: accepted is {ACCEPTED}") from None
    except OSError as error:
        raise BvhError(f"motion file {path} cannot be read ({error.strerror}): accepted is {ACCEPTED}") from None
    if b"\0" in data:
        raise BvhError(f"motion file {path} cannot be read (not a text file): accepted is {ACCEPTED}")
    lines = [line.strip() for line in data.decode("utf-8-sig", errors="replace").splitlines()]
    return BvhText(path, [(i + 1, line) for i, line in enumerate(lines) if line]).recorded()
