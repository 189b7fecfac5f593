"""Recorded people stand upright in the cell, face the path, and keep their own speed."""

import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.world.person import REGIONS
from hrcjax.world.place import path_middle, standing_place
from hrcjax.world.recorded import joint_columns, person_from_joints
from hrcjax.world.scene import FLOOR_Z
from hrcjax.world.scenes import robotica
from hrcjax.world.skeleton import HIP_HEIGHT

NAMES = (
    "hip", "torso", "neck", "head", "left_collar", "left_upper_arm", "left_forearm", "left_hand",
    "right_collar", "right_upper_arm", "right_forearm", "right_hand",
)  # fmt: skip


def _record(frames=201, facing=0.0, offset=(1.0, 0.3, 5.0)):
    """Walks 0.8 m forward and reaches, y up; at facing 0 the front is -z and the right +x."""
    rest = {
        "hip": (0, 0, 0), "torso": (0, 0.1, 0), "neck": (0, 0.5, 0), "head": (0, 0.75, -0.05),
        "left_collar": (0, 0.5, 0), "left_upper_arm": (-0.2, 0.45, 0), "left_forearm": (-0.25, 0.15, 0),
        "left_hand": (-0.25, 0.12, -0.25), "right_collar": (0, 0.5, 0), "right_upper_arm": (0.2, 0.45, 0),
        "right_forearm": (0.25, 0.15, 0), "right_hand": (0.25, 0.12, -0.25),
    }  # fmt: skip
    base = np.array([rest[name] for name in NAMES])
    walk = np.linspace(0, 1, frames)[:, None, None] * np.array([0, 0, -0.8])
    c, s = np.cos(facing), np.sin(facing)
    R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return (base[None] + walk) @ R.T + np.asarray(offset)


@pytest.mark.parametrize("facing", [0.0, 1.0, -2.5])
def test_stands_at_the_table_upright_facing_the_path(facing, dtype):
    scene = robotica(dtype=dtype)
    person = person_from_joints(_record(facing=facing), NAMES, 100.0, scene, duration=3.0, new_rate=20.0)
    assert person.a.dtype == dtype and person.a.shape == (61, len(REGIONS), 3)
    a, b = np.asarray(person.a, float), np.asarray(person.b, float)
    place, middle = np.asarray(standing_place(scene), float), np.asarray(path_middle(scene), float)[:2]
    front = (middle - place) / np.linalg.norm(middle - place)
    hip = a[:, 0]
    np.testing.assert_allclose(hip[-1, :2], place, atol=0.05)  # nearest at the end of the walk
    np.testing.assert_allclose(hip[:, 2], FLOOR_Z + HIP_HEIGHT, atol=1e-5)
    np.testing.assert_allclose(hip[40, :2] - hip[0, :2], 0.8 * front, atol=1e-5)  # walks to the table
    right = np.array([front[1], -front[0]])
    np.testing.assert_allclose(a[0, 5, :2] - a[0, 4, :2], 0.4 * right, atol=1e-5)  # shoulders
    np.testing.assert_allclose(b[0, 6, :2] - a[0, 6, :2], 0.25 * front, atol=1e-5)  # forearm points ahead
    assert b[0, 3, 2] > a[0, 2, 2] > a[0, 1, 2] > a[0, 0, 2]  # head over neck over waist over hip
    np.testing.assert_allclose(b[:, 12:, 2], FLOOR_Z + 0.07, atol=1e-5)  # legs stand on the floor
    assert (np.asarray(person.radius) > 0).all()


def test_resamples_and_holds_the_last_pose():
    scene = robotica(dtype=jnp.float64)
    person = person_from_joints(_record(), NAMES, 100.0, scene, duration=4.0, new_rate=30.0)
    hip = np.asarray(person.a)[:, 0]
    speed = np.linalg.norm(np.diff(hip, axis=0), axis=-1) * 30
    np.testing.assert_allclose(speed[:59], 0.4, atol=1e-6)  # 0.8 m in 2 s
    np.testing.assert_allclose(speed[61:], 0, atol=1e-9)
    assert float(person.rate) == 30
    slow = person_from_joints(_record(), NAMES, 50.0, scene, duration=4.0, new_rate=30.0)
    slow_speed = np.linalg.norm(np.diff(np.asarray(slow.a)[:, 0], axis=0), axis=-1) * 30
    np.testing.assert_allclose(slow_speed[:119], 0.2, atol=1e-6)
    moved = person_from_joints(_record(), NAMES, 100.0, scene, aside=0.2, back=0.3)
    np.testing.assert_allclose(np.asarray(moved.a)[-1, 0, :2], standing_place(scene, 0.2, 0.3), atol=0.05)


def test_glitches_are_kept_but_do_not_move_the_rest():
    scene = robotica(dtype=jnp.float64)
    record = _record()
    clean = person_from_joints(record, NAMES, 100.0, scene, duration=2.0, new_rate=100.0)
    record[50:53] += 7.0
    glitchy = person_from_joints(record, NAMES, 100.0, scene, duration=2.0, new_rate=100.0)
    difference = np.abs(np.asarray(glitchy.a - clean.a)).max((1, 2))
    assert difference[51] > 5 and difference[:49].max() < 0.05 and difference[54:].max() < 0.05


def test_names_and_errors():
    other = ("mixamorig:Hips", "Neck", "Head", "LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightForeArm",
             "RightHand")  # fmt: skip
    columns = joint_columns(other)
    assert [columns[k] for k in ("hip", "neck", "left_upper_arm", "left_forearm", "right_hand")] == [0, 1, 3, 4, 8]
    scene, record = robotica(), _record(5)
    with pytest.raises(ValueError, match="no joint for 'right_hand'"):
        person_from_joints(record[:, :-1], NAMES[:-1], 100.0, scene)
    with pytest.raises(ValueError, match="hip to neck measures 500 m"):
        person_from_joints(record * 1000, NAMES, 100.0, scene)
    with pytest.raises(ValueError, match="finite"):
        person_from_joints(record * np.nan, NAMES, 100.0, scene)
    with pytest.raises(ValueError, match="rate"):
        person_from_joints(record, NAMES, 0.0, scene)
