"""Small BVH files as the usual tools write them, and the true positions of the person in them.

Conventions from the tools' documentation: names, order of rotations, unit, up axis, channels, separators.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

# name: (parent, offset of the rest pose, y up, facing +z, left is +x [m])
SKELETON = {
    "hip": (None, (0.0, 0.93, 0.0)),
    "spine": ("hip", (0.0, 0.10, 0.0)),
    "chest": ("spine", (0.0, 0.18, -0.01)),
    "neck": ("chest", (0.0, 0.22, 0.0)),
    "head": ("neck", (0.0, 0.12, 0.02)),
}
for side, s in (("left", 1.0), ("right", -1.0)):
    SKELETON |= {
        f"{side}_collar": ("chest", (s * 0.05, 0.18, 0.0)),
        f"{side}_upper_arm": (f"{side}_collar", (s * 0.15, 0.0, 0.0)),
        f"{side}_forearm": (f"{side}_upper_arm", (s * 0.30, 0.0, 0.0)),
        f"{side}_hand": (f"{side}_forearm", (s * 0.25, 0.0, 0.0)),
        f"{side}_thigh": ("hip", (s * 0.09, -0.05, 0.0)),
        f"{side}_shin": (f"{side}_thigh", (0.0, -0.42, 0.0)),
        f"{side}_foot": (f"{side}_shin", (0.0, -0.40, 0.0)),
    }
NEEDED = ("hip", "neck", "head", "left_upper_arm", "right_upper_arm", "left_forearm", "right_forearm", "left_hand", "right_hand")  # fmt: skip


@dataclass(frozen=True)
class Tool:
    """How a tool writes: names of hip, spine, chest, neck, head; of the joints of a side, {s} is the side."""

    centre: tuple[str, str, str, str, str]
    limbs: tuple[str, ...]  # collar, upper arm, forearm, hand, thigh, shin, foot
    sides: tuple[str, str]
    unit: float
    order: str = "ZXY"
    up: str = "y"
    positions_everywhere: bool = False
    above: str = ""  # a joint above the hip
    eol: str = "\n"
    indent: str = "\t"
    end_sites: bool = True

    def names(self) -> dict[str, str]:
        known = dict(zip(("hip", "spine", "chest", "neck", "head"), self.centre, strict=True))
        parts = ("collar", "upper_arm", "forearm", "hand", "thigh", "shin", "foot")
        for side, word in zip(("left", "right"), self.sides, strict=True):
            known |= {f"{side}_{part}": name.format(s=word) for part, name in zip(parts, self.limbs, strict=True)}
        return known


MOTIONBUILDER = ("{s}Shoulder", "{s}Arm", "{s}ForeArm", "{s}Hand", "{s}UpLeg", "{s}Leg", "{s}Foot")
WORDS = ("Left", "Right")
TOOLS = {
    "motionbuilder": Tool(
        tuple(f"Character1_{n}" for n in ("Hips", "Spine", "Spine1", "Neck", "Head")),  # pyright: ignore[reportArgumentType]
        tuple(f"Character1_{n}" for n in MOTIONBUILDER), WORDS, 0.01, above="Character1_Reference", eol="\r\n",
    ),
    "mixamo": Tool(
        tuple(f"mixamorig:{n}" for n in ("Hips", "Spine", "Spine1", "Neck", "Head")),  # pyright: ignore[reportArgumentType]
        tuple(f"mixamorig:{n}" for n in MOTIONBUILDER), WORDS, 0.01, "XYZ", positions_everywhere=True,
    ),
    "mixamo through Blender": Tool(
        tuple(f"mixamorig_{n}" for n in ("Hips", "Spine", "Spine1", "Neck", "Head")),  # pyright: ignore[reportArgumentType]
        tuple(f"mixamorig_{n}" for n in MOTIONBUILDER), WORDS, 1.0, "XYZ", "z", positions_everywhere=True,
    ),
    "xsens": Tool(
        ("Hips", "Chest", "Chest4", "Neck", "Head"),
        ("{s}Collar", "{s}Shoulder", "{s}Elbow", "{s}Wrist", "{s}Hip", "{s}Knee", "{s}Ankle"), WORDS, 0.01, "YXZ",
    ),
    "rigify": Tool(
        ("spine", "spine.001", "spine.002", "spine.004", "spine.006"),
        ("shoulder.{s}", "upper_arm.{s}", "forearm.{s}", "hand.{s}", "thigh.{s}", "shin.{s}", "foot.{s}"),
        ("L", "R"), 1.0, "XYZ", "z", positions_everywhere=True, indent="  ",
    ),
    "rigify, bones that deform": Tool(
        ("DEF-spine", "DEF-spine.001", "DEF-spine.002", "DEF-spine.004", "DEF-spine.006"),
        ("DEF-shoulder.{s}", "DEF-upper_arm.{s}", "DEF-forearm.{s}", "DEF-hand.{s}", "DEF-thigh.{s}", "DEF-shin.{s}", "DEF-foot.{s}"),
        ("L", "R"), 1.0, "XYZ", "z", above="root",
    ),
    "3ds max": Tool(
        ("Bip01 Pelvis", "Bip01 Spine", "Bip01 Spine1", "Bip01 Neck", "Bip01 Head"),
        ("Bip01 {s} Clavicle", "Bip01 {s} UpperArm", "Bip01 {s} Forearm", "Bip01 {s} Hand", "Bip01 {s} Thigh", "Bip01 {s} Calf", "Bip01 {s} Foot"),
        ("L", "R"), 0.0254, "ZXY", "z", above="Bip01", end_sites=False,
    ),
    "cmu": Tool(
        ("hip", "abdomen", "chest", "neck", "head"),
        ("{s}Collar", "{s}Shldr", "{s}ForeArm", "{s}Hand", "{s}Thigh", "{s}Shin", "{s}Foot"), ("l", "r"), 0.0254 / 0.45, "ZYX",
    ),
    "perception neuron": Tool(
        ("Hips", "Spine", "Spine2", "Neck", "Head"), MOTIONBUILDER, WORDS, 0.01, "YXZ", positions_everywhere=True, eol="\r\n",
    ),
    "optitrack": Tool(
        ("Skeleton 001_Hip", "Skeleton 001_Ab", "Skeleton 001_Chest", "Skeleton 001_Neck", "Skeleton 001_Head"),
        tuple(f"Skeleton 001_{n}" for n in ("{s}Shoulder", "{s}UArm", "{s}FArm", "{s}Hand", "{s}Thigh", "{s}Shin", "{s}Foot")),
        ("L", "R"), 1.0, "XYZ",
    ),
    "vicon": Tool(
        ("root", "lowerback", "thorax", "lowerneck", "head"),
        ("{s}clavicle", "{s}humerus", "{s}radius", "{s}wrist", "{s}femur", "{s}tibia", "{s}foot"), ("l", "r"), 0.001, "XYZ", "z",
    ),
    "unreal": Tool(
        ("pelvis", "spine_01", "spine_03", "neck_01", "head"),
        ("clavicle_{s}", "upperarm_{s}", "lowerarm_{s}", "hand_{s}", "thigh_{s}", "calf_{s}", "foot_{s}"),
        ("l", "r"), 0.01, "XYZ", "z", above="root",
    ),
}  # fmt: skip


def motion(frames: int, seed: int = 0) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Positions of the hip (frame, 3) [m] and every joint's own turn (frame, 3, 3): a person who walks and reaches."""
    t = np.linspace(0, 1, frames)
    rng = np.random.default_rng(seed)
    hip = np.stack([0.1 * np.sin(3 * t), 0.93 - 0.03 * t, 0.6 * t], axis=1)
    angles = {name: rng.uniform(-0.15, 0.15, 3) * np.sin(5 * t)[:, None] for name in SKELETON}
    angles["hip"][:, 1] += 0.7
    angles["spine"][:, 0] += 0.3 * t  # leans forward
    for side, s in (("left", 1.0), ("right", -1.0)):
        angles[f"{side}_upper_arm"][:, 2] -= s * 1.2  # arms down
        angles[f"{side}_forearm"][:, 1] -= s * 1.0 * t  # and forward
    return hip, {name: Rotation.from_rotvec(vector).as_matrix() for name, vector in angles.items()}


def true_positions(frames: int, seed: int = 0) -> np.ndarray:
    """Of the joints `NEEDED` (frame, 9, 3), y up [m]."""
    hip, turns = motion(frames, seed)
    place, turned = {"hip": hip}, {"hip": turns["hip"]}
    for name, (parent, offset) in SKELETON.items():
        if parent is not None:
            place[name] = place[parent] + turned[parent] @ np.array(offset)
            turned[name] = turned[parent] @ turns[name]
    return np.stack([place[name] for name in NEEDED], axis=1)


def bvh_text(tool: Tool, frames: int = 12, rate: float = 60.0, names: dict[str, str] | None = None) -> str:
    """The person of `motion` as the tool would write it."""
    names = names or tool.names()
    axes = np.eye(3) if tool.up == "y" else np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # y up to z up
    hip, turns = motion(frames)
    lines, columns, tab = ["HIERARCHY"], [], tool.indent

    def numbers(vector: np.ndarray) -> str:
        return " ".join(f"{v:.9f}" for v in vector)

    def joint(name: str, deep: int) -> None:
        offset = axes @ np.array(SKELETON[name][1]) / tool.unit
        kind = "ROOT" if deep == 0 else "JOINT"
        lines.extend([f"{tab * deep}{kind} {names[name]}", f"{tab * deep}{{"])
        lines.append(f"{tab * (deep + 1)}OFFSET {numbers(offset)}")
        moves = name == "hip" or tool.positions_everywhere
        channels = ["Xposition", "Yposition", "Zposition"] * moves + [f"{axis}rotation" for axis in tool.order]
        lines.append(f"{tab * (deep + 1)}CHANNELS {len(channels)} {' '.join(channels)}")
        if moves:
            columns.append(hip @ axes.T / tool.unit if name == "hip" else np.tile(offset, (frames, 1)))
        turn = Rotation.from_matrix(axes @ turns[name] @ axes.T)
        columns.append(turn.as_euler(tool.order, degrees=True))
        below = [child for child, (parent, _) in SKELETON.items() if parent == name]
        for child in below:
            joint(child, deep + 1)
        if not below and tool.end_sites:
            end = [f"{tab * (deep + 1)}End Site", f"{tab * (deep + 1)}{{", f"{tab * (deep + 2)}OFFSET 0 0 0"]
            lines.extend([*end, f"{tab * (deep + 1)}}}"])
        lines.append(f"{tab * deep}}}")

    if tool.above:
        lines.extend([f"ROOT {tool.above}", "{", f"{tab}OFFSET 0 0 0"])
        lines.append(f"{tab}CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation")
        columns.append(np.zeros((frames, 6)))
        joint("hip", 1)
        lines.append("}")
    else:
        joint("hip", 0)
    lines.extend(["MOTION", f"Frames:{tab}{frames}", f"Frame Time:{tab}{1 / rate:.9f}"])
    lines.extend(numbers(row) for row in np.concatenate(columns, axis=1))
    return tool.eol.join(lines) + tool.eol
