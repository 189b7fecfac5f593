"""Every number of the method as one pytree: what is swept, and what is tuned by gradient."""

from typing import Any

import equinox as eqx

from hrcjax.field import FieldParams
from hrcjax.plan import PlanParams
from hrcjax.policy import CollisionParams, PolicyParams, TargetParams
from hrcjax.safety import ClockParams, SafetyParams


class MotionParams(eqx.Module):
    """How the arm follows its path and how its joint servo works."""

    speed: float = 0.25
    """Speed of the reference along the path when nobody is near: the reduced speed of ISO 10218-1 [m/s]."""
    lag: float = 0.05
    """Distance of the tool from its reference at which the path clock runs at 1/e of its speed [m]."""
    servo_gain: float = 40.0
    """Velocity feedback of the joint servo [1/s]."""
    clock: ClockParams = eqx.field(default_factory=ClockParams)
    """Path clock: how fast the reference speeds up and brakes."""


def following_policy() -> PolicyParams:
    """The policy's defaults in this cell, where they depart from the human-robot system's own.

    There a distant goal is approached at leisure, and control spheres are up to 0.12 m; here a moving reference is
    followed to about a centimetre, and spheres fit the links, so that the push may begin nearer.
    """
    return PolicyParams(
        target=TargetParams(kp=2.0, kd=4.0, eps=0.02, metric_max=10.0),
        collision=CollisionParams(r_act=0.15, s_rep=0.05),
    )


class Params(eqx.Module):
    """All numeric parameters by dotted name, for example `plan.potential.k_att`. Each leaf can be swept.

    The first four are whatever pytree of floats the cell's own part takes (`hrcjax.sim.parts`).
    """

    plan: Any = eqx.field(default_factory=PlanParams)
    """Of the planner; by default potential field and path optimiser."""
    field: Any = eqx.field(default_factory=FieldParams)
    """Of the field that the arm reads; by default the Gaussian-process distance field."""
    policy: Any = eqx.field(default_factory=following_policy)
    """Of the motion policy; by default Riemannian motion policies."""
    safety: Any = eqx.field(default_factory=SafetyParams)
    """Of the safety monitor; by default speed and separation, zones."""
    motion: MotionParams = eqx.field(default_factory=MotionParams)
    """Path following and joint servo."""
