"""The default parts of a cell: the two papers' planner, field, policy and monitor."""

import jax
import jax.numpy as jnp

from hrcjax.field import FieldParams, fit, lower_bound, union_distance_and_gradient
from hrcjax.plan import PathResult, PlanParams, PlanSizes, plan
from hrcjax.policy import JointLimits, PolicyParams, policy_acceleration
from hrcjax.safety import (
    SafetyDecision,
    SafetyParams,
    ZoneState,
    effective_mass,
    initial_zone,
    monitor,
    pfl_speeds,
)
from hrcjax.sim.parts import (
    ArmMotion,
    Clearance,
    FieldPart,
    Fields,
    Goal,
    PlanFn,
    Reading,
    SafetyPart,
    Separation,
    Task,
)
from hrcjax.sim.sensing import Frames
from hrcjax.typing import Joints, Vector3


def potential_planner(sizes: PlanSizes | None = None) -> PlanFn:
    """The improved artificial potential field with the bending-energy optimiser (Robotica 2025, section 2.3).

    Args:
        sizes: number of steps, waypoints and iterations.
    """
    chosen = PlanSizes() if sizes is None else sizes

    def potential_plan(params: PlanParams, task: Task) -> PathResult:
        scene = task.scene
        return plan(
            params, scene.start, scene.goal, task.distances, scene.radius, scene.lower, scene.upper, chosen
        )  # fmt: skip

    return potential_plan


def fit_fields(params: FieldParams, frames: Frames) -> Fields:
    """Gaussian-process distance fields of the static scene and of every frame's moving points (HRI 2025).

    Depends only on the field's parameters, so that settings with the same ones share the fields.
    """
    moving = jax.lax.map(jax.checkpoint(lambda cloud: fit(cloud, params)), frames.moving)
    return Fields(static=fit(frames.static, params), moving=moving)


def read_fields(params: FieldParams, fields: Fields, x: Vector3) -> Reading:
    """Distances from one exponential per point of the clouds; the person's is corrected for the bias of convex bodies."""
    d_all, g_all, d_person, g_person = union_distance_and_gradient(fields.static, fields.moving, x)
    return Reading(d_all, g_all, lower_bound(d_person, params.person_radius, params.length_scale), g_person)


def rmp_policy(
    params: PolicyParams, arm: ArmMotion, goal: Goal, clearance: Clearance, limits: JointLimits
) -> Joints:  # fmt: skip
    """All Riemannian motion policies, pulled back to the joints and resolved (HRI 2025)."""
    return policy_acceleration(
        params, arm.q, arm.qd, arm.tool, goal.x, goal.xd, goal.xdd, arm.body, clearance.distance, clearance.gradient,
        limits, goal.posture,
    )  # fmt: skip


def separation_monitor(
    params: SafetyParams, state: ZoneState, separation: Separation
) -> tuple[ZoneState, SafetyDecision]:
    """Zones, speed and separation; in red also the contact speed of the most sensitive body region (ISO/TS 15066)."""
    d = separation.distance
    slowest_contact = jnp.min(pfl_speeds(1.0 / effective_mass(params.pfl))).astype(d.dtype)
    return monitor(
        params, state, d, separation.approach, separation.age, separation.dt, valid=separation.valid, pfl_speed=slowest_contact
    )  # fmt: skip


POTENTIAL_PLANNER = potential_planner()
GP_FIELD = FieldPart(fit_fields, read_fields, unit_gradients=False)  # its gradient is used as it is
SEPARATION_MONITOR = SafetyPart(initial_zone, separation_monitor, lambda params: params.ssm)
