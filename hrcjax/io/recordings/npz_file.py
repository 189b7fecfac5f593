"""NPZ files of depth or points: one frame, or many stacked along the first axis."""

from collections.abc import Generator, Mapping
from pathlib import Path

import numpy as np

from hrcjax.io.recordings.frame import InputFrame, Intrinsics
from hrcjax.io.recordings.images import clean_depth
from hrcjax.io.recordings.pose import fault_of_rotation
from hrcjax.io.recordings.source import Skip
from hrcjax.io.recordings.stamps import UNITS, stamp_unit
from hrcjax.lab.errors import UsageError

KEYS = ("points", "depth", "intrinsics", "color", "mask", "stamp", "rotation", "position")
ACCEPTED = (
    "points (n, 3), or depth (height, width) with intrinsics (fx, fy, cx, cy) [m, px]; optionally mask, "
    "stamp, rotation, position; stacked frames along a first axis"
)


RATE = 30.0
"""Default frame rate [Hz]."""


def read_npz(
    path: Path, index: int, rate: float | None, skip: Skip, per_metre: float | None = None
) -> Generator[InputFrame, None, int]:
    """The frames of one NPZ file; the generator returns their number in the file, including skipped ones.

    Only these keys are accepted; a file of F stacked frames has `points` or `depth` with one axis more:

    * `points` (n, 3) or (F, n, 3): in camera axes [m]; or
    * `depth` (height, width) or (F, height, width): along the camera's z [m], 0 or NaN without measurement, with
      `intrinsics` (4,) or (F, 4): fx, fy, cx, cy [px]; `color` is ignored;
    * `mask`, the shape of depth, or of points without the last axis: true for valid entries; optional;
    * `stamp`, a number or (F,) [s], or in milliseconds, microseconds or nanoseconds, inferred from their magnitude; without it
      frame i of all files is at i / `rate`;
    * `rotation` (3, 3) or (F, 3, 3), world from camera, and `position` (3,) or (F, 3) [m]; without them the pose is
      the identity.

    Args:
        path: the file.
        index: number of frames in the files before.
        rate: frame rate if there are no stamps [Hz]; None: not known, RATE is used.
        skip: called for frames without a point or without a valid pose.
        per_metre: units of depth or points per metre; if None 1. `position` is always in metres.

    Raises:
        UsageError: a missing or broken file, other keys, other shapes, integers without a unit, no valid pose, intrinsics or
            stamps that are not finite.
    """
    arrays = _load(path)
    unknown = sorted(set(arrays) - set(KEYS))
    if unknown or ("points" in arrays) == ("depth" in arrays) or ("depth" in arrays) != ("intrinsics" in arrays):
        keys = ", ".join(sorted(arrays)) or "nothing"
        raise _wrong(path, f"it holds {keys}" + (f"; not known: {', '.join(unknown)}" if unknown else ""))
    key = "depth" if "depth" in arrays else "points"
    values = arrays[key]
    if "color" in arrays and key == "points":
        raise _wrong(path, "color is accepted only with depth")
    stacked = values.ndim == 3
    if values.ndim not in (2, 3) or values.dtype.kind not in "fiu" or (key == "points" and values.shape[-1] != 3):
        raise _wrong(path, f"{key} is {values.dtype} {values.shape}")
    if values.dtype.kind in "iu" and per_metre is None:
        least, most = (values.min(), values.max()) if values.size else (0, 0)
        raise UsageError(
            f"NPZ file {path}: {key} is {values.dtype}, from {least} to {most}; integers are not metres: accepted is the "
            "number of units per metre by --per-metre (1000: millimetres)"
        )
    count = len(values) if stacked else 1
    if not stacked:
        values = values[None]
    items = {"mask": values.shape[1:] if key == "depth" else values.shape[1:2], "stamp": (), "intrinsics": (4,)}
    items |= {"rotation": (3, 3), "position": (3,)}
    each = {
        name: _each(path, name, arrays[name], shape, count, stacked) for name, shape in items.items() if name in arrays
    }
    for name in ("stamp", "intrinsics"):
        if name in each and not np.isfinite(each[name]).all():
            raise _wrong(path, f"a number of {name} is not finite")
    unit = stamp_unit(np.ravel(each["stamp"])) if "stamp" in each else "seconds"
    faults = [_fault_of_pose(each, i) for i in range(count)]
    if count and all(faults):
        raise _wrong(path, f"frame 0: {faults[0]}")
    for i in range(count):
        if faults[i]:
            skip(f"{path.name} frame {i}: {faults[i]}")
            continue
        rotation = np.array(each["rotation"][i], np.float64) if "rotation" in each else np.eye(3)
        position = np.array(each["position"][i], np.float64) if "position" in each else np.zeros(3)
        stamp = float(each["stamp"][i] / UNITS[unit]) if "stamp" in each else (index + i) / (rate or RATE)
        timed = "stamp" in each or rate is not None
        mask = each["mask"][i].astype(bool) if "mask" in each else np.True_
        if key == "depth":
            depth = clean_depth(np.where(mask, values[i], 0) / (per_metre or 1.0))
            fx, fy, cx, cy = (float(number) for number in each["intrinsics"][i])
            intrinsics = Intrinsics(fx, fy, cx, cy, depth.shape[1], depth.shape[0])
            yield InputFrame(stamp, "", depth, None, intrinsics, rotation, position, timed)
            continue
        cloud = measured_points(values[i][np.broadcast_to(mask, len(values[i]))] / (per_metre or 1.0))
        if len(cloud) == 0:
            skip(f"{path.name} frame {i}: no finite point")
            continue
        yield InputFrame(stamp, "", None, cloud, None, rotation, position, timed)
    return count


def _fault_of_pose(each: Mapping[str, np.ndarray], i: int) -> str:
    """The error in the pose of frame i; "": none."""
    fault = fault_of_rotation(np.asarray(each["rotation"][i], np.float64)) if "rotation" in each else ""
    if not fault and "position" in each and not np.isfinite(each["position"][i]).all():
        fault = "a number of position is not finite"
    return fault


def unit_of_stamps(path: Path) -> str:
    """The unit of a file's stamps, inferred from their magnitude; seconds if it has none or is broken, which its reader reports."""
    try:
        with np.load(path, allow_pickle=False) as file:
            return stamp_unit(np.ravel(file["stamp"]).astype(np.float64)) if "stamp" in file.files else "seconds"
    except Exception:  # a broken archive raises errors of many types
        return "seconds"


def measured_points(points: np.ndarray) -> np.ndarray:
    """Valid rows of points (n, 3) in sensor axes, float32: finite, and not at the sensor itself."""
    cloud = np.asarray(points, np.float32)
    return cloud[np.isfinite(cloud).all(axis=1) & (cloud != 0).any(axis=1)]


def _each(path: Path, name: str, array: np.ndarray, shape: tuple, count: int, stacked: bool) -> np.ndarray:
    """The array with a leading frame axis; a single value is used for all frames."""
    if array.dtype.kind not in "fiub":
        raise _wrong(path, f"{name} is {array.dtype}")
    array = np.squeeze(array) if shape == () and array.size == 1 else array
    if array.shape == shape:
        if name == "stamp" and stacked and count > 1:
            raise _wrong(path, f"one stamp for {count} frames")
        return np.broadcast_to(array, (count, *shape))
    if stacked and array.shape == (count, *shape):
        return array
    raise _wrong(path, f"{name} has the shape {array.shape}, needed is {(count, *shape) if stacked else shape}")


def _load(path: Path) -> Mapping[str, np.ndarray]:
    try:
        file = np.load(path, allow_pickle=False)
        if isinstance(file, np.ndarray):
            raise TypeError("one array without a name")
        with file:
            return {key: file[key] for key in file.files}
    except FileNotFoundError:
        raise UsageError(f"no NPZ file at {path}: accepted is {ACCEPTED}") from None
    except Exception as error:  # a broken archive raises errors of many types
        raise _wrong(path, " ".join(str(error).split()) or type(error).__name__) from error


def _wrong(path: Path, what: str) -> UsageError:
    return UsageError(f"NPZ file {path}: {what}; accepted are {ACCEPTED}")
