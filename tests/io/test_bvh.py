"""BVH files against a forward kinematics of twenty lines, real files, and broken ones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hrcjax.io.bvh import BvhError, read_bvh
from hrcjax.world.person import REGIONS
from hrcjax.world.recorded import person_from_joints
from hrcjax.world.scenes import robotica

TINY = """HIERARCHY
ROOT hip
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT neck
  {
    OFFSET 10 500 20
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT head
    {
      OFFSET 0 200 30
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 0 0
      }
    }
    JOINT left
    {
      OFFSET -200 -10 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 0 0
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.02
100 900 -300 10 20 30 -40 15 25 5 6 7 -8 9 11
110 905 -290 -70 12 44 33 -55 66 1 2 3 80 -20 10
"""
PARENT = {"hip": None, "neck": "hip", "head": "neck", "left": "neck"}


def _positions(path):
    """Joint positions of a BVH file [file's unit]: every joint's rotation, channel by channel, after its parent's."""
    joints, parents, stack, rows = [], [], [], []
    lines = iter(path.read_text().splitlines())
    for words in (line.split() for line in lines):
        if words[0] in ("ROOT", "JOINT"):
            parents.append(next((s for s in reversed(stack) if s is not None), None))
            joints.append({"name": words[1]})
            stack.append(len(joints) - 1)
        elif words[0] == "End":
            stack.append(None)
        elif words[0] == "}":
            stack.pop()
        elif words[0] == "OFFSET" and stack[-1] is not None:
            joints[stack[-1]]["offset"] = np.array(words[1:], float)
        elif words[0] == "CHANNELS":
            joints[stack[-1]]["channels"] = words[2:]
        elif words[:2] == ["Frame", "Time:"]:
            rows = np.array([line.split() for line in lines if line.strip()], float)
    positions, rotations, column = np.zeros((len(rows), len(joints), 3)), [], 0
    for j, joint in enumerate(joints):
        order = "".join(c[0] for c in joint["channels"] if c.endswith("rotation"))
        local = np.tile(joint["offset"], (len(rows), 1))
        for c in joint["channels"]:
            if c.endswith("position"):
                local[:, "XYZ".index(c[0])] = rows[:, column + joint["channels"].index(c)]
        first = column + len(joint["channels"]) - 3
        turn = Rotation.from_euler(order, rows[:, first : first + 3], degrees=True)
        up = parents[j]
        positions[:, j] = local if up is None else positions[:, up] + rotations[up].apply(local)
        rotations.append(turn if up is None else rotations[up] * turn)
        column += len(joint["channels"])
    return positions, tuple(joint["name"] for joint in joints)


def _write(tmp_path, text):
    path = tmp_path / "motion.bvh"
    path.write_text(text)
    return path


def test_tiny_file_agrees_with_forward_kinematics(tmp_path):
    path = _write(tmp_path, TINY)
    positions, names, rate = read_bvh(path)
    expected, order = _positions(path)
    assert names == order == ("hip", "neck", "head", "left")
    assert rate == pytest.approx(50)
    assert positions.shape == (2, 4, 3)
    np.testing.assert_allclose(positions[:, 0] * 1000, [[100, 900, -300], [110, 905, -290]], rtol=1e-6)
    np.testing.assert_allclose(positions, expected / 1000, atol=2e-6)
    metres, _, _ = read_bvh(path, unit=0.01)
    np.testing.assert_allclose(metres, positions * 10, rtol=1e-9)


def test_blank_lines_and_crlf_are_no_harm(tmp_path):
    path = tmp_path / "motion.bvh"
    path.write_bytes(("\n" + TINY.replace("MOTION\n", "\nMOTION\n\n")).replace("\n", "\r\n").encode())
    positions, _, _ = read_bvh(path)
    np.testing.assert_allclose(positions, read_bvh(_write(tmp_path / "..", TINY))[0])


@pytest.mark.slow
def test_every_shared_file_is_read_and_placed(shared_data):
    files = sorted((shared_data / "human_motion").glob("*.bvh"))
    if not files:
        pytest.skip("no BVH files in the shared data")
    scene = robotica()
    for path in files:
        positions, names, rate = read_bvh(path)
        expected, order = _positions(path)
        assert names == order and len(names) == 12 and rate == pytest.approx(100)
        np.testing.assert_allclose(positions, expected / 1000, atol=1e-4)
        person = person_from_joints(positions, names, rate, scene)
        assert person.a.shape == (241, len(REGIONS), 3) and np.isfinite(person.b).all()
        hip = np.asarray(person.a)[:, 0]
        assert np.abs(np.median(hip[:, 2]) - 0.18) < 0.08
        if "PickPlaceCloseHuman" not in path.name:
            assert (hip[:, 1] > 0.7).all()  # nobody stands on the table


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "does not begin with HIERARCHY"),
        ("hello\n", "does not begin with HIERARCHY"),
        (TINY.split("MOTION")[0], "no MOTION"),
        (TINY.replace("Frames: 2", "Frames: 3"), "3 frames are declared, but there are 2 rows"),
        (TINY.replace("Frames: 2", "Frames: two"), "not followed by"),
        (TINY.replace("Frames: 2", "Frames: 0"), "at least 1"),
        (TINY.replace("0.02", "-1"), "positive 'Frame Time:'"),
        (TINY.replace("0.02", "nan"), "positive 'Frame Time:'"),
        (TINY.replace("Frames:", "Bilder:"), "MOTION needs"),
        (TINY.replace("100 900", "900"), "14 values, 15 finite ones"),
        (TINY.replace("100 900", "nan 900"), "15 finite ones"),
        (TINY.replace("100 900", "x 900"), "line 33: not a row of numbers"),
        (TINY.replace("  JOINT left\n    {", "  JOINT left\n"), "bracket"),
        (TINY.replace("OFFSET 10 500 20", "OFFSET 10 500"), "broken motion file"),
        (TINY.replace("OFFSET 10 500 20", "OFFSET 10 a 20"), "broken motion file"),
        (TINY.replace("CHANNELS 3 Z", "CHANNELS 4 Z", 1), "CHANNELS needs"),
        (TINY.replace("ROOT hip", "JOINT hip"), "broken motion file"),
    ],
)
def test_broken_files_give_one_clear_line(tmp_path, text, what):
    path = _write(tmp_path, text)
    with pytest.raises(BvhError, match=what) as caught:
        read_bvh(path)
    message = str(caught.value)
    assert "\n" not in message and str(path) in message and "accepted is a BVH text file" in message
    assert isinstance(caught.value, ValueError)


def test_missing_unreadable_and_binary_files(tmp_path):
    with pytest.raises(BvhError, match=r"no motion file at .*nowhere"):
        read_bvh(tmp_path / "nowhere.bvh")
    with pytest.raises(BvhError, match="cannot be read"):
        read_bvh(tmp_path)
    binary = tmp_path / "b.bvh"
    binary.write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(BvhError, match="cannot be read"):
        read_bvh(binary)
