"""An episode: plan once, then a scan of control ticks. A pure function of (params, world)."""

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.field import FieldParams, GPField, fit
from hrcjax.plan import PathCurve, PathResult, path_curve, plan
from hrcjax.robot import tool_frame
from hrcjax.sim.cell import Cell, Fields, World, newest_frame
from hrcjax.sim.params import Params
from hrcjax.sim.sensing import Frames
from hrcjax.sim.tick import Record, Sensed, TickState, initial_state, tick
from hrcjax.typing import Array, Joints
from hrcjax.world import obstacle_distances


class Episode(eqx.Module):
    """What came of one run."""

    path: PathResult
    """The plan."""
    record: Record
    """Every tick."""
    final: TickState
    """The state after the last tick."""


def fit_fields(params: FieldParams, frames: Frames) -> Fields:
    """Distance fields of the static scene and of every frame's moving points.

    Depends on the field's parameters alone, so that settings which share these share the fields.
    """
    moving = jax.lax.map(jax.checkpoint(lambda cloud: fit(cloud, params)), frames.moving)
    return Fields(static=fit(frames.static, params), moving=moving)


def plan_path(params: Params, cell: Cell, world: World) -> PathResult:
    """The tool's path through the scene's obstacles (the task-space map, taken as known)."""
    scene = world.scene
    return plan(
        params.plan,
        scene.start,
        scene.goal,
        lambda x: obstacle_distances(scene, x),
        scene.radius,
        scene.lower,
        scene.upper,
        cell.sizes,
    )


def episode(params: Params, cell: Cell, world: World, fields: Fields) -> Episode:
    """Plan a path and follow it beside the person for `cell.ticks` control periods.

    Reverse mode keeps one state per tick and computes each tick again (`jax.checkpoint`), so memory grows by the size of
    `TickState` alone.

    Args:
        fields: of `fit_fields(params.field, world.frames)`; apart, so that a batch can share them.
    """
    path = plan_path(params, cell, world)
    final, record = follow(params, cell, path_curve(path.waypoints), world.frames, world.q_start, fields)
    return Episode(path, record, final)


def follow(
    params: Params, cell: Cell, curve: PathCurve, frames: Frames, q_start: Joints, fields: Fields
) -> tuple[TickState, Record]:
    """Follow a path for `cell.ticks` control periods: the state after the last tick, and every tick.

    Args:
        curve: the tool's path.
        frames: stamps and validity of what the camera delivered.
        q_start: joint positions at the start, and the posture to draw to [rad].
        fields: fitted to the points of the frames.
    """
    R_goal, _ = tool_frame(cell.arm, q_start)
    exposed = jnp.asarray(cell.times - cell.latency, q_start.dtype)
    index, age = newest_frame(frames.stamp, frames.valid, exposed)

    lost = frames.overflow | frames.static_overflow
    # What each tick sees is gathered before the scan: within it, the derivative would touch all frames at every tick.
    seen = (jax.tree.map(lambda a: a[index], fields.moving), age + cell.latency, ~lost[index])

    def one(state: TickState, seen: tuple[GPField, Array, Array]) -> tuple[TickState, Record]:
        return tick(params, cell, curve, R_goal, q_start, Sensed(fields.static, *seen), state)

    return jax.lax.scan(jax.checkpoint(one), initial_state(q_start), seen)
