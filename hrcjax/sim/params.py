"""Every number of the method as one pytree: what is swept, and what is tuned by gradient."""

import equinox as eqx

from hrcjax.field import FieldParams
from hrcjax.plan import PlanParams
from hrcjax.policy import CollisionParams, PolicyParams, TargetParams
from hrcjax.safety import SafetyParams


class MotionParams(eqx.Module):
    """How the arm follows its path and how its joint servo works."""

    speed: float = 0.25
    """Speed of the reference along the path when nobody is near: the reduced speed of ISO 10218-1 [m/s]."""
    lag: float = 0.05
    """Distance of the tool from its reference at which the path clock runs at 1/e of its speed [m]."""
    servo_gain: float = 40.0
    """Velocity feedback of the joint servo [1/s]."""
    person_radius: float = 0.05
    """Smallest radius of a limb that the separation must not over-estimate (convex-body bias of the field) [m]."""


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
    """All numeric parameters by dotted name, for example `plan.potential.k_att`. Each leaf can be swept."""

    plan: PlanParams = eqx.field(default_factory=PlanParams)
    """Potential field and path optimiser."""
    field: FieldParams = eqx.field(default_factory=FieldParams)
    """Gaussian-process distance field."""
    policy: PolicyParams = eqx.field(default_factory=following_policy)
    """Riemannian motion policies."""
    safety: SafetyParams = eqx.field(default_factory=SafetyParams)
    """Speed and separation, zones, path clock."""
    motion: MotionParams = eqx.field(default_factory=MotionParams)
    """Path following and joint servo."""
