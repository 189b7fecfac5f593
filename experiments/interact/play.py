"""One sensed episode of a function: images of the arm where it is, the hand from their points, the goal, the tick with its safety layer."""

from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.interact import (
    FollowParams,
    GiveWayParams,
    HandOverParams,
    InteractPolicyParams,
    KeepAwayParams,
    Seen,
    Tool,
    follow,
    frame_of,
    give_way,
    goal_at,
    hand_over,
    in_refuge,
    keep_away,
    kept_from,
    not_following,
    not_handing_over,
    not_keeping_away,
    pointing,
    turn_between,
    turned_frame,
)
from hrcjax.policy import MovingFrame
from hrcjax.presence.cloud import were_measured
from hrcjax.robot import tool_frame
from hrcjax.sim import Cell, Params
from hrcjax.sim.own_sensing import first_looks, images_in_use, look_if_due, ticks_of
from hrcjax.sim.prepare import Surveyed
from hrcjax.sim.survey import SenseParams
from hrcjax.sim.tick import Record, Sensed, control_motion, initial_state, tick
from hrcjax.typing import Array, Bool, Float, Matrix3, PRNGKeyArray, Vector3

FUNCTIONS = ("keep_away", "follow", "hand_over", "give_way")
"""The functions."""


class Setting(eqx.Module):
    """What a function is told: numbers, places, whether it is on."""

    keep_away: KeepAwayParams
    follow: FollowParams
    hand_over: HandOverParams
    give_way: GiveWayParams
    home: Vector3
    """Where the tool waits: the start, and the refuge [m]."""
    pose: Vector3
    """What the tool holds where it keeps away [m]."""
    direction: Vector3
    """From the hand to the tool [1]."""
    ends: tuple[Vector3, Vector3]
    """Of the task that is interrupted [m]."""
    on: Bool[Array, ""]
    """False: the function is switched off."""


class Played(NamedTuple):
    """An episode, tick by tick."""

    record: Record
    """What the ticks recorded."""
    goal: Float[Array, "time 3"]
    """Where the function wants the tool [m]."""
    hand: Float[Array, "time 3"]
    """Middle of the hand, as the function knows it; of keep_away and give_way the tool [m]."""
    active: Float[Array, "time"]
    """follow: a hand is there; hand_over: the tool is offered; give_way: the share of the refuge; keep_away: 0 [1]."""
    person: Float[Array, "time"]
    """give_way: sensed distance of people to the task's way; keep_away: to the pose; follow: 0; hand_over: the share of the turn [m]."""


def seen_points(cell: Cell, sensed: Sensed, t: Float[Array, ""]) -> Seen:
    """The measured points of people in the image in use, of the field that policy and safety layer read; without hidden space."""
    field = sensed.fields.moving.field
    return Seen(field.points, field.mask & were_measured(cell.voxels, field.points), t - sensed.age, t)


def start_of(function: str, home: Vector3) -> Any:
    """A function's memory before the first tick."""
    return {"keep_away": not_keeping_away, "follow": not_following, "hand_over": not_handing_over, "give_way": in_refuge}[function](home)  # fmt: skip


def asked(
    function: str, setting: Setting, memory: Any, seen: Seen, tool: Tool, R: Matrix3, turn: Vector3, dt: float
) -> tuple[Any, MovingFrame, Vector3, Array, Array]:  # fmt: skip
    """A function's memory after a tick, the frame that the tool is to ride on, and hand, active and person of `Played`."""
    zero = jnp.zeros((), tool.x.dtype)
    if function == "keep_away":
        kept = keep_away(setting.keep_away, memory, seen, tool, setting.pose, dt)
        return kept, frame_of(kept.reference, R), tool.x, zero, kept.nearing.distance
    if function == "follow":
        after = follow(setting.follow, memory, seen, tool, setting.home, setting.direction, setting.on, dt)
        place = after.reference.x - setting.direction * (setting.follow.track.hand.radius + setting.follow.distance)
        return after, frame_of(after.reference, R), place, jnp.where(after.track.there, zero + 1, zero), zero
    if function == "hand_over":
        held = hand_over(setting.hand_over, memory, seen, tool, setting.home, setting.direction, setting.on, dt)
        return held, turned_frame(held, R, turn), held.mean, jnp.where(held.offered, zero + 1, zero), held.turned.s
    way = give_way(setting.give_way, memory, seen, tool, setting.ends, setting.home, setting.on, dt)
    return way, frame_of(way.reference, R), tool.x, way.share.s, way.nearing.distance


def played(
    function: str, cell: Cell, params: Params, setting: Setting, known: Surveyed, key: PRNGKeyArray, sense: SenseParams
) -> Played:  # fmt: skip
    """An episode of `cell.ticks` from the surveyed start, which is the setting's home.

    Args:
        params: its `policy` is `InteractPolicyParams`, its `safety` `MonitorParams`.
        key: of the images' noise.
    """
    images = ticks_of(cell, known, key)
    R, home = tool_frame(cell.arm, known.q_start)
    turn = turn_between(R, pointing(-setting.direction, R[:, 0]))
    setting = eqx.tree_at(lambda s: s.home, setting, home)
    off = jnp.where(setting.on, 1.0, 0.0).astype(home.dtype)
    policy: InteractPolicyParams = params.policy
    params = eqx.tree_at(lambda p: p.policy.keep.weight, params, off * policy.keep.weight)

    def one(carry: tuple, image: Any) -> tuple[tuple, tuple]:
        watch, kept, state, memory = carry
        watch, kept = look_if_due(params, cell, known, sense, watch, kept, state.arm.q, image)
        sensed = images_in_use(cell, known, kept, image.t)
        _, moved = control_motion(cell, state.arm.q, state.arm.qd)
        tool = Tool(moved.x[0], moved.xd[0])
        memory, frame, hand, active, person = asked(
            function, setting, memory, seen_points(cell, sensed, image.t), tool, R, turn, cell.dt
        )
        goal = goal_at(frame, known.q_start, params.potential)
        now = params
        if function == "keep_away":
            distance = kept_from(setting.keep_away, memory, policy.keep.distance)
            now = eqx.tree_at(lambda p: p.policy.keep.distance, params, distance)
        after, record = tick(now, cell, goal, sensed, state)
        return (watch, kept, after, memory), (record, frame.p, hand, active, person)

    start = (*first_looks(params, cell, known, sense, key), initial_state(cell, known.q_start), start_of(function, home))  # fmt: skip
    return Played(*jax.lax.scan(one, start, images)[1])


def program(function: str, cell: Cell) -> Any:
    """The episode of one function, to be compiled."""
    return partial(played, function, cell)
