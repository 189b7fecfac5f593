"""PLY and NPZ files, written here byte by byte, and broken ones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hrcjax.io.recordings.open_input import open_input
from hrcjax.lab.errors import UsageError

POINTS = np.array([[1.0, 2.0, 3.0], [-1.5, 0.25, 4.0], [0.5, 0.5, 0.5]])
CAMERA = (
    "element camera 1\nproperty float view_px\nproperty float view_py\nproperty float view_pz\nproperty int viewportx\n"
)


def _one_line(error) -> str:
    message = str(error.value)
    assert "\n" not in message and "accepted" in message
    return message


def _write_ply(path, points, kind="ascii", camera=None, face=False):
    """Points with a color each, x as a double and y, z as floats, as ASCII or binary of either byte order."""
    order = ">" if kind.startswith("binary_big") else "<"
    header = f"ply\nformat {kind} 1.0\ncomment written by a test\nobj_info any\nelement vertex {len(points)}\n"
    header += "property double x\nproperty uchar red\nproperty float y\nproperty float z\n"
    header += CAMERA if camera else ""
    header += "element face 1\nproperty list uchar int vertex_indices\n" if face else ""
    header += "end_header\n"
    if kind == "ascii":
        body = "".join(f"{x} 7 {y} {z}\n" for x, y, z in points)
        body += "{} {} {} 640\n".format(*camera) if camera else ""
        body += "3 0 1 2\n" if face else ""
        path.write_bytes((header + body).encode())
        return path
    rows = np.zeros(len(points), [("x", order + "f8"), ("red", "u1"), ("y", order + "f4"), ("z", order + "f4")])
    rows["x"], rows["y"], rows["z"] = np.reshape(points, (-1, 3)).T
    body = rows.tobytes()
    if camera:
        body += np.array(camera, order + "f4").tobytes() + np.array([640], order + "i4").tobytes()
    if face:
        body += b"\x03" + np.array([0, 1, 2], order + "i4").tobytes()
    path.write_bytes(header.encode() + body)
    return path


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("face", [False, True])
def test_ply_points_are_of_the_world(tmp_path, kind, face):
    points = np.vstack([POINTS, [[np.nan, 0, 0], [1, 1, np.inf]]])
    path = _write_ply(tmp_path / "a.ply", points, kind, (0.25, -0.5, 1.0), face)
    source = open_input(path)
    (frame,) = source
    assert source.length == 1 and source.skipped == [] and frame.depth is None and frame.intrinsics is None
    assert frame.cloud.dtype == np.float32 and frame.cloud.shape == (3, 3)
    assert frame.position.tolist() == [0.25, -0.5, 1.0]
    np.testing.assert_allclose(frame.cloud @ frame.rotation.T + frame.position, POINTS, atol=1e-6)
    (frame,) = open_input(path, origin=(1, 2, 3))  # the origin of the caller goes before that of the file
    assert frame.position.tolist() == [1, 2, 3]
    np.testing.assert_allclose(frame.cloud + frame.position, POINTS[1:], atol=1e-6)  # one point is at the sensor
    (frame,) = open_input(_write_ply(tmp_path / "b.ply", POINTS, kind, None, face))
    assert frame.position.tolist() == [0, 0, 0]


def test_a_folder_of_clouds_is_taken_in_natural_order(tmp_path):
    for i in (10, 2, 1):
        _write_ply(tmp_path / f"{i}.ply", POINTS + i)
    _write_ply(tmp_path / "3.ply", np.empty((0, 3)))
    source = open_input(tmp_path, rate=10.0)
    frames = list(source)
    assert [round(float(f.cloud[0, 0])) - 1 for f in frames] == [1, 2, 10] and source.length == 4
    np.testing.assert_allclose([f.stamp for f in frames], [0, 0.1, 0.3])
    assert source.skipped == ["3.ply: no finite point"]


HEADER = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("solid\n", "does not begin with ply"),
        ("", "does not begin with ply"),
        (HEADER, "does not end with end_header"),
        (HEADER + "end_header\n1 2\n3 4\n", "vertices have no z"),
        (HEADER + "element face 0\nproperty float z\nend_header\n1 2\n3 4\n", "vertices have no z"),
        (HEADER + "property float z\nend_header\n1 2 3\n", "2 vertices are declared, but there are 1"),
        (HEADER + "property float z\nend_header\n1 2 3\n4 5\n", "broken PLY file"),
        (HEADER + "property float z\nend_header\n1 2 3\nfour 5 6\n", "broken PLY file"),
        (HEADER + "property quad z\nend_header\n1 2 3\n4 5 6\n", "broken PLY file"),
    ],
)
def test_broken_ply(tmp_path, text, words):
    (tmp_path / "a.ply").write_text(text)
    with pytest.raises(UsageError) as error:
        list(open_input(tmp_path / "a.ply"))
    assert words in _one_line(error) and "a.ply" in str(error.value)


def test_truncated_binary_ply(tmp_path):
    path = _write_ply(tmp_path / "a.ply", POINTS, "binary_little_endian")
    path.write_bytes(path.read_bytes()[:-5])
    with pytest.raises(UsageError, match="broken PLY file") as error:
        list(open_input(path))
    _one_line(error)


def test_origin_that_is_none(tmp_path):
    _write_ply(tmp_path / "a.ply", POINTS)
    np.savez(tmp_path / "b.npz", points=POINTS)
    for name, origin in (("a.ply", (1, 2)), ("a.ply", (1, 2, np.nan)), ("b.npz", (1, 2, 3))):
        with pytest.raises(UsageError, match="origin"):
            open_input(tmp_path / name, origin=origin)
    with pytest.raises(UsageError, match="rate of frames is 0"):
        open_input(tmp_path / "a.ply", rate=0.0)


def test_npz_of_one_frame(tmp_path):
    rotation = Rotation.from_rotvec([0.1, -0.2, 0.3]).as_matrix()
    points = np.vstack([POINTS, [[np.nan, 1, 1], [0, 0, 0]]])
    path = tmp_path / "a.npz"
    np.savez(path, points=points, stamp=3.5, rotation=rotation, position=[1.0, 2.0, 3.0])
    (frame,) = open_input(path)
    assert frame.stamp == 3.5 and frame.cloud.dtype == np.float32 and frame.position.tolist() == [1, 2, 3]
    np.testing.assert_allclose(frame.cloud, POINTS)
    np.testing.assert_allclose(frame.rotation, rotation)
    np.savez(path, points=points, mask=[True, False, True, True, True])
    (frame,) = open_input(path)
    np.testing.assert_allclose(frame.cloud, POINTS[[0, 2]])
    assert frame.stamp == 0 and (frame.rotation == np.eye(3)).all() and (frame.position == 0).all()


def test_npz_of_depth(tmp_path):
    depth = np.array([[1.0, np.nan, -2.0], [np.inf, 0.0, 3.0]])
    color = np.zeros((7, 9, 3), np.uint8)  # nothing reads it
    np.savez(tmp_path / "a.npz", depth=depth, intrinsics=[5.0, 6.0, 1.0, 0.5], color=color)
    (frame,) = open_input(tmp_path / "a.npz")
    assert frame.depth.tolist() == [[1, 0, 0], [0, 0, 3]] and frame.depth.dtype == np.float32
    camera = frame.intrinsics
    assert (camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height) == (5, 6, 1, 0.5, 3, 2)


def test_npz_of_stacked_frames(tmp_path):
    rotations = Rotation.from_rotvec(np.outer([0.0, 0.1, 0.2], [0, 0, 1])).as_matrix()
    mask = np.ones((3, 3), bool)
    mask[1] = False
    mask[2, 0] = False
    np.savez(
        tmp_path / "1.npz",
        points=np.stack([POINTS, POINTS + 1, POINTS + 2]),
        mask=mask,
        rotation=rotations,
        position=[0.0, 0.0, 1.0],
    )
    np.savez(
        tmp_path / "2.npz",
        depth=np.ones((2, 4, 5)),
        mask=np.arange(40).reshape(2, 4, 5) != 7,
        intrinsics=[[5.0, 5.0, 2.0, 2.0], [6.0, 6.0, 2.0, 2.0]],
        stamp=[9.0, 8.0],
    )
    np.savez(tmp_path / "3.npz", points=POINTS)
    source = open_input(tmp_path, rate=10.0)
    frames = list(source)
    assert source.length is None and source.skipped == ["1.npz frame 1: no finite point"]
    np.testing.assert_allclose([f.stamp for f in frames], [0, 0.2, 9, 8, 0.5])
    np.testing.assert_allclose(frames[1].cloud, POINTS[1:] + 2)
    np.testing.assert_allclose(frames[1].rotation, rotations[2])
    assert frames[1].position.tolist() == [0, 0, 1]
    assert frames[2].depth[1, 2] == 0 and frames[2].depth.sum() == 19 and frames[3].depth.sum() == 20
    assert frames[3].intrinsics.fx == 6


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"xyz": POINTS}, "not known: xyz"),
        ({"points": POINTS, "stamps": [1.0]}, "not known: stamps"),
        ({"stamp": 1.0}, "it holds stamp"),
        ({"points": POINTS, "depth": POINTS, "intrinsics": np.ones(4)}, "it holds depth, intrinsics, points"),
        ({"depth": POINTS}, "it holds depth"),
        ({"points": POINTS[:, :2]}, r"points is float64 \(3, 2\)"),
        ({"points": POINTS[0]}, r"points is float64 \(3,\)"),
        ({"points": POINTS.astype(str)}, "points is <U"),
        ({"points": POINTS, "rotation": 2 * np.eye(3)}, "not an orthonormal right-handed matrix"),
        ({"points": POINTS, "rotation": np.diag([1.0, 1.0, -1.0])}, "not an orthonormal right-handed matrix"),
        ({"points": POINTS, "rotation": np.full((3, 3), np.nan)}, "rotation is not finite"),
        ({"points": POINTS, "position": [0, np.nan, 0]}, "a number of position is not finite"),
        ({"points": POINTS, "position": np.zeros(4)}, r"position has the shape \(4,\), needed is \(3,\)"),
        ({"points": POINTS, "stamp": np.nan}, "a number of stamp is not finite"),
        ({"points": POINTS, "stamp": "now"}, "stamp is <U"),
        ({"points": POINTS[None], "mask": np.ones(2)}, r"mask has the shape \(2,\), needed is \(1, 3\)"),
        ({"points": np.stack([POINTS, POINTS]), "stamp": 1.0}, "one stamp for 2 frames"),
        ({"points": POINTS, "color": np.zeros((3, 3), np.uint8)}, "color is accepted only with depth"),
        ({"points": np.array([{}, {}])}, "NPZ file"),
    ],
)
def test_broken_npz(tmp_path, arrays, words):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(UsageError, match=words) as error:
        list(open_input(tmp_path / "a.npz"))
    assert "a.npz" in _one_line(error)


def test_npz_that_is_no_whole_archive(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, points=POINTS)
    whole = path.read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"text"):
        path.write_bytes(content)
        with pytest.raises(UsageError, match="NPZ file") as error:
            list(open_input(path))
        _one_line(error)
    with path.open("wb") as stream:
        np.save(stream, POINTS)
    with pytest.raises(UsageError, match="without a name"):
        list(open_input(path))


def test_folder_without_clouds_and_file_that_vanished(tmp_path):
    from hrcjax.io.recordings.clouds import open_clouds

    with pytest.raises(UsageError, match="holds no point clouds"):
        open_clouds(tmp_path)
    for name in ("a.ply", "a.npz"):
        with pytest.raises(UsageError, match="no point cloud at"):
            open_clouds(tmp_path / name)
        np.savez(tmp_path / "a.npz", points=POINTS)
        _write_ply(tmp_path / "a.ply", POINTS)
        source = open_clouds(tmp_path / name)
        (tmp_path / "a.npz").unlink()
        (tmp_path / "a.ply").unlink()
        with pytest.raises(UsageError, match=r"no (PLY|NPZ) file at") as error:
            list(source)
        _one_line(error)
