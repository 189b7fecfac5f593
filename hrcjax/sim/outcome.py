"""The outcome of an episode: metrics against the ground truth, and downsampled traces."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.geom.segment import FAR, capsule_distance
from hrcjax.metrics import EpisodeMetrics, Run, Yardstick, episode_metrics, ideal_time
from hrcjax.numerics import safe_norm
from hrcjax.robot import arm_capsules
from hrcjax.safety import assumed_human_speed, safe_distance, separation_distance
from hrcjax.sim.cell import Cell, World
from hrcjax.sim.episode import Episode
from hrcjax.sim.params import Params
from hrcjax.typing import Array, Bool, Float, Int, Joints, Scalar
from hrcjax.world import capsules_obstacle_distances, person_at

REACHED = 0.02
"""Distance of the tool to the goal that counts as reached [m]."""
MOVING = 0.05
"""Joint speed above which the arm counts as moving [rad/s]."""


class Traces(eqx.Module):
    """Downsampled arrays over time, and the plan. A sweep stores them under these names, with these docstrings and units."""

    plan: Float[Array, "waypoint 3"]
    """Planned tool path [m]."""
    tool: Float[Array, "time 3"]
    """Position of the tool [m]."""
    separation_t: Float[Array, "time"]
    """Exact distance of the arm to the person [m]."""
    clearance_t: Float[Array, "time"]
    """Exact distance of the arm to the obstacles [m]."""
    speed: Float[Array, "time"]
    """Speed of the tool [m/s]."""
    speed_limit: Float[Array, "time"]
    """Speed towards the person that the safety monitor allowed [m/s]."""
    zone: Int[Array, "time"]
    """0 green, 1 yellow, 2 red, 3 stop [1]."""
    path_status: Int[Array, ""]
    """Bits: 1 the descent of the potential reached the goal, 2 required distances kept, 4 within the bounds [1]."""


class Outcome(eqx.Module):
    """Metrics, traces and status of one setting."""

    metrics: EpisodeMetrics
    traces: Traces
    run_status: Int[Array, ""]
    """Bits of the tick status, combined over all ticks."""
    hit: Bool[Array, ""]
    """Whether arm and person touched while the arm moved; a played-back person may also run into a stationary arm."""


def true_distances(cell: Cell, world: World, q: Joints, t: Scalar) -> tuple[Array, Array]:
    """Exact distances of the whole arm to the person, and to every obstacle [m]; FAR where there is none."""
    arm = arm_capsules(cell.arm, q)
    person = person_at(world.person, t)
    between = jax.vmap(jax.vmap(capsule_distance, (None, None, None, 0, 0, 0)), (0, 0, 0, None, None, None))
    to_person = between(arm.a, arm.b, arm.radius, person.a, person.b, person.radius)
    to_person = jnp.where(person.radius[None, :] < 0, FAR, to_person)
    fixed = sum(link < 0 for link in cell.arm.capsule_links)  # the base comes first
    moving = Capsules(*(x[fixed:] for x in (arm.a, arm.b, arm.radius)))
    return jnp.min(to_person), jnp.min(capsules_obstacle_distances(world.scene, moving), axis=0)


def outcome(params: Params, cell: Cell, world: World, run: Episode) -> Outcome:
    """The metrics of an episode, against the ground truth of the world."""
    record, k = run.record, cell.metric_stride
    dtype = record.q.dtype
    times = jnp.asarray(cell.times[::k], dtype)
    separation, obstacles = jax.vmap(lambda q, t: true_distances(cell, world, q, t))(record.q[::k], times)
    clearance = jnp.min(obstacles, axis=1)
    closing = -jnp.asarray(jnp.gradient(separation, k * cell.dt))
    tool_speed = safe_norm(jnp.asarray(jnp.gradient(record.tool, cell.dt, axis=0)))
    ssm = cell.safety.yardstick(params.safety)
    protective = jax.vmap(lambda v, d: separation_distance(ssm, v, assumed_human_speed(ssm, d)))(
        record.approach[::k], separation
    )
    ideal = ideal_time(run.path.length, params.motion.speed, params.motion.clock.acceleration)
    measured = Run(
        dt=cell.dt,
        tool=record.tool,
        q=record.q,
        qd=record.qd,
        qdd=record.qdd,
        tau=record.tau,
        zone=record.zone,
        separation=separation,
        closing_speed=closing,
        obstacle_distances=jnp.where(world.scene.mask, obstacles, 0.0),
        clearance=clearance,
        protective_distance=protective,
        plan_length=run.path.length,
        plan_bending_energy=run.path.bending_energy,
    )
    yardstick = Yardstick(
        goal=world.scene.goal,
        tolerance=REACHED,
        ideal_time=ideal,
        unsafe_distance=safe_distance(ssm, 0.0),
        smoothness_stride=k,
    )
    metrics = episode_metrics(measured, yardstick)
    traces = Traces(
        plan=run.path.waypoints,
        tool=record.tool[::k],
        separation_t=separation,
        clearance_t=clearance,
        speed=tool_speed[::k],
        speed_limit=record.speed_limit[::k],
        zone=record.zone[::k].astype(jnp.int8),
        path_status=run.path.status,
    )
    any_tick = jax.lax.reduce(record.status, jnp.zeros((), jnp.int32), jax.lax.bitwise_or, (0,))
    moving = jnp.max(jnp.abs(record.qd[::k]), axis=1) > MOVING
    return Outcome(metrics, traces, any_tick, jnp.any(moving & (separation < 0)))
