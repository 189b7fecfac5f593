"""What is excluded from a map: points outside of a crop box, and the robot's body."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from hrcjax.geom.capsules import Capsules
from hrcjax.io.recordings.joints import JointRecord, read_joints
from hrcjax.lab.errors import UsageError, one_line
from hrcjax.map import MapLayout
from hrcjax.robot import Arm, arm_capsules, load_arm
from hrcjax.typing import Joints, Vector3

from .config import MapConfig

BASES = ("base", "base_link")
"""Base frames of a UR arm: that of its controller, in which x points backwards, and that of ROS, rotated by 180 degrees about z."""


class Box(NamedTuple):
    """An axis-aligned box."""

    lower: Vector3
    """Minimum corner [m]."""
    upper: Vector3
    """Maximum corner [m]."""


@dataclass(frozen=True, eq=False)
class Exclusions:
    """Crop box and robot: what is excluded from the frames before they are fused."""

    box: Box | None = None
    """Crop box: points outside are not added to the map; None: no crop."""
    arm: Arm | None = None
    """The robot, with its base at the world's origin; None: no robot in view."""
    joints: JointRecord | None = None
    """Joint positions of the robot over time."""
    base: str = BASES[0]
    """Base frame that coincides with the world: one of BASES."""

    @property
    def named(self) -> bool:
        """Whether the joint file names its columns."""
        return self.joints is not None and self.joints.named

    def with_base(self, base: str) -> "Exclusions":
        """The same with another base frame."""
        return replace(self, base=base)

    def body_at(self, q: Joints | None) -> Capsules | None:
        """The robot's capsules in the world; None: no robot.

        Args:
            q: joint positions [rad]; None: no robot.
        """
        if q is None or self.arm is None:
            return None
        body = arm_capsules(self.arm, q)
        if self.base == BASES[0]:
            return body
        half_turn = jnp.asarray([-1.0, -1.0, 1.0], q.dtype)  # about z
        return Capsules(body.a * half_turn, body.b * half_turn, body.radius)

    def q_at(self, stamp: float) -> Joints | None:
        """Joint positions at a time [rad]; None: no robot. NaN where they are not known, so that the frame is refused."""
        if self.joints is None:
            return None
        q = self.joints.at(stamp)
        return jnp.asarray(np.full(self.joints.q.shape[1], np.nan) if q is None else q, jnp.float32)


def exclusions_of(config: MapConfig) -> Exclusions:
    """Crop box and robot of the options.

    Raises:
        UsageError: an empty box, an unknown arm, an invalid joint file.
    """
    box = None
    if config.crop is not None:
        lower, upper = np.asarray(config.crop[:3]), np.asarray(config.crop[3:])
        if not (np.isfinite(config.crop).all() and (lower < upper).all()):
            raise UsageError(
                f"--crop {' '.join(f'{v:g}' for v in config.crop)}: accepted are x y z of the minimum corner and x y z of the "
                "maximum corner, each greater [m]"
            )
        box = Box(jnp.asarray(lower, jnp.float32), jnp.asarray(upper, jnp.float32))
    if config.joints is None:
        for name in ("arm", "arm_base"):
            if getattr(config, name) != getattr(MapConfig, name):
                raise UsageError(f"--{name.replace('_', '-')} {getattr(config, name)}: give --joints FILE with it")
        return Exclusions(box)
    try:
        arm = load_arm(config.arm)
    except ValueError as error:
        raise UsageError(f"--arm: {one_line(error)}") from error
    return Exclusions(box, arm, read_joints(config.joints, arm.q_max), config.arm_base)


def check_overlap(box: Box | None, layout: MapLayout) -> None:
    """Refuses a crop box outside of the mapped box.

    Raises:
        UsageError: such a box.
    """
    if box is None:
        return
    lower = np.asarray(layout.lower)
    upper = lower + layout.edge_of(0) * np.asarray(layout.shape)
    if not ((np.asarray(box.lower) < upper) & (np.asarray(box.upper) > lower)).all():
        least, greatest = (" ".join(f"{v:.2f}" for v in corner) for corner in (lower, upper))
        raise UsageError(
            f"--crop: outside of the mapped box; accepted is a box that overlaps {least} to {greatest} [m]"
        )
