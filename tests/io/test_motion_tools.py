"""BVH files as a dozen tools write them play right side up and at human size."""

import json
from dataclasses import replace

import numpy as np
import pytest
from bvh_tools import NEEDED, TOOLS, bvh_text, true_positions

from hrcjax.io.bvh import read_bvh
from hrcjax.io.motions.body import find_up
from hrcjax.io.motions.motion import Motion, read_motion
from hrcjax.io.motions.spec import MotionSpec, motion_spec
from hrcjax.lab.errors import UsageError
from hrcjax.world.joint_names import JOINTS, joint_columns
from hrcjax.world.recorded import person_from_joints
from hrcjax.world.scene import FLOOR_Z
from hrcjax.world.scenes import robotica

FRAMES = 12
PLAIN = TOOLS["perception neuron"]


def read(tmp_path, text: str, settings: str = "", name: str = "walk.bvh") -> Motion:
    (tmp_path / name).write_bytes(text.encode())
    spec = motion_spec(str(tmp_path / name) + settings)
    assert spec is not None
    return read_motion(spec)


@pytest.mark.parametrize("name", TOOLS)
def test_true_positions_in_metres_with_y_up(name, tmp_path) -> None:
    assert JOINTS == NEEDED
    motion = read(tmp_path, bvh_text(TOOLS[name], FRAMES))
    np.testing.assert_allclose(motion.positions, true_positions(FRAMES), atol=1e-6)
    assert motion.rate == pytest.approx(60) and motion.length == pytest.approx(FRAMES / 60)
    (note,) = motion.notes
    assert "walk.bvh: lengths in" in note and f"{TOOLS[name].up} up" in note


@pytest.mark.parametrize("name", ["mixamo through Blender", "xsens", "3ds max"])
def test_stands_in_the_cell(name, tmp_path) -> None:
    motion = read(tmp_path, bvh_text(TOOLS[name], FRAMES))
    person = person_from_joints(motion.positions, motion.names, motion.rate, robotica(), 0.2)
    a, b = np.asarray(person.a), np.asarray(person.b)
    head, hip = b[:, 3, 2], a[:, 0, 2]
    assert ((head - hip > 0.4) & (head - hip < 0.9)).all()
    assert ((head - FLOOR_Z > 1.2) & (head - FLOOR_Z < 2.1)).all()
    arms = np.linalg.norm(b[:, 4:8] - a[:, 4:8], axis=-1)
    assert ((arms > 0.2) & (arms < 0.4)).all()
    assert (b[:, 12:, 2] < hip[:, None] - 0.6).all()  # feet below


@pytest.mark.parametrize("name", ["motionbuilder", "xsens", "perception neuron", "cmu", "vicon"])
def test_positions_are_those_of_another_reader(name, tmp_path) -> None:
    bvhio = pytest.importorskip("bvhio")
    path = tmp_path / "walk.bvh"
    path.write_bytes(bvh_text(TOOLS[name], 3).encode())
    root = bvhio.convertBvhToHierarchy(bvhio.readAsBvh(str(path)).Root).loadRestPose(recursive=True)
    positions, _, _ = read_bvh(path, unit=1.0)
    for frame in range(3):
        root.loadPose(frame)
        theirs = [tuple(joint.PositionWorld) for joint, _, _ in root.layout()]
        np.testing.assert_allclose(positions[frame], theirs, rtol=1e-5, atol=1e-5 / TOOLS[name].unit)  # 32-bit floats


@pytest.mark.parametrize("unit", [0.001, 0.01, 0.0254, 1.0])
@pytest.mark.parametrize("stature", [1.25, 1.75, 2.1])
def test_the_unit_is_found_for_small_and_tall_people(unit, stature, tmp_path) -> None:
    motion = read(tmp_path, bvh_text(replace(PLAIN, unit=unit * 1.75 / stature), 2))
    np.testing.assert_allclose(motion.positions, true_positions(2) * stature / 1.75, atol=1e-5)


def test_what_the_user_says_counts(tmp_path) -> None:
    text = bvh_text(replace(PLAIN, unit=0.3048), 2)
    assert "lengths in ft" in read(tmp_path, text).notes[0]
    with pytest.raises(UsageError, match=r"walk.bvh: hip to neck measures 0.00497 m, .*walk.bvh,unit=cm"):
        read(tmp_path, bvh_text(PLAIN, 2), ",unit=0.0001")
    odd = bvh_text(replace(PLAIN, unit=0.13), 2)
    with pytest.raises(
        UsageError, match=r"walk.bvh: hip to neck plus one arm is .* give the unit as in walk.bvh,unit=cm"
    ):
        read(tmp_path, odd)
    said = read(tmp_path, odd, ",unit=0.13,up=y")
    np.testing.assert_allclose(said.positions, true_positions(2), atol=1e-6)
    assert said.notes == ()
    for up, at in (("z", (0, 2, 1)), ("x", (1, 0, 2))):
        turned = read(tmp_path, odd, f",unit=0.13,up={up}").positions
        np.testing.assert_allclose(turned[..., 1], true_positions(2)[..., at[1]], atol=1e-6)
        assert np.linalg.det(np.linalg.lstsq(true_positions(2)[0], turned[0], rcond=None)[0]) == pytest.approx(1)


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_every_axis_can_be_up_and_nothing_is_mirrored(up, tmp_path) -> None:
    sign, axis = (-1.0, up[1]) if up.startswith("-") else (1.0, up)
    # turns of the whole file: the root joint above the hip carries it
    vector = {"x": (0, 0, -90 * sign), "y": (90 - 90 * sign, 0, 0), "z": (90 * sign, 0, 0)}[axis]
    text = bvh_text(replace(PLAIN, above="Body", indent="\t"), FRAMES)
    rows = text.splitlines()
    first = next(i for i, row in enumerate(rows) if row.startswith("Frame Time")) + 1
    z, x, y = vector[2], vector[0], vector[1]
    rows[first:] = [" ".join(["0", "0", "0", str(z), str(x), str(y), *row.split()[6:]]) for row in rows[first:]]
    motion = read(tmp_path, "\n".join(rows))
    assert f", {up} up" in motion.notes[0]
    fit = np.linalg.lstsq(true_positions(FRAMES)[0], motion.positions[0], rcond=None)[0]
    np.testing.assert_allclose(fit @ fit.T, np.eye(3), atol=1e-6)
    assert np.linalg.det(fit) == pytest.approx(1) and fit[1] == pytest.approx([0, 1, 0], abs=1e-6)


def test_people_who_lean_stay_upright(shared_data) -> None:
    folder = shared_data / "human_motion"
    files = sorted(folder.glob("*.bvh"))
    if not files:
        pytest.skip("no BVH files in the shared data")
    for path in files:
        motion = read_motion(MotionSpec(path), 10.0)
        assert "lengths in mm, y up" in motion.notes[0]  # hip height is 0.2 to 0.3 m along y throughout
        positions, names, _ = read_bvh(path)
        columns = joint_columns(names)
        nine = positions[: len(motion.positions), [columns[joint] for joint in JOINTS]]
        np.testing.assert_array_equal(motion.positions, nine)


def test_cases_of_units_names_and_axes(shared_cases) -> None:
    true = None
    for path in [*(shared_cases / "bvh_units_and_names").glob("*.bvh"), *(shared_cases / "bvh_z_up").glob("*.bvh")]:
        positions = read_motion(MotionSpec(path)).positions
        true = positions if true is None else true
        np.testing.assert_allclose(positions, true, atol=1e-4, err_msg=str(path))
    assert true is not None and true[:, 2, 1] - true[:, 0, 1] == pytest.approx(np.full(len(true), 0.63), abs=1e-3)


def test_half_an_hour_is_read_in_seconds(tmp_path) -> None:
    text = bvh_text(PLAIN, 2)
    head, rows = text.split("\r\n", 1)[0], text.splitlines()
    first = next(i for i, row in enumerate(rows) if row.startswith("Frame Time")) + 1
    many = "\n".join([*rows[:first], *(rows[first:] * 9000)]).replace("Frames:\t2", "Frames:\t18000")
    assert head == "HIERARCHY"
    motion = read_motion(spec_of(tmp_path, many), seconds=10.0)
    assert motion.length == pytest.approx(300) and len(motion.positions) == 602
    np.testing.assert_allclose(motion.positions[600:], true_positions(2), atol=1e-6)


def spec_of(tmp_path, text: str) -> MotionSpec:
    (tmp_path / "long.bvh").write_text(text)
    return MotionSpec(tmp_path / "long.bvh")


def test_displacements_at_joints_are_added_to_their_offsets(tmp_path) -> None:
    text = bvh_text(PLAIN, 2)
    rows = text.splitlines()
    first = next(i for i, row in enumerate(rows) if row.startswith("Frame Time")) + 1
    for i in range(first, len(rows)):
        words = rows[i].split()
        for column in range(6, len(words), 6):
            words[column : column + 3] = ["0", "0", "0"]
        rows[i] = " ".join(words)
    np.testing.assert_allclose(read(tmp_path, "\n".join(rows)).positions, true_positions(2), atol=1e-6)


STRANGE = {joint: f"Knochen {i}" for i, joint in enumerate(TOOLS["unreal"].names())}


@pytest.mark.parametrize("kind", ["toml", "json"])
def test_a_file_of_names_covers_the_rest(kind, tmp_path) -> None:
    text = bvh_text(PLAIN, 2, names=STRANGE)
    with pytest.raises(UsageError, match=r"walk.bvh: no joint for 'hip' among Knochen 0, .*names=FILE.toml"):
        read(tmp_path, text)
    table = {joint: STRANGE[joint] for joint in NEEDED}
    lines = json.dumps(table) if kind == "json" else "\n".join(f'{joint} = "{name}"' for joint, name in table.items())
    (tmp_path / f"names.{kind}").write_text(lines)
    motion = read(tmp_path, text, f",names={tmp_path / f'names.{kind}'}")
    np.testing.assert_allclose(motion.positions, true_positions(2), atol=1e-6)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ('hip = "Hüfte"', "no joint 'Hüfte' for 'hip'"),
        ('hips = "Hips"', "no joint 'hips' is needed: accepted are hip, neck"),
        ("hip = 1", "accepted are lines such as"),
        ("hip =", "cannot be read"),
    ],
)
def test_mistakes_in_a_file_of_names(lines, message, tmp_path) -> None:
    (tmp_path / "n.toml").write_text(lines, encoding="utf-8")
    with pytest.raises(UsageError, match=message):
        read(tmp_path, bvh_text(PLAIN, 2), f",names={tmp_path / 'n.toml'}")


def test_settings_after_the_name(tmp_path) -> None:
    assert motion_spec("reach_in") is None
    assert motion_spec("a.bvh") == MotionSpec(type(tmp_path)("a.bvh"))
    spec = motion_spec("b/A b,c.BVH,unit=cm,up=-Z,names=x,y.toml")
    assert spec is not None and spec.unit == 0.01 and spec.up == "-z"
    assert [str(path) for path in spec.files] == ["b/A b,c.BVH", "x,y.toml"]
    for wrong in ("unit=parsec", "unit=-1", "unit=nan", "up=w", "scale=3", "unit=", "unit=cm,unit=mm"):
        with pytest.raises(UsageError, match=r"a\.bvh"):
            motion_spec(f"a.bvh,{wrong}")
    path = tmp_path / "odd,unit=cm.bvh"
    path.write_text("")
    assert motion_spec(str(path)) == MotionSpec(path)


def test_collar_and_shoulder_are_told_apart() -> None:
    names = ["Hips", "Neck", "Head"] + [
        f"{s}{part}" for s in ("Left", "Right") for part in ("Shoulder", "Arm", "ForeArm", "Hand")
    ]
    assert names[joint_columns(names)["left_upper_arm"]] == "LeftArm"
    names = [name.replace("ForeArm", "Elbow").replace("Hand", "Wrist") for name in names if not name.endswith("tArm")]
    assert names[joint_columns(names)["left_upper_arm"]] == "LeftShoulder"


def test_a_wrong_joint_is_noticed_by_its_size(tmp_path) -> None:
    names = PLAIN.names() | {"left_forearm": "Elbow", "left_thigh": "LeftForeArm"}
    with pytest.raises(
        UsageError, match=r"walk.bvh: left_upper_arm to left_forearm measures .* m, accepted is 0.15 to 0.5"
    ):
        read(tmp_path, bvh_text(PLAIN, 2, names=names))


def test_a_body_along_no_axis_is_asked_about() -> None:
    def body(way) -> dict[str, np.ndarray]:
        return {"hip": np.zeros((3, 3)), "neck": np.tile(np.asarray(way, float), (3, 1))}

    with pytest.raises(UsageError, match=r"^d/walk.bvh: the body points along .* as in walk.bvh,up=y"):
        find_up(body((0.5, 0.5, 0.5)), body((0, 0, 0)), "d/walk.bvh")
    assert find_up(body((0.5, 0.5, 0.5)), body((0, 0, 0.5)), "d/walk.bvh") == "z"
    assert find_up(body((0.1, 0.1, 0.5)), body((0, 0.5, 0)), "d/walk.bvh") == "z"
