"""Units of stamps, found by their size."""

import numpy as np
import pytest

from hrcjax.io.recordings.joints import read_joints
from hrcjax.io.recordings.open_input import open_input
from hrcjax.io.recordings.stamps import UNITS, stamp_unit


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("begin", [0.0, 3.0, 90.0, 1.3e9, 1.76e9])
@pytest.mark.parametrize("rate", [0.5, 30.0, 90.0])
def test_every_unit_of_clocks_that_begin_somewhere(unit, begin, rate) -> None:
    seconds = begin + np.arange(40) / rate
    assert stamp_unit(np.round(seconds * UNITS[unit], 6)) == unit


def test_joints_come_faster_than_frames() -> None:
    stamps = np.arange(100) * 8.0  # 125 Hz in milliseconds, or one in 8 s
    assert stamp_unit(stamps) == "seconds" and stamp_unit(stamps, longest=1.0) == "milliseconds"


def test_few_stamps() -> None:
    assert stamp_unit(np.array([])) == stamp_unit(np.array([7.0])) == stamp_unit(np.array([5.0, 5.0])) == "seconds"
    assert stamp_unit(np.array([1.76e18])) == "nanoseconds" and stamp_unit(np.array([0.0, 10.0])) == "seconds"


def test_a_folder_in_nanoseconds_is_in_seconds(shared_cases) -> None:
    source = open_input(shared_cases / "stamps_in_ns" / "tum_ns")
    assert "depth.txt in nanoseconds, groundtruth.txt in nanoseconds" in source.notes[1]
    images = (shared_cases / "stamps_in_ns" / "tum_ns" / "depth.txt").read_text().splitlines()
    stamps = np.array([int(line.split()[0]) for line in images if line[0] != "#"])
    from hrcjax.io.recordings.frame import Intrinsics

    frames = list(open_input(source.path, intrinsics=Intrinsics(130, 130, 79.5, 59.5, 160, 120)))
    np.testing.assert_allclose([f.stamp for f in frames], stamps / 1e9, atol=1e-6)
    np.testing.assert_allclose([f.position[0] for f in frames], 0.02 * np.arange(6), atol=1e-6)


def test_npz_files_and_joints_too(tmp_path) -> None:
    stamps = 1_760_000_000_000_000_000 + np.arange(3) * 50_000_000
    np.savez(tmp_path / "a.npz", points=np.ones((3, 5, 3)), stamp=stamps)
    np.testing.assert_allclose([f.stamp - 1.76e9 for f in open_input(tmp_path / "a.npz")], [0, 0.05, 0.1], atol=1e-6)
    assert open_input(tmp_path / "a.npz").notes == ("stamps of a.npz, inferred from their magnitude, in nanoseconds",)
    np.savez(tmp_path / "q.npz", stamp=stamps, q=np.zeros((3, 6)))
    record = read_joints(tmp_path / "q.npz", np.full(6, 6.28))
    np.testing.assert_allclose(record.stamps - 1.76e9, [0, 0.05, 0.1], atol=1e-6)
    assert "in nanoseconds" in record.notes[1]
