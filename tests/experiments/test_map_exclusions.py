"""What does not belong into a map: the robot whose joints are known, and what is outside of a box."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.map.__main__ import main
from hrcjax.io.map_file import open_map
from hrcjax.io.recordings.joints import JointRecord, read_joints
from hrcjax.lab.errors import UsageError
from hrcjax.map import labelled_points
from hrcjax.robot import arm_capsules, load_arm
from hrcjax.sense import d435i
from hrcjax.sense.camera import pixel_directions, render_capsules, render_scene
from hrcjax.world.scene import BOX
from hrcjax.world.scenes import Obstacle, make_scene

SMALL = (
    "--lower",
    "-0.8",
    "-0.8",
    "-0.2",
    "--shape",
    "8",
    "8",
    "6",
    "--spacing",
    "0.05",
    "--no-figures",
    "--capacity",
    "384",
)
CLOCK = 1.7e9
BOX_AT, HALF = (0.5, 0.3, 0.1), (0.12, 0.1, 0.1)


@pytest.fixture(scope="module")
def arm():
    return load_arm("ur5")


@pytest.fixture(scope="module")
def joints(arm):
    """Joints of two moments, a second apart."""
    return np.stack([arm.home, arm.home + np.array([0.6, 0.2, -0.2, 0.0, 0.3, 0.0])])


@pytest.fixture(scope="module")
def scene(arm, joints):
    """Camera, moments, images of the moving robot beside a box, the image without the robot, and without the box too."""
    camera = d435i(jnp.asarray([1.2, -0.8, 1.1], jnp.float32), jnp.asarray([0.2, 0.05, 0.2], jnp.float32), 2)
    room = ((0.0,) * 3, (0.1,) * 3, (0.0,) * 3, (1.0,) * 3)
    with_box, table = (
        jax.jit(lambda boxes=boxes: render_scene(camera, make_scene(boxes, *room)))()
        for boxes in ([Obstacle(BOX, BOX_AT, HALF, 0.0, 0.1)], [])
    )
    moments = np.array([0.3, 0.4, 0.5, 0.6])
    draw = jax.jit(lambda q: render_capsules(camera, arm_capsules(arm, q), with_box))
    images = [np.asarray(draw(jnp.asarray(joints[0] + t * (joints[1] - joints[0]), jnp.float32))) for t in moments]
    return camera, moments, np.stack(images), np.asarray(with_box), np.asarray(table)


def known(camera) -> dict[str, np.ndarray]:
    pose = {"rotation": np.asarray(camera.rotation, float), "position": np.asarray(camera.position, float)}
    return pose | {"intrinsics": np.array([float(v) for v in (camera.fx, camera.fy, camera.cx, camera.cy)])}


@pytest.fixture
def record(scene, joints, tmp_path):
    """The robot's images, the same as clouds, and the joints: names of the files."""
    camera, moments, images, *_ = scene
    x, y = (np.asarray(a) for a in pixel_directions(camera))
    clouds = (images[..., None] * np.stack([x, y, np.ones_like(x)], axis=-1))[:, ::3, ::3].reshape(len(images), -1, 3)
    of = known(camera)
    np.savez(tmp_path / "images.npz", depth=images, stamp=CLOCK + moments, **of)
    of.pop("intrinsics")
    np.savez(tmp_path / "clouds.npz", points=clouds, stamp=CLOCK + moments, **of)
    np.savez(tmp_path / "joints.npz", stamp=CLOCK + np.array([0.0, 1.0]), q=joints)
    return tmp_path


def mapped(folder, *options) -> np.ndarray:
    """Points of the map."""
    words = [str(word) for word in ("--output", folder / "out", "--overwrite", *SMALL, *options)]
    assert main(words) == 0
    return labelled_points(open_map(folder / "out" / "map.npz")[2])[0]


def from_robot(arm, joints, points) -> np.ndarray:
    """Distances of points from the moving robot at the last moment, without its base [m]."""
    q = joints[0] + 0.6 * (joints[1] - joints[0])
    body = arm_capsules(arm, jnp.asarray(q, jnp.float32))
    a, b, radius = (np.asarray(v, float)[1:, None] for v in (body.a, body.b, body.radius))
    along = np.clip(np.sum((points - a) * (b - a), axis=2) / np.sum((b - a) ** 2, axis=2), 0, 1)
    return (np.linalg.norm(points - a - along[..., None] * (b - a), axis=2) - radius).min(axis=0)


def of_box(points) -> int:
    return int(((np.abs(points - BOX_AT) < np.asarray(HALF) + 0.03).all(axis=1) & (points[:, 2] > 0.1)).sum())


@pytest.mark.parametrize("name", ["images", "clouds"])
def test_the_robot_is_taken_out_and_all_else_stays(record, arm, joints, name) -> None:
    path = record / f"{name}.npz"
    with_robot = mapped(record, "--input", path)
    without = mapped(record, "--input", path, "--joints", record / "joints.npz")
    assert (from_robot(arm, joints, with_robot) < 0.02).sum() > 40
    assert from_robot(arm, joints, without).min() > 0.045
    assert of_box(without) >= 0.9 * of_box(with_robot) > 10
    table = [
        (np.abs(points[:, 2]) < 0.02) & (from_robot(arm, joints, points) > 0.15) for points in (with_robot, without)
    ]
    assert table[1].sum() >= 0.9 * table[0].sum() > 100


def test_frames_without_joints_are_passed_over_and_named(record, joints, capsys) -> None:
    np.savez(record / "late.npz", stamp=CLOCK + np.array([0.55, 1.0]), q=joints)
    mapped(record, "--input", record / "images.npz", "--joints", record / "late.npz")
    printed = capsys.readouterr()
    assert "2 of 2 frames used" in printed.out and "not read: 2 x no joints in late.npz" in printed.out
    assert f"frame at {CLOCK + 0.3:.3f} s: no joints" in printed.err
    np.savez(record / "other.npz", stamp=np.array([0.0, 1.0]), q=joints)
    words = ["--input", record / "images.npz", "--joints", record / "other.npz", "--output", record / "none", *SMALL]
    assert main([str(word) for word in words]) == 2
    err = capsys.readouterr().err
    assert "accepted are joints and frames of one clock" in err and not (record / "none").exists()


def test_what_is_outside_of_the_box_is_not_taken_in_but_seen_through(record, scene, capsys) -> None:
    camera, _, _, with_box, table = scene
    np.savez(record / "goes.npz", depth=np.stack([with_box] * 3 + [table] * 4), **known(camera))
    np.savez(record / "stays.npz", depth=np.stack([with_box] * 3), **known(camera))
    over = ("--crop", 0.2, 0.0, 0.05, 0.7, 0.5, 0.4)
    points = mapped(record, "--input", record / "stays.npz", *over)
    assert len(points) > 20 and (points >= [0.2, 0.0, 0.05]).all() and (points <= [0.7, 0.5, 0.4]).all()
    gone = mapped(record, "--input", record / "goes.npz", *over)
    assert len(gone) <= 0.1 * len(points)
    clouds = mapped(record, "--input", record / "clouds.npz", *over)
    assert len(clouds) > 20 and (clouds >= [0.2, 0.0, 0.05]).all() and (clouds <= [0.7, 0.5, 0.4]).all()
    capsys.readouterr()
    words = ("--input", record / "stays.npz", "--output", record / "fitted", *over, "--fit", "--spacing", 0.05)
    assert main([str(word) for word in (*words, "--no-figures")]) == 0
    layout, _, state = open_map(record / "fitted" / "map.npz")
    assert max(layout.shape) <= 6 and len(labelled_points(state)[0]) == pytest.approx(len(points), rel=0.3)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--crop", "0", "0", "0", "1", "1", "0"), "--crop 0 0 0 1 1 0: accepted are"),
        (("--crop", "0", "0", "0", "1", "1", "nan"), "--crop 0 0 0 1 1 nan: accepted are"),
        (("--crop", "5", "5", "5", "6", "6", "6"), "outside of the mapped box"),
        (("--arm", "ur5e"), "give --joints"),
        (("--arm", "ur3", "--joints", "joints.npz"), "'ur3' is not known"),
        (("--joints", "absent.npz"), "no joints at absent.npz"),
    ],
)
def test_wrong_options_are_told_in_one_line(options, said, record, monkeypatch, capsys) -> None:
    monkeypatch.chdir(record)
    assert main(["--input", "images.npz", "--output", "out", *SMALL, *options]) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("\n") <= 2 and not (record / "out").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"q": None}, "it holds stamp"),
        ({"time": np.zeros(2)}, "it holds q, stamp, time"),
        ({"q": np.zeros((3, 6))}, r"stamp is \(2,\), q is \(3, 6\)"),
        ({"q": np.zeros((2, 7))}, r"q is \(2, 7\)"),
        ({"stamp": np.zeros(0), "q": np.zeros((0, 6))}, r"stamp is \(0,\)"),
        ({"stamp": np.array([1.0, 0.0])}, "do not increase"),
        ({"stamp": np.array([0.0, np.nan])}, "not finite"),
        ({"q": np.full((2, 6), 90.0)}, "joint 0 of row 0 is 90"),
        ({"q": np.zeros((2, 6), complex)}, "q is complex128"),
    ],
)
def test_files_that_hold_no_joints_are_refused(change, said, tmp_path, arm) -> None:
    arrays = {"stamp": np.array([0.0, 1.0]), "q": np.zeros((2, 6))} | change
    np.savez(tmp_path / "q.npz", **{name: array for name, array in arrays.items() if array is not None})
    with pytest.raises(UsageError, match=said) as error:
        read_joints(tmp_path / "q.npz", arm.q_max)
    assert "\n" not in str(error.value) and "accepted is" in str(error.value)


def test_joints_are_linear_between_records_and_unknown_far_from_them(tmp_path) -> None:
    stamps = CLOCK + np.array([0.0, 0.5, 3.0])
    record = JointRecord(tmp_path / "q.npz", stamps, np.outer([0.0, 1.0, 2.0], np.arange(6)))
    np.testing.assert_allclose(record.at(CLOCK + 0.125), 0.25 * np.arange(6), atol=1e-6)
    np.testing.assert_allclose(record.at(CLOCK - 0.09), np.zeros(6))
    np.testing.assert_allclose(record.at(CLOCK + 3.09), 2.0 * np.arange(6))
    assert record.at(CLOCK + 0.55) is not None and record.at(CLOCK + 2.95) is not None
    for moment in (-0.11, 1.5, 3.11, np.nan):
        assert record.at(CLOCK + moment) is None
