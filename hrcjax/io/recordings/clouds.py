"""Point clouds of PLY and NPZ files: one file, or a folder of them."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from hrcjax.io.recordings.files import files_with
from hrcjax.io.recordings.frame import InputFrame
from hrcjax.io.recordings.npz_file import RATE, measured_points, read_npz, unit_of_stamps
from hrcjax.io.recordings.ply_file import read_ply
from hrcjax.io.recordings.source import InputSource, Skip
from hrcjax.lab.errors import UsageError

SUFFIXES = (".ply", ".npz")


def open_clouds(
    path: Path, origin: Sequence[float] | None = None, rate: float | None = None, per_metre: float | None = None
) -> InputSource:
    """A PLY or NPZ file, or a folder of such files in natural order (2 before 10).

    A PLY file is one frame in world axes. Its sensor position is `origin`, or else that of the file's element `camera`
    (view_px, view_py, view_pz), or else the world's origin. NPZ files have their own poses; see `read_npz`. Points that are not
    finite or at the sensor itself are dropped.

    Args:
        path: the file or folder.
        origin: of the sensor in the world (3,) [m], for all PLY files.
        rate: frame rate of files or stacked frames without stamps [Hz]; if None 30, and speeds are not checked.
        per_metre: units of points and depth per metre; if None 1, and integers are refused.

    Raises:
        UsageError: no such file, an empty folder, an invalid origin, rate or scale.
    """
    path = Path(path)
    files = files_with(path, SUFFIXES) if path.is_dir() else [path]
    if not files:
        raise UsageError(f"{path} holds no point clouds: accepted are files *.ply and *.npz")
    if not path.exists():
        raise UsageError(f"no point cloud at {path}: accepted is a file *.ply or *.npz, or a folder of them")
    given = None if origin is None else np.array(origin, np.float64)
    if given is not None and (given.shape != (3,) or not np.isfinite(given).all()):
        raise UsageError(
            f"the origin of the sensor is {tuple(origin or ())}: accepted are three finite numbers x y z [m]"
        )
    for what, number in (("the rate of frames", rate), ("the scale of depth", per_metre)):
        if number is not None and not (np.isfinite(number) and number > 0):
            raise UsageError(f"{what} is {number}: accepted is a positive number")
    if given is not None and all(file.suffix.lower() == ".npz" for file in files):
        raise UsageError(
            f"{path} holds no PLY file for the origin: NPZ files have the sensor's position in the key position"
        )

    def read(skip: Skip) -> Iterator[InputFrame]:
        index = 0
        for file in files:
            if file.suffix.lower() == ".npz":
                index += yield from read_npz(file, index, rate, skip, per_metre)
                continue
            index += 1
            points, camera = read_ply(file, per_metre)
            position = given if given is not None else camera if camera is not None else np.zeros(3)
            cloud = measured_points(points - position)
            if len(cloud):
                stamp = (index - 1) / (rate or RATE)
                yield InputFrame(stamp, "", None, cloud, None, np.eye(3), position, timed=rate is not None)
            else:
                skip(f"{file.name}: no finite point")

    every_ply = all(file.suffix.lower() == ".ply" for file in files)
    unit = unit_of_stamps(files[0]) if files[0].suffix.lower() == ".npz" else "seconds"
    notes = (f"stamps of {files[0].name}, inferred from their magnitude, in {unit}",) if unit != "seconds" else ()
    return InputSource(path, "point clouds", len(files) if every_ply else None, read, notes=notes)
