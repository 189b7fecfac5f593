"""Folders of depth images: real frames that must agree in the world, written TUM folders, broken ones."""

import shutil
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from hrcjax.io.recordings.frame import InputFrame, Intrinsics
from hrcjax.io.recordings.images import clean_depth, read_depth
from hrcjax.io.recordings.open_input import open_input
from hrcjax.io.recordings.pose import Trajectory
from hrcjax.lab.errors import UsageError

SMALL = Intrinsics(50.0, 51.0, 3.5, 2.5, 8, 6)


def _one_line(error) -> str:
    message = str(error.value)
    assert "\n" not in message and ("accepted" in message or "give" in message)
    return message


def _points(frame, stride):
    """Measured points up to 5 m in camera axes (point, 3) [m]."""
    v, u = np.mgrid[0 : frame.depth.shape[0] : stride, 0 : frame.depth.shape[1] : stride]
    z, camera = frame.depth[::stride, ::stride], frame.intrinsics
    points = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z], -1)
    return points[(z > 0) & (z < 5)]


def _disagreement(first, second, pose):
    """Median distance [m] of points of the second frame to those of the first, both put into the world by `pose`."""
    (rotation, position), (rotation2, position2) = pose(first), pose(second)
    world = _points(first, 2) @ rotation.T + position
    return float(np.median(cKDTree(world).query(_points(second, 8) @ rotation2.T + position2)[0]))


def test_real_frames_agree_in_the_world(shared_data):
    source = open_input(shared_data / "rgbd")
    frames = list(source)
    assert source.length == len(frames) == 5 and source.skipped == []
    assert [round(f.stamp * 30) for f in frames] == [0, 1, 2, 3, 4]
    for f in frames:
        assert f.depth.dtype == np.float32 and f.depth.shape == (480, 640) and f.cloud is None and f.camera == ""
        assert f.rotation.dtype == f.position.dtype == np.float64
    agree = [_disagreement(a, b, lambda f: (f.rotation, f.position)) for a, b in pairwise(frames[1:])]
    assert max(agree) < 0.025
    for wrong in (
        lambda f: (f.rotation.T, f.position),
        lambda f: (f.rotation.T, -f.rotation.T @ f.position),
        lambda f: (np.eye(3), f.position),
        lambda f: (f.rotation, -f.position),
    ):
        assert max(_disagreement(a, b, wrong) for a, b in pairwise(frames[1:])) > 0.1


def test_scale_of_real_depth(shared_data):
    near = next(iter(open_input(shared_data / "rgbd")))
    half = next(iter(open_input(shared_data / "rgbd", per_metre=2000)))
    raw = np.asarray(Image.open(shared_data / "rgbd" / "depth" / "1.pgm"))
    np.testing.assert_allclose(near.depth, raw / 1000, rtol=1e-6)
    np.testing.assert_allclose(half.depth, raw / 2000, rtol=1e-6)


def _numbered(folder, count=3, suffix="png"):
    """A folder of 8x6 pixels; image i is 1 + i m away everywhere but for one pixel; the camera is at x = i."""
    (folder / "depth").mkdir(parents=True)
    lines = []
    for i in range(count):
        raw = np.full((6, 8), 1000 * (i + 1), np.uint16)
        raw[2, 3] = 0
        Image.fromarray(raw).save(folder / "depth" / f"{i + 1}.{suffix}")
        lines.append(f"{i} 0 0 0 0 0 1")
    (folder / "pose.txt").write_text("# camera to world\n" + "\n".join(lines) + "\n")
    return folder


def test_numbered_images_are_taken_in_natural_order(tmp_path):
    frames = list(open_input(_numbered(tmp_path / "a", 11), intrinsics=SMALL, rate=10.0))
    assert [f.position[0] for f in frames] == list(range(11))
    assert [float(f.depth[0, 0]) for f in frames] == list(range(1, 12))
    assert frames[10].stamp == 1.0 and frames[0].depth[2, 3] == 0


def test_a_source_starts_again_at_each_iteration(tmp_path):
    source = open_input(_numbered(tmp_path / "a"), intrinsics=SMALL)
    assert [f.stamp for f in source] == [f.stamp for f in source]


def test_pgm_of_another_maximum_keeps_its_numbers(tmp_path):
    raw = (np.arange(48).reshape(6, 8) * 100).astype(">u2")
    (tmp_path / "a.pgm").write_bytes(b"P5\n8 6\n5000\n" + raw.tobytes())
    np.testing.assert_allclose(read_depth(tmp_path / "a.pgm", 1000, SMALL), raw / 1000.0, rtol=1e-6)


def test_what_is_not_measured_is_zero():
    depth = clean_depth(np.array([[np.nan, np.inf, -np.inf], [-1.0, 0.0, 2.5]]))
    assert depth.dtype == np.float32 and depth.tolist() == [[0, 0, 0], [0, 0, 2.5]]


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("0 0 0 0 0 1\n", "line 1: 6 numbers"),
        ("0 0 nan 0 0 0 1\n", "line 1: a number is not finite"),
        ("# none\n0 0 0 0.5 0 0 1\n", "line 2: the norm of the quaternion is 1.118"),
        ("0 0 0 0 0 0 0\n", "norm of the quaternion is 0"),
        ("0 0 0 0 0 0 one\n", "line 1: not a row of numbers"),
        ("# nothing\n", "holds no pose"),
        ("0 0 0 0 0 0 1\n", "3 depth images and pose.txt 1 poses"),
    ],
)
def test_broken_poses(tmp_path, lines, words):
    folder = _numbered(tmp_path / "a")
    (folder / "pose.txt").write_text(lines)
    with pytest.raises(UsageError) as error:
        open_input(folder, intrinsics=SMALL)
    assert words in _one_line(error) and "pose.txt" in str(error.value)


def test_poses_that_are_missing_or_no_text(tmp_path):
    folder = _numbered(tmp_path / "a")
    (folder / "pose.txt").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(UsageError, match="cannot be read") as error:
        open_input(folder, intrinsics=SMALL)
    _one_line(error)
    (folder / "pose.txt").unlink()
    with pytest.raises(UsageError, match=r"pose\.txt is missing") as error:
        open_input(folder, intrinsics=SMALL)
    _one_line(error)


def _truncate(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


@pytest.mark.parametrize("suffix", ["png", "pgm"])
def test_truncated_image(tmp_path, suffix):
    folder = _numbered(tmp_path / "a", suffix=suffix)
    _truncate(folder / "depth" / f"2.{suffix}")
    frames = iter(open_input(folder, intrinsics=SMALL))
    next(frames)
    with pytest.raises(UsageError, match=rf"2\.{suffix} cannot be read") as error:
        next(frames)
    _one_line(error)


def test_image_that_is_none(tmp_path):
    folder = _numbered(tmp_path / "a")
    (folder / "depth" / "1.png").write_bytes(b"nothing")
    with pytest.raises(UsageError, match="cannot be read") as error:
        list(open_input(folder, intrinsics=SMALL))
    _one_line(error)


def test_image_of_another_size(tmp_path):
    with pytest.raises(UsageError, match="8x6 pixels, the intrinsics are for 640x480") as error:
        list(open_input(_numbered(tmp_path / "a")))
    _one_line(error)


def test_image_of_eight_bits(tmp_path):
    folder = _numbered(tmp_path / "a")
    Image.fromarray(np.zeros((6, 8), np.uint8)).save(folder / "depth" / "1.png")
    with pytest.raises(UsageError, match="pixels of type L") as error:
        list(open_input(folder, intrinsics=SMALL))
    _one_line(error)


def test_nothing_empty_unknown_and_foreign_options(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "text").mkdir()
    (tmp_path / "text" / "a.txt").write_text("a")
    shutil.copytree(_numbered(tmp_path / "a"), tmp_path / "none")
    for image in (tmp_path / "none" / "depth").iterdir():
        image.unlink()
    for name, options, words in (
        ("missing", {}, "nothing at"),
        ("empty", {}, "is empty"),
        ("text", {}, "not a supported recording"),
        ("text/a.txt", {}, "not a supported recording"),
        ("none", {}, "holds no depth images"),
        ("a", {"world_frame": "map"}, "world_frame does not apply"),
        ("a", {"per_metre": 0.0}, "scale of depth is 0"),
        ("a", {"rate": float("nan")}, "rate of frames is nan"),
    ):
        with pytest.raises(UsageError) as error:
            open_input(tmp_path / name, **options)
        assert words in _one_line(error)


def test_broken_intrinsics():
    for numbers in ((0.0, 1.0, 1.0, 1.0, 4, 4), (1.0, np.nan, 1.0, 1.0, 4, 4), (1.0, 1.0, 1.0, 1.0, 0, 4)):
        with pytest.raises(UsageError, match="intrinsics") as error:
            Intrinsics(*numbers)
        _one_line(error)


def test_a_frame_is_depth_or_cloud():
    depth, cloud = np.zeros((6, 8), np.float32), np.zeros((2, 3), np.float32)
    for given in ((None, None), (depth, cloud), (None, cloud.T), (depth[:, 1:], None)):
        with pytest.raises(ValueError):
            InputFrame(0.0, "", *given, SMALL, np.eye(3), np.zeros(3))


def _tum(folder, pose_stamps, image_stamps):
    """A TUM folder: the camera moves at 0.5 m/s along x and turns at 1 rad/s about z; stamps begin at 1e9 s."""
    (folder / "depth").mkdir(parents=True)
    depth, poses = ["# stamp filename"], ["# stamp tx ty tz qx qy qz qw"]
    for t in image_stamps:
        Image.fromarray(np.full((6, 8), 5000, np.uint16)).save(folder / "depth" / f"{t:.4f}.png")
        depth.append(f"{1e9 + t:.6f} depth/{t:.4f}.png")
    for t in pose_stamps:
        q = Rotation.from_rotvec([0, 0, t]).as_quat()
        poses.append(f"{1e9 + t:.6f} {0.5 * t:.9f} 2 3 " + " ".join(f"{x:.9f}" for x in q))
    (folder / "depth.txt").write_text("\n".join(depth))
    (folder / "groundtruth.txt").write_text("\n".join(poses))
    return folder


def test_tum_poses_are_interpolated_and_frames_without_are_named(tmp_path):
    poses = [0.0, 0.01, 0.03, 0.04, 0.5, 0.51]
    images = [0.0, 0.013, 0.035, 0.2, 0.49, 0.525, 0.6]
    source = open_input(_tum(tmp_path / "t", poses, images), intrinsics=SMALL)
    frames = list(source)
    stamps = np.array([f.stamp - 1e9 for f in frames])
    np.testing.assert_allclose(stamps, [0.0, 0.013, 0.035, 0.49, 0.525], atol=1e-6)
    assert source.length == 5 and len(source.skipped) == 2
    assert len(list(source)) == 5 and len(source.skipped) == 2  # each iteration tells its own
    assert "0.2000.png" in source.skipped[0] and "0.6000.png" in source.skipped[1]
    for f, t in zip(frames, stamps, strict=True):
        t = min(t, 0.51)  # after the last pose it is held
        np.testing.assert_allclose(f.position, [0.5 * t, 2, 3], atol=1e-6)
        np.testing.assert_allclose(f.rotation, Rotation.from_rotvec([0, 0, t]).as_matrix(), atol=2e-6)
        assert (f.depth == 1).all()
    assert len(list(open_input(source.path, intrinsics=SMALL, tolerance=0.2))) == 7


def test_tum_defaults(tmp_path):
    folder = _tum(tmp_path / "t", [0.0], [0.0])
    Image.fromarray(np.full((480, 640), 10000, np.uint16)).save(folder / "depth" / "0.0000.png")
    (frame,) = open_input(folder)
    assert (frame.depth == 2).all()
    assert frame.intrinsics == Intrinsics(525.0, 525.0, 319.5, 239.5, 640, 480)


def test_tum_stamps_that_repeat_or_turn_back_are_passed_through(tmp_path):
    source = open_input(_tum(tmp_path / "t", [0.0, 0.01, 0.01, 0.0], [0.01, 0.01, 0.0]), intrinsics=SMALL)
    np.testing.assert_allclose([f.stamp - 1e9 for f in source], [0.01, 0.01, 0.0], atol=1e-6)


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        ("depth.txt", "0.1\n", "line 1: no stamp with a file's name"),
        ("depth.txt", "zero depth/0.0000.png\n", "line 1: no stamp with a file's name"),
        ("depth.txt", "0.1 depth/none.png\n", "none.png is missing"),
        ("depth.txt", "# empty\n", "lists no image"),
        ("groundtruth.txt", "0 0 0 0 0 0 1\n", "line 1: 7 numbers"),
        ("groundtruth.txt", "nan 0 0 0 0 0 0 1\n", "the stamp is not finite"),
        ("groundtruth.txt", "5 0 0 0 0 0 0 1\n", "none of the 1 depth images has a pose within 0.02 s"),
        ("groundtruth.txt", None, "groundtruth.txt is missing"),
    ],
)
def test_broken_tum_folders(tmp_path, file, text, words):
    folder = _tum(tmp_path / "t", [0.0], [0.0])
    if text is None:
        (folder / file).unlink()
    else:
        (folder / file).write_text(text)
    with pytest.raises(UsageError) as error:
        open_input(folder, intrinsics=SMALL)
    assert words in _one_line(error)


def test_trajectory_turns_the_short_way():
    rows = np.array([[0, 0, 0, 0, *Rotation.from_rotvec([0, 0, 0.1]).as_quat()], [1, 1, 0, 0, 0, 0, 0, -1]])
    pose = Trajectory(rows[::-1]).at(0.5, 1.0)
    assert pose is not None
    np.testing.assert_allclose(pose.rotation, Rotation.from_rotvec([0, 0, 0.05]).as_matrix(), atol=1e-12)
    assert pose.position[0] == 0.5
