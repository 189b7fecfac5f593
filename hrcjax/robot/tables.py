"""The UR5 and the UR5e in figures: Denavit-Hartenberg parameters, masses, limits, shape. Each with its source.

Frames are the standard Denavit-Hartenberg ones: frame i = frame i-1, turned by q_i about z, moved by d_i along z, moved
by a_i along x, turned by alpha_i about x. Frame 0 is the base, its z axis up; frame 6 is the flange. Link 0 moves with
joint 1 and carries frame 1.
"""

import math
from dataclasses import dataclass

import numpy as np

Triple = tuple[float, float, float]
JOINT_NAMES = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
GRAVITY = 9.81
"""[m/s^2]"""


@dataclass(frozen=True)
class CapsuleRow:
    """A capsule that rides on a link, and how many control points cover it."""

    name: str
    link: int
    """-1 is the base, which does not move."""
    a: Triple
    """One end of the axis in the frame of the link [m]."""
    b: Triple
    """The other end [m]."""
    radius: float
    """[m]"""
    spheres: int
    """Number of control points."""


@dataclass(frozen=True, eq=False)
class ArmTable:
    """Everything that is known of one arm."""

    name: str
    a: np.ndarray
    """(joint) [m]"""
    d: np.ndarray
    """(joint) [m]"""
    alpha: np.ndarray
    """(joint) [rad]"""
    mass: np.ndarray
    """(joint) [kg]"""
    com: np.ndarray
    """(joint 3) centre of mass in the frame of the link [m]"""
    inertia: np.ndarray
    """(joint 3 3) inertia about the centre of mass, in the axes of the frame of the link [kg m^2]"""
    q_max: np.ndarray
    """(joint) [rad]; the lower limit is its negative"""
    qd_max: np.ndarray
    """(joint) [rad/s]"""
    qdd_max: np.ndarray
    """(joint) [rad/s^2]"""
    tau_max: np.ndarray
    """(joint) [N m]"""
    home: np.ndarray
    """(joint) elbow up, tool down [rad]"""
    capsules: tuple[CapsuleRow, ...]


def _cylinder(across: float, along: float, axis: int) -> np.ndarray:
    moments = np.full(3, across)
    moments[axis] = along
    return np.diag(moments)


def _tensor(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float) -> np.ndarray:
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _shape(a2: float, a3: float, d1: float, d4: float, d5: float, upper: float, fore: float) -> tuple[CapsuleRow, ...]:
    """Capsules of both arms. `upper`, `fore`: how far the arm tubes stand off along the axes of joints 2 and 3 [m]."""
    return (
        CapsuleRow("base", -1, (0.0, 0.0, 0.02), (0.0, 0.0, 0.06), 0.07, 0),
        CapsuleRow("shoulder", 0, (0.0, 0.06 - d1, 0.0), (0.0, 0.0, 0.06), 0.065, 0),
        CapsuleRow("upper arm", 1, (-a2, 0.0, upper), (0.0, 0.0, upper), 0.06, 5),
        CapsuleRow("elbow", 1, (0.0, 0.0, upper), (0.0, 0.0, fore), 0.05, 1),
        CapsuleRow("forearm", 2, (-a3, 0.0, fore), (0.0, 0.0, fore), 0.05, 5),
        CapsuleRow("wrist 1", 3, (0.0, fore - d4, 0.0), (0.0, 0.0, 0.0), 0.05, 3),
        CapsuleRow("wrist 2", 4, (0.0, 0.6 * d5, 0.0), (0.0, 0.0, 0.0), 0.05, 2),
        CapsuleRow("wrist 3", 5, (0.0, 0.0, -0.05), (0.0, 0.0, -0.015), 0.045, 2),
    )


# Lengths, masses, centres of mass: Universal Robots, "DH parameters for calculations of kinematics and dynamics".
# Limits: UR5 user manual 3.13, UR5e user manual, "Max. joint torques"; elbow +-pi as in Universal Robots' ROS
# description (the upper arm is in the way beyond). Accelerations are not published: 15 rad/s^2 for the joints of the
# arm and 25 for those of the wrist are our choice. Radii and stand-offs of the tubes: the ROS description's "manually
# measured" radii 0.054, 0.040, 0.045 m and its shoulder and elbow offsets, the radii rounded up by 5 to 10 mm for caps
# and cables; the capsules are ours.
_ALPHA = np.array([math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0])
_COM = np.array(
    [
        [0.0, -0.02561, 0.00193],
        [0.2125, 0.0, 0.11336],
        [0.15, 0.0, 0.0265],
        [0.0, -0.0018, 0.01634],
        [0.0, 0.0018, 0.01634],
        [0.0, 0.0, -0.001159],
    ]
)
_Q_MAX = np.array([2.0, 2.0, 1.0, 2.0, 2.0, 2.0]) * math.pi
_QD_MAX = np.full(6, math.pi)
_QDD_MAX = np.array([15.0, 15.0, 15.0, 25.0, 25.0, 25.0])
_TAU_MAX = np.array([150.0, 150.0, 150.0, 28.0, 28.0, 28.0])
_HOME = np.array([0.0, -0.5, 0.5, -0.5, -0.5, 0.0]) * math.pi

UR5 = ArmTable(
    name="ur5",
    a=np.array([0.0, -0.425, -0.39225, 0.0, 0.0, 0.0]),
    d=np.array([0.089159, 0.0, 0.0, 0.10915, 0.09465, 0.0823]),
    alpha=_ALPHA,
    mass=np.array([3.7, 8.393, 2.33, 1.219, 1.219, 0.1879]),
    com=_COM,
    # Cylinders, from the ROS description of the UR5; no measured figures are public. Its cylinders of links 1, 4, 5
    # and 6 stand along the joint's axis, which is the y axis of frames 1, 4 and 5 and the z axis of frame 6.
    inertia=np.stack(
        [
            _cylinder(0.014972358333333331, 0.01040625, 1),
            _cylinder(0.13388583541666665, 0.0151074, 0),
            _cylinder(0.031216803515624995, 0.004095, 0),
            _cylinder(0.002013889583333333, 0.0021942, 1),
            _cylinder(0.0018310395833333333, 0.0021942, 1),
            _cylinder(8.062475833333332e-05, 0.0001321171875, 2),
        ]
    ),
    q_max=_Q_MAX,
    qd_max=_QD_MAX,
    qdd_max=_QDD_MAX,
    tau_max=_TAU_MAX,
    home=_HOME,
    capsules=_shape(-0.425, -0.39225, 0.089159, 0.10915, 0.09465, 0.13585, 0.0165),
)
"""The UR5 of the CB3 series, its third kinematic revision."""

UR5E = ArmTable(
    name="ur5e",
    a=np.array([0.0, -0.425, -0.3922, 0.0, 0.0, 0.0]),
    d=np.array([0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996]),
    alpha=_ALPHA,
    mass=np.array([3.761, 8.058, 2.846, 1.37, 1.3, 0.365]),
    com=_COM,
    # Universal Robots' ROS description of the UR5e, which turns its tensors into the frames used here.
    inertia=np.stack(
        [
            _tensor(0.00700210, 0.00648091, 0.00657286, 0.00000073, -0.00001053, 0.00049994),
            _tensor(0.01505885, 0.33388086, 0.33247207, -0.00005400, 0.00000563, -0.00000181),
            _tensor(0.00399632, 0.07879254, 0.07848510, -0.00001365, 0.00137272, -0.00000660),
            _tensor(0.00165491, 0.00135962, 0.00126279, -0.00000282, -0.00000438, 0.00010157),
            _tensor(0.00135617, 0.00127827, 0.00096614, -0.00000274, 0.00000444, -0.00005048),
            _tensor(0.00018694, 0.00018908, 0.00025756, 0.00000006, -0.00000017, -0.00000092),
        ]
    ),
    q_max=_Q_MAX,
    qd_max=_QD_MAX,
    qdd_max=_QDD_MAX,
    tau_max=_TAU_MAX,
    home=_HOME,
    capsules=_shape(-0.425, -0.3922, 0.1625, 0.1333, 0.0997, 0.138, 0.007),
)
"""The UR5e of the e-series."""

TABLES = {table.name: table for table in (UR5, UR5E)}


def arm_table(variant: str) -> ArmTable:
    """The table of an arm by name.

    Raises:
        ValueError: no such arm.
    """
    if variant not in TABLES:
        raise ValueError(f"arm variant {variant!r} is not known; accepted: {', '.join(TABLES)}")
    return TABLES[variant]
