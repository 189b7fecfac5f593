"""Lens distortion, and undistortion of depth images.

Models: Brown's with radial and tangential terms, also as a rational function (ROS plumb_bob and rational_polynomial, OpenCV),
and the equidistant one (ROS equidistant, OpenCV fisheye, Kannala and Brandt 2006).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.lab.errors import UsageError

BROWN = ("plumb_bob", "rational_polynomial", "brown_conrady", "radtan", "opencv", "pinhole", "")
EQUIDISTANT = ("equidistant", "fisheye", "kannala_brandt", "kannalabrandt", "opencv_fisheye")
ACCEPTED = "plumb_bob (4 or 5 numbers), rational_polynomial (8) or equidistant (4)"
STEPS = 2000
"""Number of radii at which a model is tested for monotonicity."""
SMOOTH = 0.05
"""Largest relative difference of neighbouring depths on one surface [1]."""


@dataclass(frozen=True)
class Lens:
    """Lens distortion: from a ray (x/z, y/z) to image coordinates in focal lengths."""

    model: Literal["brown", "equidistant"]
    coefficients: tuple[float, ...]
    """Brown: k1 k2 p1 p2 k3 k4 k5 k6, as OpenCV and ROS order them; equidistant: k1 k2 k3 k4 [1]."""


def lens_of(model: str, coefficients: Sequence[float]) -> Lens | None:
    """The lens of a distortion model and its coefficients; None: no distortion.

    Raises:
        UsageError: another model with non-zero coefficients, or another number of them.
    """
    numbers = tuple(float(v) for v in coefficients)
    name = model.strip().lower().replace(" ", "_").replace("-", "_").removeprefix("distortion.")
    if not np.isfinite(numbers).all():
        raise UsageError(f"lens {model or 'without a name'}: a distortion coefficient is not finite")
    if name.rstrip("0123456789") in EQUIDISTANT or name in EQUIDISTANT:
        if len(numbers) < 4 or any(numbers[4:]):
            raise UsageError(f"lens {model} with {len(numbers)} numbers of distortion: accepted is {ACCEPTED}")
        return Lens("equidistant", numbers[:4])
    if not any(numbers):
        return None
    if name not in BROWN or not 4 <= len(numbers) <= 14 or any(numbers[8:]):
        raise UsageError(
            f"lens {model or 'without a name'} with {len(numbers)} numbers of distortion: accepted is {ACCEPTED}, "
            "or images that are rectified already, with the intrinsics given"
        )
    return Lens("brown", (numbers + (0.0,) * 4)[:8])


def _radial(lens: Lens, r: np.ndarray) -> np.ndarray:
    """Ratio of the image radius to the radius r of the ray [1]."""
    if lens.model == "equidistant":
        angle = np.arctan(r)
        k1, k2, k3, k4 = lens.coefficients
        bent = angle * (1 + angle**2 * (k1 + angle**2 * (k2 + angle**2 * (k3 + angle**2 * k4))))
        return np.where(r > 1e-9, bent / np.where(r > 1e-9, r, 1.0), 1.0)
    k1, k2, _, _, k3, k4, k5, k6 = lens.coefficients
    s = r * r
    return (1 + s * (k1 + s * (k2 + s * k3))) / (1 + s * (k4 + s * (k5 + s * k6)))


def distorted(lens: Lens, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Image coordinates of the rays (x, y, 1), in focal lengths from the principal point; NaN beyond the radius up to which the
    model is monotonic."""
    r = np.hypot(x, y)
    tried = np.linspace(0.0, float(r.max(initial=0.0)) or 1.0, STEPS)
    with np.errstate(divide="ignore", invalid="ignore"):
        image = tried * _radial(lens, tried)
        back = np.flatnonzero(~(np.diff(image) > 0))
        scale = np.where(r <= (tried[back[0]] if len(back) else np.inf), _radial(lens, r), np.nan)
    if lens.model == "equidistant":
        return x * scale, y * scale
    p1, p2 = lens.coefficients[2:4]
    s = r * r
    return x * scale + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * scale + p1 * (s + 2 * y * y) + 2 * p2 * x * y


@lru_cache(maxsize=8)
def _places(lens: Lens, raw: Intrinsics, straight: Intrinsics) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row and column in the raw image of each pixel of the undistorted one (height, width), and which are inside."""
    v, u = np.mgrid[0 : straight.height, 0 : straight.width].astype(np.float64)
    x, y = distorted(lens, (u - straight.cx) / straight.fx, (v - straight.cy) / straight.fy)
    column, row = x * raw.fx + raw.cx, y * raw.fy + raw.cy
    inside = (column > -0.5) & (column < raw.width - 0.5) & (row > -0.5) & (row < raw.height - 0.5)
    column, row = (np.where(inside, places, 0.0) for places in (column, row))
    return np.clip(row, 0, raw.height - 1), np.clip(column, 0, raw.width - 1), inside


def without_distortion(depth: np.ndarray, lens: Lens, raw: Intrinsics, straight: Intrinsics) -> np.ndarray:
    """The undistorted depth image of a pinhole camera at the same pose.

    On a surface the inverse depth is interpolated, which is exact for planes; at edges, and beside pixels without a
    measurement, the nearest pixel is used.

    Args:
        depth: float32 (height, width) along the optical axis [m]; 0: no measurement.
        raw: intrinsics of the distorted image.
        straight: intrinsics of the result.
    """
    row, column, inside = _places(lens, raw, straight)
    top, left = np.floor(row).astype(np.intp), np.floor(column).astype(np.intp)
    bottom, right = np.minimum(top + 1, raw.height - 1), np.minimum(left + 1, raw.width - 1)
    down, across = row - top, column - left
    corners = np.stack([depth[top, left], depth[top, right], depth[bottom, left], depth[bottom, right]])
    least, most = corners.min(axis=0), corners.max(axis=0)
    smooth = (least > 0) & (most - least <= SMOOTH * least)
    shares = np.stack([(1 - down) * (1 - across), (1 - down) * across, down * (1 - across), down * across])
    inverse = np.sum(shares / np.where(corners > 0, corners, 1.0), axis=0)
    nearest = depth[np.rint(row).astype(np.intp), np.rint(column).astype(np.intp)]
    return np.where(inside, np.where(smooth, 1.0 / inverse, nearest), 0.0).astype(np.float32)
