"""Text files of poses, one per line, or one per file."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from hrcjax.io.recordings.files import files_with, text_lines
from hrcjax.io.recordings.pose import fault_of_numbers, fault_of_rotation
from hrcjax.lab.errors import UsageError

Faults = dict[int, tuple[str, str]]  # index of a row -> its location, and the error


def read_poses(path: Path, stamped: bool) -> tuple[np.ndarray, Faults]:
    """Rows of the file, float64: tx ty tz qx qy qz qw (pose, 7), with a stamp before it (pose, 8) if `stamped`.

    Units: [m], unit quaternion, scalar last; world from camera: R(q) p + t takes a point of the camera to the world.
    Without stamps a row may also be the matrix, 3 x 4 or 4 x 4, row by row. Lines that begin with # are comments.

    Returns:
        the rows, and the errors of invalid ones: trackers write zeros or infinities where tracking is lost.

    Raises:
        UsageError: a missing file, no valid pose, a line with another number of columns.
    """
    accepted = f"a line '{'stamp ' if stamped else ''}tx ty tz qx qy qz qw' for each pose, camera to world, [m], unit quaternion"
    lines = text_lines(path, accepted)
    counts = (8,) if stamped else (7, 12, 16)
    rows: list[np.ndarray] = []
    faults: Faults = {}
    for number, line in lines:
        words = line.replace(",", " ").split()
        try:
            row = np.array(words, np.float64)
        except ValueError:
            raise UsageError(f"{path} line {number}: not a row of numbers; accepted is {accepted}") from None
        if row.size not in counts:
            raise UsageError(f"{path} line {number}: {row.size} numbers; accepted is {accepted}")
        row, fault = _of_matrix(row) if row.size > 8 else (row, fault_of_numbers(row[-7:]))
        fault = fault or ("" if np.isfinite(row[0]) else "the stamp is not finite")
        if fault:
            faults[len(rows)] = f"line {number}", fault
        rows.append(row)
    if not rows:
        raise UsageError(f"{path} holds no pose: accepted is {accepted}")
    if len(faults) == len(rows):
        raise UsageError(f"{path} {': '.join(faults[0])}, and no other line is a valid pose; accepted is {accepted}")
    return np.stack(rows), faults


def read_pose_folder(folder: Path) -> tuple[np.ndarray, Faults]:
    """Rows tx ty tz qx qy qz qw (pose, 7) of a folder of files *.txt in natural order, each a matrix 4 x 4 or 3 x 4, camera
    to world [m]; else as `read_poses`."""
    accepted = "a file with a matrix 4 x 4, camera to world [m], for each pose"
    rows: list[np.ndarray] = []
    faults: Faults = {}
    for path in files_with(folder, (".txt",)):
        words = " ".join(line for _, line in text_lines(path, accepted)).replace(",", " ").split()
        try:
            numbers = np.array(words, np.float64)
        except ValueError:
            numbers = np.empty(0)
        if numbers.size not in (12, 16):
            raise UsageError(f"{path} is not a pose: accepted is {accepted}")
        row, fault = _of_matrix(numbers)
        if fault:
            faults[len(rows)] = path.name, fault
        rows.append(row)
    if len(faults) == len(rows):
        raise UsageError(f"{folder} holds no pose: accepted is {accepted}")
    return np.stack(rows), faults


def _of_matrix(numbers: np.ndarray) -> tuple[np.ndarray, str]:
    """tx ty tz qx qy qz qw of a matrix 3 x 4 or 4 x 4, and the error in it."""
    matrix = numbers.reshape(-1, 4)
    fault = fault_of_rotation(matrix[:3, :3]) or ("" if np.isfinite(matrix).all() else "a number is not finite")
    quaternion = np.zeros(4) if fault else Rotation.from_matrix(matrix[:3, :3]).as_quat()
    return np.concatenate([matrix[:3, 3], quaternion]), fault
