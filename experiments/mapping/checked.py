"""Frames that no map can be made of are refused before anything is made of them."""

import numpy as np

from experiments.errors import UsageError
from experiments.inputs.frame import InputFrame
from hrcjax.map.view import TILE

DIGITS = 0.05
"""Steps between neighbouring numbers of single precision may be this share of the spacing at most [1]."""


def checked(frame: InputFrame, spacing: float) -> InputFrame:
    """The frame itself.

    Args:
        spacing: of the map [m].

    Raises:
        UsageError: an image smaller than a tile; places so far from the origin that single precision does not tell
            voxels apart.
    """
    if frame.depth is not None and min(np.shape(frame.depth)) < TILE:
        rows, columns = np.shape(frame.depth)
        raise UsageError(f"a depth image of {columns} x {rows} pixels: accepted are {TILE} x {TILE} and more")
    far = float(np.max(np.abs(frame.position), initial=0.0, where=np.isfinite(frame.position)))
    if frame.cloud is not None and len(frame.cloud):
        far += float(np.max(np.abs(frame.cloud), initial=0.0, where=np.isfinite(frame.cloud)))
    step = float(np.spacing(np.float32(far)))
    if step > DIGITS * spacing:
        raise UsageError(
            f"places some {far:.3g} m from the origin: single precision tells {step:.2g} m apart there, the map needs "
            f"{DIGITS * spacing:.2g} m; subtract an offset from poses and points"
        )
    return frame
