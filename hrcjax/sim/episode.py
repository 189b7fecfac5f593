"""An episode: plan once, then a scan of control ticks. A pure function of (params, world)."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.numerics import CHOICE
from hrcjax.plan import PathResult
from hrcjax.sim.cell import Cell, World, newest_frame
from hrcjax.sim.params import Params
from hrcjax.sim.parts import Fields, Task
from hrcjax.sim.route import Route, make_route
from hrcjax.sim.sensing import Frames
from hrcjax.sim.tick import Record, Sensed, TickState, initial_state, tick
from hrcjax.typing import Array, Bool, Int, Joints
from hrcjax.world import first_obstacles


class Episode(eqx.Module):
    """Result of an episode."""

    path: PathResult
    """The plan."""
    record: Record
    """Every tick."""
    final: TickState
    """The state after the last tick."""


def task_of(params: Params, cell: Cell, world: World) -> Task:
    """The planning problem of a world: its known obstacles (the task-space map, given, not sensed)."""
    return Task(first_obstacles(world.known, cell.obstacles), world.q_start, params.potential, cell.arm)


def plan_route(params: Params, cell: Cell, task: Task) -> tuple[PathResult, Route]:
    """The plan, and the reference motion of tool and joints along it."""
    path = cell.plan(params.plan, task)
    return path, make_route(cell.arm, task.q_start, path)


def episode(
    params: Params, cell: Cell, world: World, fields: Fields, stop: Bool[Array, "time"] | None = None
) -> Episode:
    """Plan a path and follow it beside the person for `cell.ticks` control periods.

    Reverse mode stores one `TickState` per tick and recomputes each tick (`jax.checkpoint`).

    Args:
        fields: result of `cell.field.fit(params.field, world.frames)`, an argument so that a batch can share it.
        stop: whether a command stops the arm, at every tick; None: commands are not read.
    """
    path, route = plan_route(params, cell, task_of(params, cell, world))
    final, record = follow(params, cell, route, world.frames, world.q_start, fields, stop)
    return Episode(path, record, final)


def pack_cameras(reasons: Int[Array, "*time camera"]) -> Int[Array, "*time"]:
    """The bits of all cameras in one integer, those of camera k times 256^k; of the first three."""
    return sum((reasons[..., k] << (8 * k) for k in range(min(reasons.shape[-1], 3))), jnp.zeros_like(reasons[..., 0]))


def follow(
    params: Params,
    cell: Cell,
    route: Route,
    frames: Frames,
    q_start: Joints,
    fields: Fields,
    stop: Bool[Array, "time"] | None = None,
) -> tuple[TickState, Record]:
    """Follow a path for `cell.ticks` control periods: the state after the last tick, and every tick.

    Args:
        route: the reference motion along the path.
        frames: stamps and validity of the camera's frames.
        q_start: joint positions at the start [rad].
        fields: fitted to the points of the frames.
        stop: whether a command stops the arm, at every tick; None: commands are not read.
    """
    exposed = jnp.asarray(cell.times - cell.latency, q_start.dtype)
    index, age = newest_frame(frames.stamp, frames.valid, exposed)

    rows = {a.shape[:1] for a in jax.tree.leaves(fields.moving)} - {frames.stamp.shape}
    if rows:
        raise ValueError(
            f"Fields.moving has leaves of {rows.pop()} rows; accepted: one per frame, {frames.stamp.shape}"
        )
    known = jnp.broadcast_to(~frames.static_overflow, index.shape)
    # what is wrong with a camera is known as soon as its image is due, though the image itself is not used
    latest, _ = newest_frame(frames.stamp, jnp.ones_like(frames.valid), exposed)
    faults = pack_cameras(frames.reasons[latest])
    guarded = frames.guarded[index] | frames.guarded[latest]
    # The frame of each tick is gathered before the scan: inside, the derivative would touch all frames at every tick.
    body = jax.tree.map(lambda a: a[index], frames.body)
    seen = (jax.tree.map(lambda a: a[index], fields.moving), age + cell.latency, known, guarded, faults, stop, body)

    def one(state: TickState, seen: tuple[Any, ...]) -> tuple[TickState, Record]:
        moving, *rest = seen
        return tick(params, cell, route, Sensed(Fields(fields.static, moving), *rest), state)

    kept = jax.checkpoint_policies.save_only_these_names(CHOICE)
    return jax.lax.scan(jax.checkpoint(one, policy=kept, prevent_cse=False), initial_state(cell, q_start), seen)
