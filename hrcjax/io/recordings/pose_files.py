"""Text files of poses, one a line."""

from pathlib import Path

import numpy as np

from hrcjax.io.recordings.files import text_lines
from hrcjax.io.recordings.pose import fault_of_numbers
from hrcjax.lab.errors import UsageError


def read_poses(path: Path, stamped: bool) -> np.ndarray:
    """Rows of the file, float64: tx ty tz qx qy qz qw (pose, 7), with a stamp before it (pose, 8) if `stamped`.

    Units: [s], [m], unit quaternion; camera to world. Lines that begin with # are comments.

    Raises:
        UsageError: a missing file, one without poses, a line with another count of numbers, numbers that are not
            finite, a quaternion whose norm is not 1.
    """
    names = "stamp tx ty tz qx qy qz qw" if stamped else "tx ty tz qx qy qz qw"
    accepted = f"a line '{names}' for each pose, camera to world, [m], unit quaternion"
    rows = []
    for number, line in text_lines(path, accepted):
        words = line.replace(",", " ").split()
        try:
            row = np.array(words, np.float64)
        except ValueError:
            raise UsageError(f"{path} line {number}: not a row of numbers; accepted is {accepted}") from None
        if row.size != len(names.split()):
            raise UsageError(f"{path} line {number}: {row.size} numbers; accepted is {accepted}")
        fault = fault_of_numbers(row[-7:]) or ("" if np.isfinite(row[0]) else "the stamp is not finite")
        if fault:
            raise UsageError(f"{path} line {number}: {fault}; accepted is {accepted}")
        rows.append(row)
    if not rows:
        raise UsageError(f"{path} holds no pose: accepted is {accepted}")
    return np.stack(rows)
