"""A table of figures as a MuJoCo model: capsules, motors, no meshes, no contacts."""

import math
from collections.abc import Iterable

from hrcjax.robot.tables import GRAVITY, JOINT_NAMES, ArmTable, CapsuleRow, arm_table


def _text(values: Iterable[float]) -> str:
    return " ".join(repr(round(float(v), 15) + 0.0) for v in values)


def _capsule(row: CapsuleRow) -> str:
    return f'<geom name="{row.name}" type="capsule" fromto="{_text((*row.a, *row.b))}" size="{row.radius}"/>'


def _link(table: ArmTable, i: int) -> str:
    a, d, alpha = float(table.a[i]), float(table.d[i]), float(table.alpha[i])
    sin, cos = math.sin(alpha), math.cos(alpha)
    J = table.inertia[i]
    inertia = (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    inner = [
        # the axis of joint i + 1 is the z axis of the frame before, seen from this link's own
        f'<joint name="{JOINT_NAMES[i]}" axis="{_text((0.0, sin, cos))}" pos="{_text((-a, -d * sin, -d * cos))}"/>',
        f'<inertial pos="{_text(table.com[i])}" mass="{_text([table.mass[i]])}" fullinertia="{_text(inertia)}"/>',
        *(_capsule(row) for row in table.capsules if row.link == i),
        _link(table, i + 1) if i + 1 < len(JOINT_NAMES) else '<site name="tool"/>',
    ]
    quat = (math.cos(alpha / 2), math.sin(alpha / 2), 0.0, 0.0)
    head = f'<body name="frame_{i + 1}" pos="{_text((a, 0.0, d))}" quat="{_text(quat)}">'
    return "\n".join([head, *inner, "</body>"])


def ur_xml(variant: str = "ur5") -> str:
    """MJCF text of a UR5 or UR5e; loads in MuJoCo and MJX.

    Bodies `frame_1` to `frame_6` carry the Denavit-Hartenberg frames of the table; the site `tool` is the flange; the
    keyframe `home` has the elbow up and the tool down. Motors take torques [N m] and saturate at the joints' limits.
    Joint ranges are left out: they would add constraint forces that a smooth model does not have.

    Raises:
        ValueError: no such arm.
    """
    table = arm_table(variant)
    base = "\n".join(_capsule(row) for row in table.capsules if row.link == -1)
    motors = "\n".join(
        f'<motor name="{name}" joint="{name}" forcerange="{_text((-top, top))}"/>'
        for name, top in zip(JOINT_NAMES, table.tau_max, strict=True)
    )
    return f"""<mujoco model="{table.name}">
<compiler angle="radian" autolimits="true"/>
<option integrator="Euler" timestep="0.002" gravity="0 0 {-GRAVITY}"><flag contact="disable"/></option>
<default><geom contype="0" conaffinity="0" rgba="0.7 0.75 0.8 1"/></default>
<worldbody>
{base}
{_link(table, 0)}
</worldbody>
<actuator>
{motors}
</actuator>
<keyframe><key name="home" qpos="{_text(table.home)}"/></keyframe>
</mujoco>
"""
