"""The default parts of a cell: the two papers' planner, field, policy and monitor."""

from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.body import PART_REGION
from hrcjax.field import FAR, FieldParams, GPField, GridField, fit, grid_distance_and_gradient
from hrcjax.field.least import log_least_weight, nearest_bound
from hrcjax.field.near import Groups, grouped, groups_of, nearest_others
from hrcjax.field.scene_union import scene_and_people
from hrcjax.geom.cloud import Cloud
from hrcjax.numerics import safe_norm, unit
from hrcjax.plan import (
    ArmPathParams,
    ArmPlanSizes,
    PathParams,
    PathResult,
    PlanBody,
    PlanParams,
    PlanSizes,
    arm_body,
    d_factor,
    plan,
    plan_arm,
)
from hrcjax.policy import JointLimits, PolicyParams, Repel, policy_acceleration
from hrcjax.presence.cloud import COARSE_FROM
from hrcjax.robot import Arm
from hrcjax.safety import (
    Coming,
    SafetyDecision,
    SafetyParams,
    ZoneState,
    effective_mass,
    initial_zone,
    monitor,
    nearest_by_now,
    pfl_speeds,
)
from hrcjax.sim.joints_along import joints_along
from hrcjax.sim.parts import (
    ArmMotion,
    BodyRows,
    Clearance,
    FieldPart,
    Fields,
    Goal,
    PlanFn,
    Reading,
    SafetyPart,
    Separation,
    Task,
    unit_where_long,
)
from hrcjax.sim.sensing import Frames
from hrcjax.typing import Array, Float, Joints, Vector3

PUSH_FADE = 0.05
"""Distance of the goal at which the push of the collision leaf is halved [m]."""
PERSON_FADE = 0.3
"""Distance of the goal at which what stands repels as people do everywhere [m]."""
BODY_INFLATION = 0.01
"""Most that the spheres by which the planner knows the arm stand out of its capsules [m]."""
WAY_TO_GOAL = 12
"""Places on the straight line from start to goal at which the joints follow, to the configuration at the goal."""
SURFACES = 3
"""Surfaces of people that are read at a point: the nearest, and the nearest in other directions or in front of it."""
COARSE_EDGE = 0.1
"""Edge of the cubes that share a point beyond `COARSE_FROM` [m]."""


def potential_planner(sizes: PlanSizes | None = None) -> PlanFn:
    """The improved artificial potential field with the bending-energy optimiser (Robotica 2025, section 2.3), for the tool alone.

    Args:
        sizes: number of steps, waypoints and iterations.
    """
    chosen = PlanSizes() if sizes is None else sizes

    def potential_plan(params: PathParams, task: Task) -> PathResult:
        scene = task.scene
        return plan(
            PlanParams(task.potential, params), scene.start, scene.goal, task.distances, scene.radius, scene.lower,
            scene.upper, chosen,
        )  # fmt: skip

    return potential_plan


@cache
def planned_body(arm: Arm) -> PlanBody:
    """The moving links of an arm above its table."""
    return arm_body(arm, BODY_INFLATION, floor=0.0)


def arm_planner(sizes: ArmPlanSizes | None = None) -> PlanFn:
    """The potential field of the whole arm in its joints, with the optimiser of length, bending energy and repulsion (Robotica
    2025, sections 2.3 and 2.4).

    Args:
        sizes: number of control points, samples, guesses and iterations.
    """
    chosen = ArmPlanSizes() if sizes is None else sizes

    def arm_plan(params: ArmPathParams, task: Task) -> PathResult:
        scene, q_start = task.scene, task.q_start
        line = jnp.linspace(0, 1, WAY_TO_GOAL, dtype=q_start.dtype)[1:, None]
        q_goal = joints_along(task.arm, q_start, scene.start + line * (scene.goal - scene.start))[-1]
        path = plan_arm(
            params, task.potential, planned_body(task.arm), q_start, q_goal, task.distances, scene.radius, scene.lower,
            scene.upper, chosen,
        )  # fmt: skip
        return PathResult(
            path.tool, path.length, path.bending_energy, path.clearance, path.violation, path.reached, path.clear, path.inside,
            path.joints, path.ratio, path.free,
        )  # fmt: skip

    return arm_plan


class Standing(eqx.Module):
    """Fields that do not change."""

    scene: GridField
    """Distance to everything that stands."""
    hidden: GridField | None
    """Distance to space where somebody may be unseen; None: nobody is there."""


class People(eqx.Module):
    """The field of the people in an image, and how far it vouches."""

    field: GPField
    """Gaussian process of the moving points."""
    log_least: Float[Array, "*frame"]
    """Logarithm of its least weight [1]."""
    beyond: Float[Array, "*frame"]
    """Whoever has no point in it is farther from the robot's base than this [m]."""
    groups: Groups
    """Groups of neighbours among its points."""


def fit_fields(params: FieldParams, frames: Frames) -> Fields:
    """The sampled map of the scene, and a Gaussian-process distance field of every image's moving points (HRI 2025).

    Depends only on the field's parameters, so that settings with the same ones share the fields.
    """

    def people(seen: tuple[Cloud, Float[Array, ""]]) -> People:
        cloud, beyond = seen
        cloud = grouped(cloud)
        field = fit(cloud, params)
        return People(field, log_least_weight(field), beyond, groups_of(cloud))

    standing = Standing(frames.scene, frames.hidden)
    return Fields(static=standing, moving=jax.lax.map(jax.checkpoint(people), (frames.moving, frames.beyond)))


def margin_of(params: FieldParams, x: Vector3, offset: Vector3) -> Float[Array, ""]:
    """How far a person may reach beyond the points that answer at x, by their spacing and the camera's noise [m].

    Args:
        offset: from these points to x; which points they are is told by their mean, under the kernel's weights [m].
    """
    away_from_base = safe_norm(x - offset)
    share = jnp.clip((away_from_base - COARSE_FROM) / COARSE_EDGE + 1.0, 0.0, 1.0)
    return jnp.asarray(params.spread + share * (params.far_spread - params.spread) + params.person_noise)


def read_fields(params: FieldParams, fields: Fields, x: Vector3) -> Reading:
    """Distances to everything, to what stands and to people. The latter are lower bounds at the exposure of the image, term by term:

    - the nearest moving point is not nearer than `nearest_bound`: no bias of convex bodies;
    - the person reaches beyond the points by `spread`, or `far_spread` where they are coarse, and by `person_noise` of the depth camera;
    - whoever has no point in the cloud is farther from the base than `People.beyond`;
    - where somebody may be unseen (`Standing.hidden`), that space counts.

    What a person moves after the exposure is in S_p, by its reaction time.

    Surface 0 is the nearest of all this. The others are the nearest points in other directions than the nearer ones, by more than 60
    degrees, or in front of them, as a hand before a trunk; where there are none, FAR away and without direction.
    """
    people: People = fields.moving
    standing: Standing = fields.static
    both = scene_and_people(standing.scene, people.field, x)

    least = nearest_bound(both.people.log_occupancy, people.log_least, people.field.length_scale)
    least = jnp.where(both.people.some, least - margin_of(params, x, both.people.offset), FAR)
    away = jnp.where(both.people.some, unit(both.people.offset), 0.0)
    room = people.beyond - safe_norm(x)
    away = jnp.where(room < least, -unit(x), away)
    plane = jnp.where(room < least, room, FAR)
    least = jnp.minimum(room, least)
    if standing.hidden is not None:
        room, slope = grid_distance_and_gradient(standing.hidden, x)
        away = jnp.where(room < least, unit(slope), away)
        plane = jnp.where(room < least, room, plane)
        least = jnp.minimum(room, least)
    others = nearest_others(people.field, people.groups, x, away, plane, SURFACES - 1)
    distances = [jnp.where(one.some, one.distance - margin_of(params, x, one.offset), FAR) for one in others]
    directions = [unit(one.offset) for one in others]
    return Reading(
        both.distance, both.gradient, jnp.stack([least, *distances]), jnp.stack([away, *directions]),
        both.scene_distance, unit_where_long(both.scene_gradient),
    )  # fmt: skip


def rmp_policy(
    params: PolicyParams, arm: ArmMotion, goal: Goal, clearance: Clearance, limits: JointLimits
) -> Joints:  # fmt: skip
    """All Riemannian motion policies, pulled back to the joints and resolved (HRI 2025), with the potential's repulsion (Robotica
    2025) among them: of what stands it fades at the goal, of people it does not."""
    # what stands may be as near to the goal as the planner found right: its push fades there, its damping does not
    squared = jnp.sum((arm.tool.x[0] - goal.end) ** 2)
    fade = squared / (squared + PUSH_FADE * PUSH_FADE)
    params = eqx.tree_at(lambda p: p.collision.k_rep, params, params.collision.k_rep * fade)
    return policy_acceleration(
        params, arm.q, arm.qd, arm.tool, goal.x, goal.xd, goal.xdd, arm.body, clearance.distance, clearance.gradient,
        limits, goal.posture, repel=repelling(arm, goal, clearance),
    )  # fmt: skip


def repelling(arm: ArmMotion, goal: Goal, clearance: Clearance) -> tuple[Repel, Repel]:
    """What repels the control points: what stands, and people."""
    potential, d = goal.potential, clearance.standing_distance
    every, fade = jnp.ones_like(d), d_factor(potential, arm.tool.x[0], goal.end)
    by_people = jnp.asarray(PERSON_FADE, d.dtype) ** potential.exponent
    return (
        Repel(potential.k_rep, potential.zeta * potential.sensed_radius * every, fade * every, d, clearance.standing_gradient),
        Repel(
            potential.k_rep, potential.zeta * potential.person_radius * every, by_people * every, clearance.person_distance,
            clearance.person_gradient,
        ),
    )  # fmt: skip


def contact_speeds(params: SafetyParams, separation: Separation) -> Float[Array, "*row"]:
    """Contact speed of the most sensitive body region: one by the standard's mass, or of every row by the mass that it feels [m/s].

    Where the body of the person is known, of the regions that may be the nearest of a row by the end of this tick.
    """
    if separation.mobility is None:
        speeds = pfl_speeds(1.0 / effective_mass(params.pfl))
    else:
        speeds = jax.vmap(pfl_speeds)(separation.mobility(params.pfl.payload))
    slowest, body = jnp.min(speeds, axis=-1), separation.body
    if body is None:
        return slowest
    moved = params.ssm.v_h_near * (jnp.clip(separation.age, 0.0, params.max_age) + separation.dt)
    near = body.beyond < jnp.min(body.beyond, axis=1, keepdims=True) + moved
    regions = jnp.where(near, speeds[..., PART_REGION], jnp.inf)
    return jnp.where(body.counts, jnp.min(regions, axis=-1), slowest)


def coming_of(params: SafetyParams, body: BodyRows) -> Coming:
    """How the parts of a body come: as measured, faster by what they may gain within the reaction time, not over what is assumed."""
    ssm = params.ssm
    v_h = jnp.clip(body.v_h + jnp.asarray(body.gain) * ssm.reaction_time, 0.0, ssm.v_h_near)
    return Coming(v_h, body.beyond, body.gain, body.counts)


def separation_monitor(
    params: SafetyParams, state: ZoneState, separation: Separation
) -> tuple[ZoneState, SafetyDecision]:
    """Zones, speed and separation; in red also the contact speed of the most sensitive body region (ISO/TS 15066)."""
    # S_p counts on data as old as the reaction time; what a person may move until older ones are used is taken off
    older = jnp.clip(separation.age + separation.dt - params.ssm.reaction_time, 0.0, params.max_age)
    d = separation.distance
    if separation.body is not None:  # never above the field's bound
        d = jnp.minimum(d, separation.body.distance)
    d = d - params.ssm.v_h_near * older
    by_now = d
    if separation.nearest is not None:
        nearest = separation.nearest - params.ssm.v_h_near * older
        by_now = nearest_by_now(params, d, nearest, separation.age, separation.dt)
    coming, head = None, None
    if separation.body is not None:
        coming, head = coming_of(params, separation.body), separation.body.head_distance
    slowest_contact = contact_speeds(params, separation).astype(d.dtype)
    return monitor(
        params, state, d, separation.approach, separation.age, separation.dt, valid=separation.valid, pfl_speed=slowest_contact,
        guarded=separation.guarded, by_now=by_now, head_distance=head, coming=coming,
    )  # fmt: skip


ARM_PLANNER = arm_planner()
GP_FIELD = FieldPart(fit_fields, read_fields)
SEPARATION_MONITOR = SafetyPart(initial_zone, separation_monitor, lambda params: params.ssm)
