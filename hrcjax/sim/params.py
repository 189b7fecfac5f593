"""All parameters of the method as one pytree, for sweeps and for tuning by gradient."""

from typing import Any

import equinox as eqx

from hrcjax.field import FieldParams
from hrcjax.plan import ArmPathParams, PotentialParams
from hrcjax.policy import CollisionParams, PolicyParams, TargetParams
from hrcjax.safety import ClockParams, SafetyParams, SsmParams


class MotionParams(eqx.Module):
    """Parameters of path following and joint servo."""

    speed: float = 1.0
    """Largest speed of the reference along the path; near people the zones slow it [m/s]."""
    lag: float = 0.05
    """Distance of the tool from its reference at which the path clock runs at 1/e of its speed, where the geometry is fixed [m]."""
    leash: float = 0.25
    """The same where policies may leave the path: the reference may lead the tool past somebody in the way [m]."""
    track_kp: float = 400.0
    """Feedback of the joints' positions, where the geometry is fixed [1/s^2]."""
    track_kd: float = 40.0
    """Feedback of their speeds there [1/s]."""
    servo_gain: float = 40.0
    """Velocity feedback of the joint servo [1/s]."""
    surface_brake: float = 3.0
    """Deceleration with which the arm can stop before a surface, where policies may leave the path [m/s^2]."""
    surface_margin: float = 0.0
    """Distance to surfaces at which it stands then [m]."""
    clock: ClockParams = eqx.field(default_factory=ClockParams)
    """Path clock: acceleration and braking of the reference."""


def following_policy() -> PolicyParams:
    """The policy's defaults in this cell, where they differ from those of the HRI paper's system.

    There a distant goal is approached slowly, and control spheres are up to 0.12 m. Here a moving reference is tracked to some
    millimetres, stiff and critically damped: kp / eps = (kd / 2)^2. The spheres fit the links, so that the collision leaf may begin
    nearer.
    """
    return PolicyParams(
        target=TargetParams(kp=10.0, kd=20.0, eps=0.1, ramp=1000.0, metric_max=3.0),
        collision=CollisionParams(k_rep=6.0, weight=6.0, r_act=0.15, s_rep=0.04),
    )


def sensed_safety() -> SafetyParams:
    """The safety layer's defaults in this cell, where they differ: the sensed distance is a lower bound that holds the
    uncertainty of the person's position already, so that Z_d adds nothing to it. Data older than the reaction time are used
    for a while, less the way of a person since then: one camera of 15 Hz alone delivers every 67 ms.
    """
    return SafetyParams(ssm=SsmParams(Z_d=0.0), max_age=0.15)


class Params(eqx.Module):
    """All numeric parameters by dotted name, for example `potential.k_att`. Each leaf can be swept.

    `plan`, `field`, `policy` and `safety` are the parameters of the cell's parts (`hrcjax.sim.parts`), any pytrees of floats.
    """

    potential: PotentialParams = eqx.field(default_factory=PotentialParams)
    """Potential field, which planner, path clock and motion policy share."""
    plan: Any = eqx.field(default_factory=ArmPathParams)
    """Planner; by default the path optimiser of the whole arm."""
    field: Any = eqx.field(default_factory=FieldParams)
    """Distance field; by default the Gaussian-process distance field."""
    policy: Any = eqx.field(default_factory=following_policy)
    """Motion policy; by default Riemannian motion policies."""
    safety: Any = eqx.field(default_factory=sensed_safety)
    """Safety monitor; by default speed and separation monitoring with zones."""
    motion: MotionParams = eqx.field(default_factory=MotionParams)
    """Path following and joint servo."""
