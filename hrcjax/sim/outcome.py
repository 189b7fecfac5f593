"""The outcome of an episode: metrics against the ground truth, and downsampled traces."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.metrics import EpisodeMetrics, Run, Yardstick, arrival, episode_metrics, ideal_time
from hrcjax.numerics import safe_norm
from hrcjax.robot import arm_capsules
from hrcjax.safety import assumed_human_speed, safe_distance, separation_distance
from hrcjax.sim.cell import Cell, World
from hrcjax.sim.episode import Episode
from hrcjax.sim.exact import (
    least_clearance,
    least_separations,
    moving_links,
    sampled_obstacle_distances,
    sampled_person_distances,
    separation_and_approach,
    thinned,
)
from hrcjax.sim.params import Params
from hrcjax.typing import Array, Bool, Float, Int
from hrcjax.world import person_at

REACHED = 0.02
"""Distance of the tool to the goal that counts as reached [m]."""
MOVING = 0.01
"""Speed of any joint above which the arm counts as moving [rad/s]."""
AFTER = 1.0
"""Time after the arrival at which the episode ends: what happens later does not count [s]."""


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
    plan_status: Int[Array, ""]
    """What the planner says of its path, bits: 1 the descent of the potential reached the goal, 2 required distances kept,
    4 within the bounds, 8 no link touches another; 14 and 15 are a path without fault [1]."""


class Outcome(eqx.Module):
    """Metrics, traces and status of one setting."""

    metrics: EpisodeMetrics
    traces: Traces
    run_status: Int[Array, ""]
    """Bits of the tick status, combined over all ticks."""
    hit: Bool[Array, ""]
    """Whether arm and person touched at a tick in which the arm moved."""
    run_into: Bool[Array, ""]
    """Whether they touched at a tick in which the arm stood: the person ran into it."""
    no_plan: Bool[Array, ""]
    """Whether the planner found no path: its best one touches an obstacle, which was not asked for."""


def counted(cell: Cell, world: World, tool: Float[Array, "time 3"]) -> Bool[Array, "time"]:
    """Ticks of the episode, which ends `AFTER` the arrival; all where the tool does not arrive."""
    at = arrival(tool, world.scene.goal, REACHED, jnp.asarray(cell.dt, tool.dtype))
    last = jnp.sum(at.before, dtype=jnp.int32) - 1 + round(AFTER / cell.dt)
    return (jnp.arange(tool.shape[0], dtype=jnp.int32) <= last) | ~at.success


def outcome(params: Params, cell: Cell, world: World, run: Episode) -> Outcome:
    """The metrics of an episode, against the ground truth of the world."""
    record, k = run.record, cell.metric_stride
    dtype = record.q.dtype
    times = jnp.asarray(cell.times, dtype)
    arm = jax.vmap(lambda q: arm_capsules(cell.arm, q))(record.q)
    person = jax.vmap(lambda t: person_at(world.person, t))(times)
    seldom = thinned(person, k)
    to_person = sampled_person_distances(*jax.lax.stop_gradient((thinned(arm, k), seldom)))
    separation, approach = jax.vmap(lambda *at: separation_and_approach(cell, *at))(
        record.q[::k], record.qd[::k], seldom, to_person
    )
    links = moving_links(cell, arm)
    to_obstacles = sampled_obstacle_distances(world.scene, thinned(links, k))
    obstacles = jnp.min(to_obstacles, axis=1)
    clearance = jnp.min(obstacles, axis=1)
    closing = -jnp.asarray(jnp.gradient(separation, k * cell.dt))
    tool_speed = safe_norm(jnp.asarray(jnp.gradient(record.tool, cell.dt, axis=0)))
    ssm = cell.safety.yardstick(params.safety)
    protective = jax.vmap(lambda v, d: separation_distance(ssm, v, assumed_human_speed(ssm, d)))(approach, separation)

    counts = counted(cell, world, record.tool)
    moving = jnp.max(jnp.abs(record.qd), axis=1) > MOVING
    least, hit, run_into = least_separations(arm, person, to_person, k, counts, moving)
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
        least_separation=least,
        least_clearance=least_clearance(world.scene, links, to_obstacles, k, counts),
        touched=hit | run_into,
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
        plan_status=run.path.status,
    )
    any_tick = jax.lax.reduce(record.status, jnp.zeros((), jnp.int32), jax.lax.bitwise_or, (0,))
    no_plan = (run.path.clearance < 0) & ~run.path.clear & (cell.motion != "reactive")
    return Outcome(metrics, traces, any_tick, hit, run_into, no_plan)
