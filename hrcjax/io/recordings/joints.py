"""Joint positions of an arm over time, and selection of the frames for which they are known."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hrcjax.io.recordings.frame import InputFrame
from hrcjax.io.recordings.source import InputSource, Skip
from hrcjax.io.recordings.stamps import UNITS, stamp_unit
from hrcjax.lab.errors import UsageError

TOLERANCE = 0.1
"""Largest time of a frame before the first or after the last record, whose joint positions are held [s]."""
GAP = 1.0
"""Largest time between two records for interpolation [s]."""
ROUND = 0.1
"""Tolerance of the joint limits [rad]."""
ORDER = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
"""Joints of a UR arm from the base to the flange, as ROS names them."""
ON_PENDANT = {"base": 0, "shoulder": 1}
"""Names of the first two on the teach pendant."""
NAMES = ("joint_names", "names", "name")
"""Keys under which a file may name the columns of q."""
ACCEPTED = (
    "an NPZ file with stamp (n), ascending [s], and q (n, 6), the joints of the arm from the base to the flange [rad], or "
    "q (n, m) and joint_names (m)"
)


class JointRecord:
    """Joint positions over time, linear between two records."""

    def __init__(
        self, path: Path, stamps: np.ndarray, q: np.ndarray, notes: tuple[str, ...] = (), named: bool = False
    ) -> None:
        self.path, self.stamps, self.q, self.notes, self.named = path, stamps, q, notes, named

    def at(self, stamp: float) -> np.ndarray | None:
        """Joint positions (6,) at `stamp` [rad]; None: not known."""
        if not (self.stamps[0] - TOLERANCE <= stamp <= self.stamps[-1] + TOLERANCE):
            return None
        after = int(np.searchsorted(self.stamps, stamp))
        if 0 < after < len(self.stamps) and self.stamps[after] - self.stamps[after - 1] > GAP:
            near = min(stamp - self.stamps[after - 1], self.stamps[after] - stamp)
            if near > TOLERANCE:
                return None
        return np.array([np.interp(stamp, self.stamps, column) for column in self.q.T])


def read_joints(path: Path, most: np.ndarray) -> JointRecord:
    """Reads a joint file.

    Args:
        most: largest absolute angle of each joint (6,) [rad].

    Raises:
        UsageError: a missing or broken file, other keys or shapes, numbers that are not finite, stamps that do not increase,
            angles beyond the joint limits.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except FileNotFoundError:
        raise UsageError(f"no joints at {path}: accepted is {ACCEPTED}") from None
    except Exception as error:  # a broken archive raises errors of many types
        raise _wrong(path, " ".join(str(error).split()) or type(error).__name__) from error
    named = [key for key in NAMES if key in arrays]
    if set(arrays) - set(named) != {"stamp", "q"} or len(named) > 1:
        raise _wrong(path, f"it holds {', '.join(sorted(arrays)) or 'nothing'}")
    stamps, q = arrays["stamp"], arrays["q"]
    if stamps.dtype.kind not in "fiu" or q.dtype.kind not in "fiu":
        raise _wrong(path, f"stamp is {stamps.dtype}, q is {q.dtype}")
    joints = [str(name) for name in np.ravel(arrays[named[0]])] if named else []
    columns = len(joints) if named else len(most)
    if stamps.ndim != 1 or not len(stamps) or q.shape != (len(stamps), columns):
        names = f", {named[0]} is {arrays[named[0]].shape}" if named else ""
        raise _wrong(path, f"stamp is {stamps.shape}, q is {q.shape}{names}")
    notes = [
        f"joints of {path.name}: {'by their names' if named else 'from the base to the flange (ASSUMED, no joint_names in the file)'}"
    ]
    unit = stamp_unit(stamps, longest=GAP)
    if unit != "seconds":
        notes.append(f"stamps of {path.name}, inferred from their magnitude, in {unit}")
    stamps, q = stamps.astype(np.float64) / UNITS[unit], q.astype(np.float64)
    if named:
        q = q[:, columns_of(path, joints)]
    if not (np.isfinite(stamps).all() and np.isfinite(q).all()):
        raise _wrong(path, "a number is not finite")
    if (np.diff(stamps) < 0).any():
        raise _wrong(path, "the stamps do not increase")
    if (np.abs(q) > most + ROUND).any():
        row, joint = np.argwhere(np.abs(q) > most + ROUND)[0]
        degrees = f" (degrees? the angles go up to {np.abs(q).max():.0f}; convert them by numpy.radians)"
        turned = degrees if (np.abs(q) <= np.degrees(most) + 1).all() else ""
        raise _wrong(
            path, f"joint {joint} of row {row} is {q[row, joint]:g}, beyond the limits of this arm [rad]{turned}"
        )
    return JointRecord(path, stamps, q, tuple(notes), bool(named))


def columns_of(path: Path, names: Sequence[str]) -> list[int]:
    """Column of each joint of ORDER among the names of a file; other joints, such as a gripper's, are ignored.

    Raises:
        UsageError: a joint is missing, or named twice.
    """
    known: dict[int, int] = {}
    for column, name in enumerate(names):
        plain = re.sub(r"[\s-]+", "_", name.strip().lower()).removesuffix("_joint")
        plain = re.sub(r"wrist_?([123])$", r"wrist_\1", plain)
        joint = next((k for k, end in enumerate(ORDER) if plain.endswith(end)), ON_PENDANT.get(plain))
        if joint is None:
            continue
        if joint in known:
            raise _wrong(path, f"joint {name} occurs twice")
        known[joint] = column
    missing = [name for k, name in enumerate(ORDER) if k not in known]
    if missing:
        raise _wrong(path, f"its joints are {', '.join(names)}; missing: {', '.join(missing)}")
    return [known[k] for k in range(len(ORDER))]


def with_joints(source: InputSource, record: JointRecord) -> InputSource:
    """The recording without the frames for which no joint positions are known; these are skipped and reported."""

    def read(skip: Skip) -> Iterator[InputFrame]:
        yield from _known(source, record, skip)

    return replace(source, read=read, skipped=[], notes=(*source.notes, *record.notes))


def _known(source: InputSource, record: JointRecord, skip: Callable[[str], None]) -> Iterator[InputFrame]:
    found, stamps = False, []
    for frame in source.read(skip):
        if record.at(frame.stamp) is None:
            stamps.append(frame.stamp)
            skip(f"frame at {frame.stamp:.3f} s: no joints in {record.path.name} at this time")
            continue
        found = True
        yield frame
    if stamps and not found:
        raise UsageError(
            f"{record.path}: no frame has joints (joints from {record.stamps[0]:.3f} to {record.stamps[-1]:.3f} s, frames "
            f"from {min(stamps):.3f} to {max(stamps):.3f} s): accepted are joints and frames of one clock"
        )


def _wrong(path: Path, what: str) -> UsageError:
    return UsageError(f"joints {path}: {what}; accepted is {ACCEPTED}")
