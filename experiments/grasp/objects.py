"""Ten shapes of household size as MuJoCo geoms and convex meshes, and the ways in which each may rest on a table."""

import math
from dataclasses import dataclass

import numpy as np

DENSITY = 500.0
"""Of all objects, as of wood [kg/m^3]."""
Rest = tuple[float, float, float]
UPRIGHT: Rest = (0.0, 0.0, 0.0)
LYING: Rest = (math.pi / 2, 0.0, 0.0)
ON_SIDE: Rest = (0.0, math.pi / 2, 0.0)


@dataclass(frozen=True)
class Shape:
    """A rigid object made of convex parts."""

    name: str
    geoms: tuple[str, ...]
    """Its parts: attributes of MuJoCo geoms, in the object's frame [m]."""
    rests: tuple[Rest, ...]
    """Roll, pitch and yaw in which it stands on a table [rad]; poses take them in turn."""
    meshes: tuple[tuple[str, str], ...] = ()
    """Name and corners of the convex meshes that its parts use [m]."""


def _text(values: np.ndarray) -> str:
    return " ".join(f"{v:.6g}" for v in np.asarray(values).ravel())


def _prism(section: np.ndarray, low: float, high: float, share: float = 1.0) -> str:
    """Corners of a prism, or of a frustum whose top is the given share of its base [m]."""
    base = np.column_stack([section, np.full(len(section), low)])
    top = np.column_stack([share * section, np.full(len(section), high)])
    return _text(np.concatenate([base, top]))


def _ring(radius: float, corners: int) -> np.ndarray:
    angle = 2 * math.pi * np.arange(corners) / corners
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _mug(radius: float = 0.036, wall: float = 0.005, height: float = 0.09, staves: int = 16) -> tuple[str, ...]:
    """A cup of upright staves with a bottom and a handle of three bars."""
    middle, half = radius - wall / 2, radius * math.tan(math.pi / staves)
    parts = [f'type="cylinder" size="{middle:.5f} 0.003" pos="0 0 {0.003 - height / 2:.5f}"']
    for k in range(staves):
        angle = 2 * math.pi * k / staves
        x, y = middle * math.cos(angle), middle * math.sin(angle)
        parts.append(f'type="box" size="{wall / 2} {half:.5f} {height / 2}" pos="{x:.5f} {y:.5f} 0" euler="0 0 {angle:.6f}"')  # fmt: skip
    out = radius + 0.026
    for ends in ((radius, 0.025, out, 0.025), (out, 0.025, out, -0.025), (out, -0.025, radius, -0.025)):
        parts.append(f'type="capsule" size="0.005" fromto="{ends[0]} 0 {ends[1]} {ends[2]} 0 {ends[3]}"')
    return tuple(parts)


SHAPES = (
    Shape("box", ('type="box" size="0.025 0.035 0.045"',), (UPRIGHT, LYING, ON_SIDE)),
    Shape("cylinder", ('type="cylinder" size="0.03 0.05"',), (UPRIGHT,)),
    Shape("lying_cylinder", ('type="cylinder" size="0.026 0.06"',), (LYING,)),
    Shape("ball", ('type="sphere" size="0.035"',), (UPRIGHT,)),
    Shape("capsule", ('type="capsule" size="0.024 0.04"',), (LYING,)),
    Shape("frustum", ('type="mesh" mesh="frustum"',), (UPRIGHT,), (("frustum", _prism(_ring(0.038, 32), -0.045, 0.045, 0.63)),)),
    Shape("l_shape", ('type="box" size="0.05 0.02 0.02" pos="0 0 -0.02"', 'type="box" size="0.02 0.02 0.03" pos="-0.03 0 0.03"'), (UPRIGHT, LYING)),
    Shape("mug", _mug(), (UPRIGHT,)),
    Shape("hexagon", ('type="mesh" mesh="hexagon"',), (UPRIGHT, (math.pi / 2, 0.0, math.pi / 6)), (("hexagon", _prism(_ring(0.033, 6), -0.04, 0.04)),)),
    Shape("wedge", ('type="mesh" mesh="wedge"',), (LYING, UPRIGHT), (("wedge", _prism(np.array([[-0.04, -0.02], [0.04, -0.02], [-0.01, 0.04]]), -0.033, 0.033)),)),
)  # fmt: skip
"""Every one has a place that two fingers 85 mm apart can hold."""
NAMES = tuple(shape.name for shape in SHAPES)


def shape_named(name: str) -> Shape:
    """A shape by name."""
    return SHAPES[NAMES.index(name)]


def object_xml(shape: Shape, position: tuple[float, float, float], yaw: float, rest: Rest, friction: float) -> tuple[str, str]:  # fmt: skip
    """MJCF of the meshes, and of the body on its free joint.

    Args:
        position: of its frame [m].
        yaw: about the vertical, after the rest [rad].
        rest: roll, pitch, yaw of how it stands [rad].
        friction: against the table; what the fingers' friction is they decide themselves [1].
    """
    assets = "".join(f'<mesh name="{name}" vertex="{corners}"/>' for name, corners in shape.meshes)
    geoms = "".join(
        f'<geom {part} density="{DENSITY}" friction="{friction} 0.002 0.0002" condim="6" rgba="0.85 0.55 0.25 1"/>'
        for part in shape.geoms
    )
    turn = _quaternion((0.0, 0.0, yaw), rest)
    body = f'<body name="object" pos="{_text(np.array(position))}" quat="{_text(turn)}"><freejoint/>{geoms}</body>'
    return assets, body


def _quaternion(last: Rest, first: Rest) -> np.ndarray:
    """Of two turns about the fixed axes, roll, pitch, yaw each."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_euler("xyz", last) * Rotation.from_euler("xyz", first)
    return turn.as_quat()[[3, 0, 1, 2]]
