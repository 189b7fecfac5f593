"""What of a recording does not belong into its map: what is outside of a box, and the robot."""

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
"""Frames of a UR's base: that of its controller, in which x points backwards, and that of ROS, turned by 180 degrees about z."""


class Box(NamedTuple):
    """An upright box."""

    lower: Vector3
    """Its least corner [m]."""
    upper: Vector3
    """Its greatest corner [m]."""


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What is taken out of frames before they come into the map."""

    box: Box | None = None
    """What is outside of it is not taken in; None: everything is."""
    arm: Arm | None = None
    """The robot, whose base stands at the world's origin; None: it is not in the picture."""
    joints: JointRecord | None = None
    """Of the robot, over time."""
    base: str = BASES[0]
    """Which frame of the robot's base is the world's: one of BASES."""

    @property
    def named(self) -> bool:
        """Whether the file of joints names them."""
        return self.joints is not None and self.joints.named

    def with_base(self, base: str) -> "LeftOut":
        """The same with another base."""
        return replace(self, base=base)

    def body_at(self, q: Joints | None) -> Capsules | None:
        """The robot in the world; None: it is not in the picture.

        Args:
            q: joints [rad]; None: there is no robot.
        """
        if q is None or self.arm is None:
            return None
        body = arm_capsules(self.arm, q)
        if self.base == BASES[0]:
            return body
        half_turn = jnp.asarray([-1.0, -1.0, 1.0], q.dtype)  # about z
        return Capsules(body.a * half_turn, body.b * half_turn, body.radius)

    def q_at(self, stamp: float) -> Joints | None:
        """Joints at a moment [rad], None if there is no robot; not finite where they are not known, so that the frame is
        refused."""
        if self.joints is None:
            return None
        q = self.joints.at(stamp)
        return jnp.asarray(np.full(self.joints.q.shape[1], np.nan) if q is None else q, jnp.float32)


def left_out_of(config: MapConfig) -> LeftOut:
    """What the options leave out.

    Raises:
        UsageError: no box, no such arm, no file of joints.
    """
    box = None
    if config.crop is not None:
        lower, upper = np.asarray(config.crop[:3]), np.asarray(config.crop[3:])
        if not (np.isfinite(config.crop).all() and (lower < upper).all()):
            raise UsageError(
                f"--crop {' '.join(f'{v:g}' for v in config.crop)}: accepted are x y z of the least corner and x y z of the "
                "greatest one, each greater [m]"
            )
        box = Box(jnp.asarray(lower, jnp.float32), jnp.asarray(upper, jnp.float32))
    if config.joints is None:
        for name in ("arm", "arm_base"):
            if getattr(config, name) != getattr(MapConfig, name):
                raise UsageError(f"--{name.replace('_', '-')} {getattr(config, name)}: give --joints FILE with it")
        return LeftOut(box)
    try:
        arm = load_arm(config.arm)
    except ValueError as error:
        raise UsageError(f"--arm: {one_line(error)}") from error
    return LeftOut(box, arm, read_joints(config.joints, arm.q_max), config.arm_base)


def check_overlap(box: Box | None, layout: MapLayout) -> None:
    """Refuses a box of which no part is mapped.

    Raises:
        UsageError: such a box.
    """
    if box is None:
        return
    lower = np.asarray(layout.lower)
    upper = lower + layout.edge_of(0) * np.asarray(layout.shape)
    if not ((np.asarray(box.lower) < upper) & (np.asarray(box.upper) > lower)).all():
        least, greatest = (" ".join(f"{v:.2f}" for v in corner) for corner in (lower, upper))
        raise UsageError(f"--crop: nothing of it is in the mapped box; accepted is a part of {least} to {greatest} [m]")
