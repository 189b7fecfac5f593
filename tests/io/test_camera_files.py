"""Cameras from the files that other people's tools write beside depth images."""

import json

import numpy as np
import pytest
from PIL import Image

from hrcjax.io.recordings.camera_text import camera_of_text
from hrcjax.io.recordings.frame import Intrinsics
from hrcjax.io.recordings.lens import Lens
from hrcjax.io.recordings.open_input import open_input
from hrcjax.lab.errors import UsageError

OPEN3D = json.dumps(
    {"width": 640, "height": 480, "intrinsic_matrix": [525.0, 0, 0, 0, 526.0, 0, 319.5, 239.5, 1]}
)  # by columns
REALSENSE = json.dumps(
    {"fx": 383.0, "fy": 384.0, "ppx": 320.0, "ppy": 240.0, "width": 640, "height": 480, "model": "Brown Conrady",
     "coeffs": [0.0, 0.0, 0.0, 0.0, 0.0], "depth_scale": 0.001}
)  # fmt: skip
BOP = json.dumps({"cx": 312.0, "cy": 241.0, "depth_scale": 0.1, "fx": 567.5, "fy": 577.1, "height": 480, "width": 640})
REPLICA = json.dumps(
    {"camera": {"w": 1200, "h": 680, "fx": 600.0, "fy": 600.0, "cx": 599.5, "cy": 339.5, "scale": 6553.5}}
)
TWO = json.dumps(
    {"color": {"fx": 1, "fy": 1, "cx": 1, "cy": 1}, "depth": {"fx": 504.0, "fy": 505.0, "cx": 320.0, "cy": 330.0}}
)
ORB = """%YAML:1.0
---
Camera.type: "PinHole"
Camera1.fx: 517.3
Camera1.fy: 516.5
Camera1.cx: 318.6
Camera1.cy: 255.3
Camera1.k1: 0.25
Camera1.k2: -0.75
Camera1.p1: -0.005
Camera1.p2: 0.0025
Camera1.k3: 1.125
Camera.width: 640
Camera.height: 480
ThDepth: 40.0
RGBD.DepthMapFactor: 5000.0  # of TUM
"""
ROS = """image_width: 640
image_height: 480
camera_name: depth
camera_matrix:
  rows: 3
  cols: 3
  data: [500.0, 0.0, 320.0,
         0.0, 501.0, 240.0, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.125, 0.0, 0.0, 0.0, 0.0]
"""
SCANNET = (
    "colorWidth = 1296\nfx_color = 1170.1\nfx_depth = 571.6\nfy_depth = 571.7\nmx_depth = 319.5\nmy_depth = 239.5\n"
)
FISHEYE = 'Camera.type: "KannalaBrandt8"\nCamera1.fx: 190.9\nCamera1.fy: 190.8\nCamera1.cx: 254.9\nCamera1.cy: 256.8\nCamera1.k1: 0.003\nCamera1.k2: 0.0007\nCamera1.k3: -0.002\nCamera1.k4: 0.0002\n'


@pytest.mark.parametrize(
    ("text", "pinhole", "size", "per_metre", "lens"),
    [
        (OPEN3D, (525, 526, 319.5, 239.5), (640, 480), None, None),
        (REALSENSE, (383, 384, 320, 240), (640, 480), 1000, None),
        (BOP, (567.5, 577.1, 312, 241), (640, 480), 10000, None),
        (REPLICA, (600, 600, 599.5, 339.5), (1200, 680), 6553.5, None),
        (TWO, (504, 505, 320, 330), None, None, None),
        (ORB, (517.3, 516.5, 318.6, 255.3), (640, 480), 5000, (0.25, -0.75, -0.005, 0.0025, 1.125, 0, 0, 0)),
        (ROS, (500, 501, 320, 240), (640, 480), None, (0.125, 0, 0, 0, 0, 0, 0, 0)),
        (FISHEYE, (190.9, 190.8, 254.9, 256.8), None, None, (0.003, 0.0007, -0.002, 0.0002)),
        (SCANNET + "depthWidth = 640\ndepthHeight = 480\ndepthShift = 1000\n", (571.6, 571.7, 319.5, 239.5), (640, 480), 1000, None),
        ("577.9 0 319.5 0\n0 578 239.5 0\n0 0 1 0\n0 0 0 1\n", (577.9, 578, 319.5, 239.5), None, None, None),
        ("# Kinect\n585 0 320\n0 586 240\n0 0 1", (585, 586, 320, 240), None, None, None),
        ("[[585, 0, 320], [0, 586, 240], [0, 0, 1]]", (585, 586, 320, 240), None, None, None),
        ("525 526 319.5 239.5\n", (525, 526, 319.5, 239.5), None, None, None),
        ("525 526 319.5 239.5 640 480", (525, 526, 319.5, 239.5), (640, 480), None, None),
        ("640 480 525 526 319.5 239.5", (525, 526, 319.5, 239.5), (640, 480), None, None),
        ("fx fy cx cy\n525 526 319.5 239.5\n", (525, 526, 319.5, 239.5), None, None, None),
        ("fx=525, fy=526, cx=319.5, cy=239.5", (525, 526, 319.5, 239.5), None, None, None),
        ("1 OPENCV 640 480 525 526 319.5 239.5 0.1 0 0 0", (525, 526, 319.5, 239.5), (640, 480), None, (0.1, 0, 0, 0, 0, 0, 0, 0)),
    ],
)  # fmt: skip
def test_cameras_as_tools_write_them(text, pinhole, size, per_metre, lens) -> None:
    found = camera_of_text(text)
    assert found is not None
    assert (found.fx, found.fy, found.cx, found.cy) == pytest.approx(pinhole)
    assert found.size == size and found.per_metre == per_metre
    assert (None if found.lens is None else found.lens.coefficients) == lens


@pytest.mark.parametrize("text", ["", "hello\nworld: 3\n", "1 2 3", "[]", '{"fx": 500}', "0.1 depth/1.png"])
def test_texts_that_describe_no_camera(text) -> None:
    assert camera_of_text(text) is None


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "depth").mkdir()
    for i in range(2):
        Image.fromarray(np.full((48, 64), 2000, np.uint16)).save(tmp_path / "depth" / f"{i}.png")
    (tmp_path / "pose.txt").write_text("0 0 0 0 0 0 1\n" * 2)
    return tmp_path


OWN = "50 0 31.5\n0 51 23.5\n0 0 1\n"


@pytest.mark.parametrize(
    "name", ["camera.txt", "camera-intrinsics.txt", "intrinsic/intrinsic_depth.txt", "cam_K.txt", "K.txt"]
)
def test_a_camera_file_beside_the_images_is_read_and_named(folder, name) -> None:
    (folder / "intrinsic").mkdir()
    (folder / "intrinsic" / "intrinsic_color.txt").write_text("900 0 640\n0 900 360\n0 0 1\n")
    (folder / "intrinsic" / "extrinsic_depth.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    (folder / name).write_text(OWN)
    source = open_input(folder)
    assert next(iter(source)).intrinsics == Intrinsics(50, 51, 31.5, 23.5, 64, 48)
    assert name in source.notes[0] and "1000 per metre (ASSUMED" in source.notes[0]
    (frame, _) = open_input(
        folder, intrinsics=Intrinsics(60, 60, 31.5, 23.5, 64, 48)
    )  # what is given goes before the file
    assert frame.intrinsics.fx == 60


def test_the_scale_of_a_camera_file_counts_and_one_given_goes_before_it(folder) -> None:
    (folder / "settings.yaml").write_text(
        "Camera.fx: 50\nCamera.fy: 50\nCamera.cx: 31.5\nCamera.cy: 23.5\nDepthMapFactor: 5000.0\n"
    )
    assert next(iter(open_input(folder))).depth[0, 0] == pytest.approx(0.4)
    assert next(iter(open_input(folder, per_metre=1000))).depth[0, 0] == pytest.approx(2.0)


def test_what_is_assumed_is_named(shared_cases) -> None:
    source = open_input(shared_cases / "depth_camera_assumed" / "rs640")
    assert "fx 518 fy 519 cx 325.5 cy 253.5 of 640x480 pixels (ASSUMED" in source.notes[0]
    assert "1000 per metre (ASSUMED" in source.notes[0] and "no stamps" in source.notes[1]


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({"camera.txt": "525 526 319.5 239.5 640 480"}, "is for images of 640x480 pixels, the depth images have 64x48"),
        (
            {"camera.txt": "525 0 319.5\n0 525 239.5\n0 0 1"},
            "cx is 319.5, far from the middle of depth images of 64x48",
        ),
        ({"camera.txt": "my camera"}, "does not describe a supported camera"),
        ({"camera.txt": OWN, "intrinsics.txt": OWN.replace("50", "70")}, "describe different cameras"),
        (
            {"camera.json": '{"fx": 50, "fy": 50, "cx": 31, "cy": 23, "model": "ftheta", "coeffs": [1, 0, 0, 0]}'},
            "lens ftheta",
        ),
    ],
)
def test_files_that_cannot_be_of_these_images_are_refused(folder, files, said) -> None:
    for name, text in files.items():
        (folder / name).write_text(text)
    with pytest.raises(UsageError, match=said) as error:
        open_input(folder)
    assert "\n" not in str(error.value) and "accepted is" in str(error.value)


def test_images_of_a_camera_file_with_distortion_are_straightened(folder) -> None:
    """Rays that the lens bends outwards show what is farther in: a step at column 52 comes to stand nearer to the middle."""
    step = np.full((48, 64), 2000, np.uint16)
    step[:, 52:] = 3000
    Image.fromarray(step).save(folder / "depth" / "0.png")
    (folder / "camera.txt").write_text("50 50 31.5 23.5 0.5 0 0 0")
    source = open_input(folder)
    row = next(iter(source)).depth[23]
    r = (52 - 0.5 - 31.5) / 50  # of the bent ray: r + r^3 / 2
    straight = np.roots([0.5, 0, 1, -r])
    edge = 31.5 + 50 * float(straight[np.isreal(straight)].real[0])
    assert "undistorted" in source.notes[0]
    assert row[int(np.floor(edge))] == pytest.approx(2.0) and row[int(np.ceil(edge)) + 1] == pytest.approx(3.0)
    assert 48 < edge < 51.4 and int(np.argmax(row > 2.5)) <= 51


def test_fisheye_is_one_even_without_numbers() -> None:
    found = camera_of_text(
        FISHEYE.replace("0.003", "0").replace("0.0007", "0").replace("-0.002", "0").replace("0.0002", "0")
    )
    assert found is not None and found.lens == Lens("equidistant", (0.0,) * 4)
