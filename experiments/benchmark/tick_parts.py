"""A control tick taken apart: its parts one after another, each with the names of what it reads and gives.

The parts call what `hrcjax.sim.tick` calls, in its order; `tick` says what they do. `loop` measures them and compares the
motion of the tick taken apart with that of the whole.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.bits import pack
from hrcjax.policy import limit_acceleration
from hrcjax.robot import ArmState
from hrcjax.safety import guard
from hrcjax.sim import Cell, Fields, Params, Record
from hrcjax.sim.cell import newest_frame
from hrcjax.sim.episode import pack_cameras
from hrcjax.sim.guide import guide
from hrcjax.sim.parts import ArmMotion, Separation, all_finite
from hrcjax.sim.route import Route
from hrcjax.sim.sensing import Frames
from hrcjax.sim.servo import servo
from hrcjax.sim.tick import (
    NOT_FINITE_COMMAND,
    NOT_FINITE_READING,
    NOT_FINITE_TORQUE,
    TORQUE_LIMITED,
    Sensed,
    TickState,
    approaching,
    control_motion,
    full_brake,
    joint_limits,
    read_room,
    steered,
)

Values = dict[str, Any]


class Setting(eqx.Module):
    """What a setting keeps over all ticks."""

    params: Params
    """The numbers of the method."""
    route: Route
    """The reference motion."""


class Seen(eqx.Module):
    """What is sensed at all ticks."""

    static: Any
    """The field of what stands, once."""
    ticks: tuple[Any, ...]
    """Fields of what moves, age, validity, guard and faults, with an axis of time: what a scan slices."""

    def at(self, now: tuple[Any, ...]) -> Sensed:
        """What is sensed at one tick, by its slice of `ticks`."""
        return Sensed(Fields(self.static, now[0]), *now[1:])


@dataclass(frozen=True)
class Part:
    """A part of the tick."""

    needs: tuple[str, ...]
    """Names of the values that it reads."""
    run: Callable[[Cell, Setting, Sensed, Mapping[str, Any]], Values]
    """(cell, setting, what is sensed, values) -> the values that it gives."""


def _kinematics(cell: Cell, setting: Setting, sensed: Sensed, v: Mapping[str, Any]) -> Values:
    body, tool = control_motion(cell, v["q"], v["qd"])
    return {"body": body, "tool": tool}


def _field(cell: Cell, setting: Setting, sensed: Sensed, v: Mapping[str, Any]) -> Values:
    room, people = read_room(setting.params, cell, sensed.fields, v["body"])
    return {"room": room, "people": people}


def _safety(cell: Cell, setting: Setting, sensed: Sensed, v: Mapping[str, Any]) -> Values:
    people = v["people"]
    approach = people.speeds(v["qd"])
    separation = Separation(
        people.distance, approach, sensed.age, sensed.valid, sensed.guarded, cell.dt, nearest=people.nearest()
    )
    memory, decision = cell.safety.decide(setting.params.safety, v["memory"], separation)
    top = decision.speed_limit if decision.any_limit is None else decision.any_limit
    unread = ~all_finite(
        people.distance, approach, v["room"].standing_distance, decision.speed_limit, decision.point_limit, top
    )
    hold = decision.hold | unread
    return {
        "next_memory": memory,
        "decision": decision,
        "top": top,
        "approach": approach,
        "unread": unread,
        "hold": hold,
    }


def _guide(cell: Cell, setting: Setting, sensed: Sensed, v: Mapping[str, Any]) -> Values:
    arm = ArmMotion(v["q"], v["qd"], v["tool"], v["body"])
    limits = joint_limits(cell, v["q"].dtype)
    asked = guide(
        setting.params, cell, setting.route, v["clock"], arm, v["room"], v["people"], v["decision"], v["hold"], limits
    )
    return {"guidance": asked}


def _governor(cell: Cell, setting: Setting, sensed: Sensed, v: Mapping[str, Any]) -> Values:
    q, qd, people, decision, dt = v["q"], v["qd"], v["people"], v["decision"], cell.dt
    limits = joint_limits(cell, q.dtype)
    brake = full_brake(qd, limits, dt)
    safe, bad = guard(v["guidance"].asked, brake)
    limited, _ = limit_acceleration(safe, q, qd, limits, dt)
    ahead = steered(setting.params, cell, qd + limited * dt, qd, people, decision, v["room"], v["top"])
    limited, _ = limit_acceleration((ahead - qd) / dt, q, qd, limits, dt)
    after = approaching(qd + limited * dt, people, decision)
    governed = jnp.where(v["hold"], brake, (after - qd) / dt)
    limited, _ = limit_acceleration(governed, q, qd, limits, dt)
    qdd, unbounded = guard(limited, brake)
    return {"qdd": qdd, "bad": bad | unbounded}


def _servo(cell: Cell, setting: Setting, sensed: Sensed, v: Mapping[str, Any]) -> Values:
    arm = ArmState(v["q"], v["qd"])
    moved, tau, limited, bad = servo(setting.params.motion.servo_gain, cell, arm, v["qdd"])
    return {"moved": moved, "tau": tau, "torque_limited": limited, "torque_bad": bad}


def _record(cell: Cell, setting: Setting, sensed: Sensed, v: Mapping[str, Any]) -> Values:
    decision, room = v["decision"], v["room"]
    status = {
        NOT_FINITE_COMMAND: v["bad"],
        TORQUE_LIMITED: v["torque_limited"],
        NOT_FINITE_TORQUE: v["torque_bad"],
        NOT_FINITE_READING: v["unread"],
    }
    record = Record(
        q=v["q"],
        qd=v["qd"],
        qdd=v["qdd"],
        tau=v["tau"],
        tool=v["tool"].x[0],
        reference=v["guidance"].reference,
        travelled=v["clock"].s,
        separation=jnp.min(room.person_distance),
        field_clearance=jnp.min(room.distance),
        approach=jnp.max(v["approach"]),
        speed_limit=decision.speed_limit,
        zone=decision.zone,
        reasons=decision.reasons,
        cameras=sensed.faults,
        status=pack(status),
    )
    return {"record": record}


PARTS = {
    "kinematics": Part(("q", "qd"), _kinematics),
    "field": Part(("body",), _field),
    "safety": Part(("qd", "memory", "people", "room"), _safety),
    "guide": Part(("q", "qd", "clock", "tool", "body", "room", "people", "decision", "hold"), _guide),
    "governor": Part(("q", "qd", "guidance", "people", "room", "decision", "top", "hold"), _governor),
    "servo": Part(("q", "qd", "qdd"), _servo),
    "record": Part(
        (
            "q", "qd", "qdd", "tau", "tool", "guidance", "clock", "room", "approach", "decision", "bad",
            "torque_limited", "torque_bad", "unread",
        ),
        _record,
    ),
}  # fmt: skip
"""Name -> part, in the order of the tick."""


def apart(cell: Cell, setting: Setting, sensed: Sensed, state: TickState) -> tuple[TickState, Values]:
    """A tick by its parts: the next state, and every value on the way."""
    values: Values = {"q": state.arm.q, "qd": state.arm.qd, "clock": state.clock, "memory": state.safety}
    for part in PARTS.values():
        values |= part.run(cell, setting, sensed, {name: values[name] for name in part.needs})
    return TickState(values["moved"], values["guidance"].clock, values["next_memory"]), values


def sensed_over_time(cell: Cell, frames: Frames, fields: Fields, q: jax.Array) -> Seen:
    """What is sensed at every tick, as `hrcjax.sim.follow` reads it.

    Args:
        q: any array of the wanted dtype.
    """
    exposed = jnp.asarray(cell.times - cell.latency, q.dtype)
    index, age = newest_frame(frames.stamp, frames.valid, exposed)
    latest, _ = newest_frame(frames.stamp, jnp.ones_like(frames.valid), exposed)
    moving = jax.tree.map(lambda a: a[index], fields.moving)
    valid = jnp.broadcast_to(~frames.static_overflow, index.shape)
    guarded = frames.guarded[index] | frames.guarded[latest]
    return Seen(fields.static, (moving, age + cell.latency, valid, guarded, pack_cameras(frames.reasons[latest])))
