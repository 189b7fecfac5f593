"""Poses of the tool as goals of the motion policy."""

import jax.numpy as jnp

from hrcjax.interact.reference import Reference
from hrcjax.numerics import unit
from hrcjax.plan import PotentialParams
from hrcjax.policy import MovingFrame, riding
from hrcjax.sim.cell import TOOL_REACH
from hrcjax.sim.parts import Goal
from hrcjax.typing import Joints, Matrix3, Vector3


def goal_at(frame: MovingFrame, posture: Joints, potential: PotentialParams) -> Goal:
    """The goal of a tool that rides on a frame: tool point at its origin, tool axes along its axes.

    Args:
        posture: preferred joint positions [rad].
        potential: whose repulsion the policy has.
    """
    reach = jnp.asarray(TOOL_REACH, frame.p.dtype)
    offsets = reach * jnp.concatenate([jnp.zeros((1, 3), frame.p.dtype), jnp.eye(3, dtype=frame.p.dtype)[:2]])
    return Goal(*riding(frame, offsets), posture=posture, end=frame.p, potential=potential)


def frame_of(reference: Reference, R: Matrix3) -> MovingFrame:
    """The frame of a led point, without rotation."""
    still = jnp.zeros_like(reference.x)
    return MovingFrame(R, reference.x, reference.v, still, reference.a, still)


def pointing(z: Vector3, x: Vector3) -> Matrix3:
    """Axes of a tool that points along z, with its own x axis as near to a given direction as can be.

    Args:
        z: unit vector out of the tool [1].
        x: not along z [1].
    """
    across = unit(jnp.cross(z, x))
    return jnp.stack([jnp.cross(across, z), across, z], axis=1)
