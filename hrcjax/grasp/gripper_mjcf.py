"""The gripper as a MuJoCo model: box fingers on coupled slides, held and moved by a weld to a body without dynamics."""

from hrcjax.grasp.gripper import Gripper

STIFFNESS = 1e4
"""Of the fingers' position servo, below its limit of force [N/m]."""

BARE = 0.15
"""Friction of fingers and palm beside the pads, as of smooth metal [1]."""
HARD = 'solref="0.004 1" solimp="0.99 0.999 0.0005"'
"""Contacts that give way by 0.1 mm at most under the fingers' force; MuJoCo's own give way by millimetres at a light object."""


def gripper_xml(gripper: Gripper, friction: float | None = None) -> tuple[str, str]:
    """MJCF of the bodies, and of the elements beside `worldbody`.

    The mocap body `hand_target` pulls the body `hand`; both have the frame of `Gripper`, whose origin is the tool point.
    The actuators `left` and `right` take half the opening [m]. The geoms `left_pad` and `right_pad` decide the friction of
    a contact, whatever they touch.

    Args:
        friction: of the pads, and at most that of the rest of the gripper; None: the gripper's own [1].
    """
    mu = gripper.friction if friction is None else friction
    (px, pz), t = gripper.pad, gripper.thickness / 2
    palm = gripper.palm
    bare = min(mu, BARE)
    smooth = f'friction="{bare} {0.005 * bare} {0.0002 * bare}" priority="1" {HARD}'
    mid, half = (pz - gripper.length) / 2, (pz + gripper.length) / 2
    fingers = ""
    for name, side in (("left", 1), ("right", -1)):
        fingers += f"""<body name="{name}" pos="0 {side * t} 0" gravcomp="1">
<joint name="{name}" type="slide" axis="0 {side} 0" range="0 {gripper.stroke / 2}" damping="60" armature="0.1"/>
<geom name="{name}_finger" type="box" size="{px} {0.9 * t} {half}" pos="0 {0.1 * side * t} {mid}" mass="0.05" {smooth}/>
<geom name="{name}_pad" type="box" size="{px} {0.2 * t} {pz}" pos="0 {-0.8 * side * t} 0" mass="0.02" condim="6"
 friction="{mu} {0.005 * mu} {0.0002 * mu}" priority="1" {HARD} rgba="0.2 0.2 0.25 1"/>
</body>"""
    bodies = f"""<body name="hand_target" mocap="true" pos="0 0 0.5"/>
<body name="hand" pos="0 0 0.5" gravcomp="1"><freejoint/>
<geom name="palm" type="box" size="{palm[0]} {palm[1]} {palm[2]}" pos="0 0 {-gripper.length - palm[2]}" mass="0.8" {smooth}/>
{fingers}</body>"""
    drive = f'kp="{STIFFNESS}" ctrlrange="0 {gripper.stroke / 2}" forcerange="{-gripper.force} {gripper.force}"'
    beside = f"""<equality>
<weld body1="hand_target" body2="hand" solref="0.005 1" solimp="0.99 0.999 0.0001"/>
<joint joint1="left" joint2="right" polycoef="0 1 0 0 0" solref="0.005 1"/>
</equality>
<actuator>
<position name="left" joint="left" {drive}/>
<position name="right" joint="right" {drive}/>
</actuator>
<contact><exclude body1="left" body2="right"/><exclude body1="hand" body2="left"/><exclude body1="hand" body2="right"/></contact>"""
    return bodies, beside
