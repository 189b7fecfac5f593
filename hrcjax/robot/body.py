"""The arm as the other modules see it: limits, shape, control points, tool."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

from dataclasses import dataclass, field, replace

import jax.numpy as jnp
import mujoco
import numpy as np

from hrcjax.geom.capsules import Capsules
from hrcjax.robot.chain import Chain, chain_from_mujoco
from hrcjax.robot.kinematics import link_frames, points_on_links
from hrcjax.robot.mjcf import ur_xml
from hrcjax.robot.tables import CapsuleRow, arm_table
from hrcjax.typing import Array, Float, Joints, Matrix3, Vector3

COVER_MARGIN = 0.0125
"""No point of a covered capsule is farther outside the union of the control spheres [m]."""


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm. Constant and hashable by identity: close over it, do not batch it.

    Link i moves with joint i; link -1 is the base.
    """

    variant: str
    model: mujoco.MjModel
    chain: Chain
    q_min: np.ndarray
    """(joint) [rad]"""
    q_max: np.ndarray
    """(joint) [rad]"""
    qd_max: np.ndarray
    """(joint) [rad/s]"""
    qdd_max: np.ndarray
    """(joint) not published, our choice [rad/s^2]"""
    tau_max: np.ndarray
    """(joint) [N m]"""
    home: np.ndarray
    """(joint) elbow up, tool down [rad]"""
    capsule_names: tuple[str, ...]
    """The first is the base, which does not move."""
    capsule_links: tuple[int, ...]
    capsule_a: np.ndarray
    """(capsule 3) one end of the axis in the frame of its link [m]"""
    capsule_b: np.ndarray
    """(capsule 3) the other end [m]"""
    capsule_radii: np.ndarray
    """(capsule) [m]"""
    control_links: tuple[int, ...]
    control_offsets: np.ndarray
    """(point 3) centre of a control sphere in the frame of its link [m]"""
    control_radii: np.ndarray
    """(point) [m]"""
    tool_link: int
    tool_offset: np.ndarray
    """(3) tool point in the frame of its link [m]"""
    tool_axes: np.ndarray = field(default_factory=lambda: np.eye(3))
    """(3 3) axes of the tool, as columns, in the frame of its link; z points out of the flange"""


def _spheres(row: CapsuleRow) -> tuple[np.ndarray, float]:
    """Centres and radius of the spheres that stand for a capsule.

    Spread evenly from end to end. Their radius is half-way between the capsule's and the one that would cover all of
    it: they stand out by as much as they fall short between two centres.
    """
    a, b = np.asarray(row.a), np.asarray(row.b)
    if row.spheres == 1:
        return (a + b)[None] / 2, row.radius + 0.01
    centres = np.linspace(a, b, row.spheres)
    half_gap = np.linalg.norm(b - a) / (row.spheres - 1) / 2
    return centres, (row.radius + float(np.hypot(row.radius, half_gap))) / 2


def covering_spheres(a: np.ndarray, b: np.ndarray, radius: float) -> tuple[np.ndarray, float]:
    """Centres and radius of spheres outside of which no point of the capsule lies by more than COVER_MARGIN.

    Half-way between the capsule's radius and that of spheres which would cover all of it: they stand out by as much as
    they fall short.
    """
    length = float(np.linalg.norm(b - a))
    half_gap = np.sqrt((radius + 2 * COVER_MARGIN) ** 2 - radius**2)
    count = max(1 if length == 0 else 2, int(np.ceil(length / (2 * half_gap))) + 1)
    if count == 1:
        return a[None], radius
    half = length / (count - 1) / 2
    return np.linspace(a, b, count), (radius + float(np.hypot(radius, half))) / 2


def load_arm(variant: str = "ur5") -> Arm:
    """The UR5 or UR5e with its tables, its compiled MuJoCo model and the chain read from it. The tool is the flange.

    Raises:
        ValueError: no such arm.
    """
    table = arm_table(variant)
    model = mujoco.MjModel.from_xml_string(ur_xml(variant))
    covered = [(row.link, *_spheres(row)) for row in table.capsules if row.spheres]
    return Arm(
        variant=variant,
        model=model,
        chain=chain_from_mujoco(model),
        q_min=-table.q_max,
        q_max=table.q_max,
        qd_max=table.qd_max,
        qdd_max=table.qdd_max,
        tau_max=table.tau_max,
        home=table.home,
        capsule_names=tuple(row.name for row in table.capsules),
        capsule_links=tuple(row.link for row in table.capsules),
        capsule_a=np.array([row.a for row in table.capsules]),
        capsule_b=np.array([row.b for row in table.capsules]),
        capsule_radii=np.array([row.radius for row in table.capsules]),
        control_links=tuple(link for link, centres, _ in covered for _ in centres),
        control_offsets=np.concatenate([centres for _, centres, _ in covered]),
        control_radii=np.array([radius for _, centres, radius in covered for _ in centres]),
        tool_link=len(table.mass) - 1,
        tool_offset=np.zeros(3),
    )


def with_tool(arm: Arm, length: float, radius: float) -> Arm:
    """The arm with a straight tool on its flange: a capsule along the flange's axis, whose far end is the tool point.

    The tool has no mass. Its control spheres stand from end to end of the capsule's axis: a point beyond the last one could approach
    faster than all of them.

    Raises:
        ValueError: a length that is not above twice the radius.
    """
    if not 0 < 2 * radius < length:
        raise ValueError(f"tool of length {length} m and radius {radius} m; accepted: 0 < 2 radius < length")
    link, base, axis = arm.tool_link, arm.tool_offset, arm.tool_axes[:, 2]
    a, b = base + radius * axis, base + (length - radius) * axis
    centres, covering = covering_spheres(a, b, radius)
    return replace(
        arm,
        capsule_names=(*arm.capsule_names, "tool"),
        capsule_links=(*arm.capsule_links, link),
        capsule_a=np.concatenate([arm.capsule_a, a[None]]),
        capsule_b=np.concatenate([arm.capsule_b, b[None]]),
        capsule_radii=np.append(arm.capsule_radii, radius),
        control_links=(*arm.control_links, *(link,) * len(centres)),
        control_offsets=np.concatenate([arm.control_offsets, centres]),
        control_radii=np.append(arm.control_radii, [covering] * len(centres)),
        tool_offset=base + length * axis,
    )


def arm_capsules(arm: Arm, q: Joints) -> Capsules:
    """The shape of the arm in the world, base first.

    Args:
        q: joint positions [rad].
    """
    count = len(arm.capsule_links)
    ends = points_on_links(arm.chain, q, arm.capsule_links * 2, np.concatenate([arm.capsule_a, arm.capsule_b]))
    return Capsules(ends[:count], ends[count:], jnp.asarray(arm.capsule_radii, q.dtype))


def control_points(arm: Arm, q: Joints) -> Float[Array, "point 3"]:
    """Centres of the control spheres in the world [m]; their radii are `arm.control_radii`.

    The spheres cover the moving capsules from the upper arm outwards to within COVER_MARGIN.

    Args:
        q: joint positions [rad].
    """
    return points_on_links(arm.chain, q, arm.control_links, arm.control_offsets)


def tool_frame(arm: Arm, q: Joints) -> tuple[Matrix3, Vector3]:
    """Axes R and origin p [m] of the tool in the world: R v + p takes a point of the tool to the world.

    Args:
        q: joint positions [rad].
    """
    R, p = link_frames(arm.chain, q)
    R, p = R[arm.tool_link], p[arm.tool_link]
    offset = jnp.asarray(arm.tool_offset, q.dtype)
    point = p + jnp.sum(R * offset, axis=1)
    return R if np.array_equal(arm.tool_axes, np.eye(3)) else R @ jnp.asarray(arm.tool_axes, q.dtype), point
