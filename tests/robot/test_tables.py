"""The tables against the outside files, and the laws a table of inertias must keep."""

import re

import numpy as np
import pytest

from hrcjax.robot import UR5, UR5E, arm_table


def numbers(text: str, key: str) -> list[float]:
    return [float(x) for x in re.findall(rf"\b{key}:\s*([-\d.e]+)", text)]


def test_ur5_lengths_are_those_of_the_ros_description(shared_data):
    text = (shared_data / "ur5_model" / "ros2_default_kinematics.yaml").read_text()
    x, y, z = numbers(text, "x"), numbers(text, "y"), numbers(text, "z")
    assert UR5.d[0] == z[0]
    assert UR5.a[1:3].tolist() == [x[2], x[3]]
    assert UR5.d[3] == z[3]
    assert (UR5.d[4], UR5.d[5]) == (-y[4], y[5])


def test_ur5_masses_and_inertias_are_those_of_the_ros_description(shared_data):
    text = (shared_data / "ur5_model" / "ros2_physical_parameters.yaml").read_text()
    for i, name in enumerate(("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")):
        assert UR5.mass[i] == numbers(text, f"{name}_mass")[0]
    tensors = text[text.index("tensor:") :]
    across, along = numbers(tensors, "ixx"), numbers(tensors, "izz")
    axis = [1, 0, 0, 1, 1, 2]  # of the cylinder, in the frame of the table
    for i in range(6):
        moments = np.diag(UR5.inertia[i])
        assert moments[axis[i]] == along[i]
        assert all(moments[k] == across[i] for k in range(3) if k != axis[i])
    cog = text[text.index("center_of_mass:") : text.index("rotation:")]
    c = np.stack([numbers(cog, k) for k in "xyz"], axis=1)  # in the ROS link frames: before alpha, and before a
    for i in range(6):
        ca, sa = np.cos(UR5.alpha[i]), np.sin(UR5.alpha[i])
        ours = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]]) @ UR5.com[i] + [UR5.a[i], 0, 0]
        np.testing.assert_allclose(ours, c[i], atol=1e-12)


def test_ur5_limits_are_those_of_the_ros_description(shared_data):
    text = (shared_data / "ur5_model" / "ros2_joint_limits.yaml").read_text()
    degrees = [float(x) for x in re.findall(r"max_position: !degrees\s+([\d.]+)", text)]
    speeds = [float(x) for x in re.findall(r"max_velocity: !degrees\s+([\d.]+)", text)]
    np.testing.assert_allclose(UR5.q_max, np.deg2rad(degrees))
    np.testing.assert_allclose(UR5.qd_max, np.deg2rad(speeds))
    np.testing.assert_allclose(UR5.tau_max, numbers(text, "max_effort"))


def test_ur5e_is_the_published_table():
    assert UR5E.d.tolist() == [0.1625, 0, 0, 0.1333, 0.0997, 0.0996]
    assert UR5E.a.tolist() == [0, -0.425, -0.3922, 0, 0, 0]
    assert UR5E.mass.tolist() == [3.761, 8.058, 2.846, 1.37, 1.3, 0.365]
    np.testing.assert_array_equal(UR5E.com, UR5.com)
    # the maker's tensors by their sums, added up by hand
    traces = [0.02005587, 0.68141178, 0.16127396, 0.00427732, 0.00360058, 0.00063358]
    products = [0.0005112, 0.00006144, 0.00139297, 0.00010877, 0.00005766, 0.00000115]
    np.testing.assert_allclose(np.trace(UR5E.inertia, axis1=1, axis2=2), traces, rtol=1e-9)
    upper = np.abs(UR5E.inertia)[:, [0, 0, 1], [1, 2, 2]]
    np.testing.assert_allclose(upper.sum(axis=1), products, rtol=1e-9)
    assert UR5E.inertia[2][0, 2] == 0.00137272
    assert [UR5E.inertia[i][1, 2] for i in (0, 3, 4)] == [0.00049994, 0.00010157, -0.00005048]
    np.testing.assert_allclose(UR5E.inertia, UR5E.inertia.transpose(0, 2, 1))


@pytest.mark.parametrize("table", [UR5, UR5E], ids=["ur5", "ur5e"])
def test_inertias_are_those_of_bodies(table):
    for J in table.inertia:
        a, b, c = np.linalg.eigvalsh(J)
        assert a > 0
        assert c < a + b  # of any body


@pytest.mark.parametrize("table", [UR5, UR5E], ids=["ur5", "ur5e"])
def test_links_are_as_long_as_their_inertia_says(table):
    """The long moment of the arm tubes is that of a rod of the table's length to within a factor of 3."""
    for i in (1, 2):
        rod = table.mass[i] * table.a[i] ** 2 / 12
        assert rod / 3 < table.inertia[i][1, 1] < rod * 3
        assert table.inertia[i][0, 0] < 0.2 * table.inertia[i][1, 1]


def test_accelerations_are_ours_and_below_what_the_motors_give():
    assert UR5.qdd_max.tolist() == [15, 15, 15, 25, 25, 25]


def test_unknown_variant():
    with pytest.raises(ValueError, match=r"ur10.*accepted: ur5, ur5e"):
        arm_table("ur10")
