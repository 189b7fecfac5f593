"""Which joint of a recorded skeleton is which: the naming schemes of the usual tools.

Names are compared without capitals, separators, the name of the skeleton before them ("mixamorig:", "Bip01 ", "DEF-"), and
with the side before or after: "Left...", "L...", "....L", "..._r".
"""

import re
from collections.abc import Mapping, Sequence

_CENTRE = {
    "hip": ("hips", "hip", "pelvis", "root"),
    "neck": ("neck", "neck1", "neck01", "neckbase", "lowerneck"),
    "head": ("head",),
}
_SIDES = {
    # MotionBuilder, Mixamo, Perception Neuron, Rokoko: Arm; Xsens segments, 3ds Max, Rigify, Unreal, VRM: UpperArm;
    # OptiTrack: UArm; Poser, DAZ: Shldr; Vicon, CMU's ASF: humerus. Where one of those is there, Shoulder is the collar
    # bone; where not (Xsens, Kinect, SMPL), it is the joint of the upper arm.
    "upper_arm": ("upperarm", "arm", "uparm", "uarm", "shldr", "shldrbend", "humerus", "shoulderjoint", "shoulder"),
    "forearm": ("forearm", "lowerarm", "lowarm", "farm", "forearmbend", "radius", "elbow"),
    "hand": ("wrist", "hand"),
    "foot": ("foot", "ankle"),
}
_RIGIFY = {"spine": "hips", "spine004": "neck", "spine006": "head"}
"""Blender's Rigify counts the spine from the hip to the head."""
_SKELETONS = ("mixamorig", "bip", "def", "org", "valvebiped", "ccbase", "character", "jbip")
"""First words of names that tell the skeleton and not the joint."""
_SIDE_WORDS = ("left", "right", "l", "r")

JOINTS = (
    "hip", "neck", "head", "left_upper_arm", "right_upper_arm", "left_forearm", "right_forearm", "left_hand", "right_hand",
)  # fmt: skip
"""The joints that a person needs: where the bone of this name begins. A hand begins at the wrist."""
FEET = ("left_foot", "right_foot")
"""Joints that tell more of what is up, if they are there."""


def joint_columns(names: Sequence[str], given: Mapping[str, str] | None = None) -> dict[str, int]:
    """Where the nine joints of `JOINTS`, and those of `FEET` that are there, stand among the names of a record.

    Args:
        names: of the record's joints.
        given: names of joints whose name follows no scheme: joint of `JOINTS` -> name in the record.

    Raises:
        ValueError: a joint is missing; the message names it and what is accepted.
    """
    known = _plain_names(names)
    columns = {}
    for joint, name in (given or {}).items():
        if joint not in (*JOINTS, *FEET):
            raise ValueError(f"no joint {joint!r} is needed: accepted are {', '.join((*JOINTS, *FEET))}")
        if name not in names:
            raise ValueError(f"no joint {name!r} for {joint!r} among {_some(names)}")
        columns[joint] = list(names).index(name)
    for joint in (*JOINTS, *FEET):
        accepted = _accepted(joint)
        found = [known.index(name) for name in accepted if name in known]
        if joint not in columns and found:
            columns[joint] = found[0]
        if joint not in columns and joint in JOINTS:
            raise ValueError(
                f"no joint for {joint!r} among {_some(names)}: accepted are names such as {_some(accepted)}"
            )
    return columns


def _accepted(joint: str) -> list[str]:
    """The plain names of a joint, most certain first."""
    side, _, part = joint.partition("_")
    if joint in _CENTRE:
        return [form for name in _CENTRE[joint] for form in (name, f"c{name}")]
    return [form for name in _SIDES[part] for form in (side + name, side[0] + name, name + side, name + side[0])]


def _some(names: Sequence[str], most: int = 30) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def _plain_names(names: Sequence[str]) -> list[str]:
    """Names in small letters, without separators and without the word that all share or that tells the skeleton."""
    words = [re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name.split(":")[-1]) for name in names]
    words = [[word.lower() for word in parts] for parts in words]
    while True:
        first = [parts[0] for parts in words if len(parts) > 1]
        shared = {word for word in first if 3 * first.count(word) >= 2 * len(words) and word not in _SIDE_WORDS}
        drop = shared | set(_SKELETONS)
        shorter = [parts[1:] if len(parts) > 1 and parts[0] in drop else parts for parts in words]
        # the number of a skeleton, as in Bip01
        shorter = [
            new[1:] if new is not old and len(new) > 1 and new[0].isdigit() else new
            for new, old in zip(shorter, words, strict=True)
        ]
        if shorter == words:
            break
        words = shorter
    plain = ["".join(parts) for parts in words]
    return [_RIGIFY.get(name, name) for name in plain] if set(_RIGIFY) <= set(plain) else plain
