"""Frames without a pose are passed over and counted; matrices are poses too; clouds and depth in other units."""

import shutil

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.io.recordings.open_input import open_input
from hrcjax.lab.errors import UsageError

CAMERA = Intrinsics(130, 130, 79.5, 59.5, 160, 120)


@pytest.fixture
def base(shared_cases, tmp_path):
    folder = tmp_path / "base"
    shutil.copytree(shared_cases / "small_recording" / "base", folder)
    for path in [folder, *folder.rglob("*")]:
        path.chmod(0o755)
    return folder


@pytest.mark.parametrize("line", ["0 0 0 0 0 0 0", " ".join(["-inf"] * 7), "nan 0 0 0 0 0 1"])
def test_lines_without_a_pose(base, line) -> None:
    lines = (base / "pose.txt").read_text().splitlines()
    lines[3] = line
    (base / "pose.txt").write_text("\n".join(lines))
    source = open_input(base, intrinsics=CAMERA)
    frames = list(source)
    np.testing.assert_allclose([f.position[0] for f in frames], [0, 0.02, 0.04, 0.08, 0.1], atol=1e-6)
    assert len(source.skipped) == 1 and source.skipped[0].startswith("3.png, pose.txt line 4: no pose (")
    (base / "pose.txt").write_text("\n".join([line] * 6))
    with pytest.raises(UsageError, match=r"pose\.txt line 1: .* no other line is a valid pose"):
        open_input(base, intrinsics=CAMERA)


def test_tum_lines_without_a_pose(shared_cases, tmp_path) -> None:
    folder = tmp_path / "tum"
    shutil.copytree(shared_cases / "stamps_in_ns" / "tum_ns", folder)
    for path in [folder, *folder.rglob("*")]:
        path.chmod(0o755)
    text = (folder / "groundtruth.txt").read_text().splitlines()
    text[2] = text[2].split()[0] + " 0 0 0 0 0 0 0"
    (folder / "groundtruth.txt").write_text("\n".join(text))
    source = open_input(folder, intrinsics=CAMERA)
    assert len(list(source)) == 5 and source.skipped[0].startswith("groundtruth.txt line 3: no pose")


def test_npz_frames_without_a_pose(tmp_path) -> None:
    position = np.zeros((3, 3))
    position[1] = -np.inf
    np.savez(tmp_path / "a.npz", points=np.ones((3, 5, 3)), position=position)
    source = open_input(tmp_path / "a.npz")
    assert len(list(source)) == 2 and source.skipped == ["a.npz frame 1: a number of position is not finite"]


def test_poses_as_matrices_in_one_file_or_in_a_folder(base) -> None:
    expected = [(f.rotation, f.position) for f in open_input(base, intrinsics=CAMERA)]
    matrices = [np.vstack([np.column_stack([r, t]), [0, 0, 0, 1]]) for r, t in expected]
    (base / "pose.txt").write_text("\n".join(" ".join(f"{v:.9f}" for v in m[:3].ravel()) for m in matrices))
    for f, (r, t) in zip(open_input(base, intrinsics=CAMERA), expected, strict=True):
        np.testing.assert_allclose(f.rotation, r, atol=1e-6)
        np.testing.assert_allclose(f.position, t, atol=1e-6)
    (base / "pose.txt").unlink()
    (base / "pose").mkdir()
    matrices[2][:] = -np.inf  # as ScanNet writes a pose that was lost
    for k, m in enumerate(matrices):
        np.savetxt(base / "pose" / f"{k}.txt", m)
    source = open_input(base, intrinsics=CAMERA)
    frames = list(source)
    assert len(frames) == 5 and source.skipped[0].startswith("2.png, pose/ 2.txt: no pose")
    np.testing.assert_allclose(frames[2].position, expected[3][1], atol=1e-6)
    np.testing.assert_allclose(frames[2].rotation, expected[3][0], atol=1e-6)


def test_colour_of_another_size_is_not_looked_at(shared_cases) -> None:
    assert len(list(open_input(shared_cases / "colour_of_other_size" / "scannet", intrinsics=CAMERA))) == 6


def test_frames_without_stamps_say_so_unless_the_rate_is_given(base) -> None:
    assert [f.timed for f in open_input(base, intrinsics=CAMERA)] == [False] * 6
    frames = list(open_input(base, intrinsics=CAMERA, rate=10))
    assert [f.timed for f in frames] == [True] * 6 and frames[5].stamp == 0.5


def test_whole_numbers_need_a_unit_and_get_it(shared_cases, tmp_path) -> None:
    path = shared_cases / "wrong_unit_empty_map" / "mm_uint16.npz"
    with pytest.raises(UsageError, match=r"depth is uint16, from 1025 to 1911; .*--per-metre \(1000: millimetres\)"):
        list(open_input(path))
    frame = next(iter(open_input(path, per_metre=1000)))
    with np.load(path) as file:
        np.testing.assert_allclose(frame.depth, file["depth"][0] / 1000, rtol=1e-6)
        np.testing.assert_allclose(frame.position, file["position"][0])  # in metres always
    np.savez(tmp_path / "points.npz", points=np.array([[1000, 0, 500], [0, 2000, 0]]))
    with pytest.raises(UsageError, match="points is int64, from 0 to 2000"):
        list(open_input(tmp_path / "points.npz"))
    (frame,) = open_input(tmp_path / "points.npz", per_metre=1000)
    np.testing.assert_allclose(frame.cloud, [[1, 0, 0.5], [0, 2, 0]])


@pytest.mark.parametrize("kind", ["float", "int", "short", "uint16"])
def test_ply_in_millimetres(tmp_path, kind) -> None:
    header = "ply\nformat ascii 1.0\nelement vertex 2\n" + "".join(f"property {kind} {n}\n" for n in "xyz")
    camera = "element camera 1\nproperty float view_px\nproperty float view_py\nproperty float view_pz\n"
    (tmp_path / "a.ply").write_text(header + camera + "end_header\n1000 0 500\n0 2000 0\n0 0 1000\n")
    if kind != "float":
        with pytest.raises(UsageError, match=rf"integers \({kind}\).*--per-metre"):
            list(open_input(tmp_path / "a.ply"))
    (frame,) = open_input(tmp_path / "a.ply", per_metre=1000)
    np.testing.assert_allclose(frame.cloud + frame.position, [[1, 0, 0.5], [0, 2, 0]], atol=1e-6)
    np.testing.assert_allclose(frame.position, [0, 0, 1])


def test_quaternions_are_scalar_last_and_poses_from_the_camera(base) -> None:
    """The convention of the documents: a camera turned by 90 degrees about z at (1, 2, 3)."""
    q = Rotation.from_euler("z", 90, degrees=True).as_quat()
    (base / "pose.txt").write_text((f"1 2 3 {q[0]} {q[1]} {q[2]} {q[3]}\n") * 6)
    frame = next(iter(open_input(base, intrinsics=CAMERA)))
    np.testing.assert_allclose(frame.rotation @ [1, 0, 0] + frame.position, [1, 3, 3], atol=1e-9)
    assert Image.open(base / "depth" / "0.png").size == (160, 120)
