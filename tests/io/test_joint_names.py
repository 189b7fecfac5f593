"""Joints by their names, in any order, and angles in degrees."""

import numpy as np
import pytest

from hrcjax.io.recordings.joints import ORDER, columns_of, read_joints
from hrcjax.lab.errors import UsageError

MOST = np.array([6.283, 6.283, 3.142, 6.283, 6.283, 6.283])
Q = np.array([[0.1, -0.2, 0.3, -0.4, 0.5, -0.6]] * 2)


@pytest.mark.parametrize(
    ("names", "order"),
    [
        (sorted(f"{name}_joint" for name in ORDER), (2, 1, 0, 3, 4, 5)),  # of /joint_states
        ([f"left_ur5_{name}_joint" for name in ORDER[::-1]], (5, 4, 3, 2, 1, 0)),
        (["Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3"], (0, 1, 2, 3, 4, 5)),
    ],
)
@pytest.mark.parametrize("key", ["joint_names", "names", "name"])
def test_names_put_columns_in_order(tmp_path, names, order, key) -> None:
    columns = Q[:, list(order)]
    np.savez(
        tmp_path / "q.npz",
        stamp=[0.0, 1.0],
        q=np.column_stack([np.full(2, 9e9), columns]),
        **{key: ["finger_joint", *names]},
    )
    record = read_joints(tmp_path / "q.npz", MOST)
    np.testing.assert_array_equal(record.q, Q)
    assert record.named and "by their names" in record.notes[0]


def test_without_names_the_order_is_assumed_and_said(shared_cases) -> None:
    record = read_joints(shared_cases / "joints_base_and_order" / "q.npz", MOST)
    assert not record.named and "from the base to the flange (ASSUMED" in record.notes[0]


def test_degrees_are_noticed(shared_cases, tmp_path) -> None:
    with pytest.raises(UsageError, match=r"is 34\.3775, beyond the limits of this arm \[rad\] \(degrees\?") as error:
        read_joints(shared_cases / "joints_base_and_order" / "q_deg.npz", MOST)
    assert "\n" not in str(error.value)
    np.savez(tmp_path / "q.npz", stamp=[0.0, 1.0], q=1000 * Q)
    with pytest.raises(UsageError, match="beyond the limits") as error:
        read_joints(tmp_path / "q.npz", MOST)
    assert "degrees?" not in str(error.value)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ([*ORDER[:5], "finger"], "missing: wrist_3"),
        ([*ORDER[:5], "shoulder_pan_joint"], "occurs twice"),
    ],
)
def test_names_that_do_not_suffice(tmp_path, names, said) -> None:
    with pytest.raises(UsageError, match=said):
        columns_of(tmp_path / "q.npz", names)
    np.savez(tmp_path / "q.npz", stamp=[0.0, 1.0], q=Q, joint_names=names[:5])
    with pytest.raises(UsageError, match=r"joint_names is \(5,\)"):
        read_joints(tmp_path / "q.npz", MOST)
