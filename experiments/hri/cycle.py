"""Our own systems cycle between two waypoints, with images of the arm where it is, along one route that runs to and fro.

The reference passes along the planned path as a cosine of the route's phase: at every waypoint it is at rest for a moment and turns, without
a step in its acceleration. It waits at a waypoint for a tool that is not near it.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.numerics import safe_norm
from hrcjax.plan import path_curve
from hrcjax.robot import tool_frame
from hrcjax.sim import Cell, Params
from hrcjax.sim.episode import plan_route
from hrcjax.sim.own_sensing import first_looks, images_in_use, look_if_due, ticks_of
from hrcjax.sim.parts import Task
from hrcjax.sim.prepare import Surveyed
from hrcjax.sim.route import Route, tool_axes
from hrcjax.sim.survey import SenseParams
from hrcjax.sim.tick import Record, Sensed, control_motion, initial_state, read_room, tick
from hrcjax.typing import Array, Bool, Float, Int, PRNGKeyArray

from .trace import PROBE_TICKS, REACHED, SLOW

LEG_POINTS = 24
"""Points of the route's spline in a leg."""
LEGS = 12
"""Legs of the route: more than an episode has time for."""
NEAR = 0.03
"""Distance of the tool to its reference up to which the reference does not wait at a waypoint [m]."""


class ToAndFro(Route):
    """A route there and back, again and again, by its phase: (pi / 2) times the length of the path in a leg, so that the tool's
    reference is never faster than the clock."""

    until: Float[Array, ""] = eqx.field(default=None)  # pyright: ignore[reportAssignmentType]
    """Phase at which the reference stops [m]."""

    @property
    def length(self) -> Float[Array, ""]:
        """Phase up to which the reference may go [m]."""
        return self.until


def to_and_fro(route: Route) -> ToAndFro:
    """The route that goes along another one and back, LEGS times."""
    turn = np.arange(LEGS * LEG_POINTS + 1) / LEG_POINTS
    along = jnp.asarray(0.5 - 0.5 * np.cos(np.pi * turn), route.length.dtype) * route.length
    phase = LEGS * np.pi / 2 * route.length
    curve = path_curve(jax.vmap(route.curve.point)(along))
    curve = eqx.tree_at(lambda c: c.length, curve, phase)
    return ToAndFro(curve, jnp.zeros_like(route.ratio), route.end, phase)


class Cycled(NamedTuple):
    """A run of one of our systems, every tick."""

    record: Record
    """What the ticks recorded."""
    leg: Int[Array, "time"]
    """Arrivals at waypoints so far."""
    probe_known: Float[Array, "time probe"]
    """Distance to people that the field shows of the arm in the probes' configurations; of every `PROBE_TICKS`th tick, else 0 [m]."""


def cycled(
    params: Params, cell: Cell, known: Surveyed, key: PRNGKeyArray, sense: SenseParams, waypoints: Float[Array, "2 joint"],
    probes: Float[Array, "probe joint"],
) -> Cycled:  # fmt: skip
    """Cycles between the scene's start and goal for `cell.ticks`, in the cell's way to move.

    Args:
        key: of the images' noise.
        waypoints: joints at start and goal [rad].
        probes: configurations of which the field is asked how near people are [rad].
    """
    task = Task(known.scene, known.q_start, params.potential, cell.arm)
    way = to_and_fro(plan_route(params, cell, task)[1])
    R, x = jax.vmap(lambda q: tool_frame(cell.arm, q))(waypoints)
    ends = jax.vmap(tool_axes)(x, R)
    leg_phase = way.length / LEGS
    images = ticks_of(cell, known, key)

    def one(carry: tuple, item: tuple[Any, Array]) -> tuple[tuple, tuple]:
        watch, kept, state, leg = carry
        image, probing = item
        watch, kept = look_if_due(params, cell, known, sense, watch, kept, state.arm.q, image)
        sensed = images_in_use(cell, known, kept, image.t)
        route = _for_leg(cell, way, ends, leg, leg_phase, state)
        after, record = tick(params, cell, route, sensed, state)
        leg = leg + arrived(cell, state, route.end)
        seen = jax.lax.cond(
            probing, lambda: jax.vmap(lambda q: known_distance(params, cell, sensed, q))(probes),
            lambda: jnp.zeros(probes.shape[0], probes.dtype),
        )  # fmt: skip
        return (watch, kept, after, leg), (record, leg, seen)

    probing = jnp.arange(cell.ticks) % PROBE_TICKS == 0
    start = (
        *first_looks(params, cell, known, sense, key),
        initial_state(cell, known.q_start),
        jnp.zeros((), jnp.int32),
    )
    return Cycled(*jax.lax.scan(one, start, (images, probing))[1])


def _for_leg(cell: Cell, way: ToAndFro, ends: Array, leg: Array, leg_phase: Array, state: Any) -> ToAndFro:
    """The route as it is to be followed now: on through the next waypoint, or up to it."""
    following = (leg + 1) * leg_phase
    x = tool_frame(cell.arm, state.arm.q)[1]
    near = safe_norm(way.curve.point(state.clock.s)[:3] - x) <= NEAR
    passes = near & (state.clock.s < following) & (cell.motion != "reactive")
    return ToAndFro(way.curve, way.ratio, ends[(leg + 1) % 2], jnp.where(passes, way.length, following))


def arrived(cell: Cell, state: Any, end: Float[Array, "3 3"]) -> Bool[Array, ""]:
    """Whether the tool is at a waypoint, and at rest."""
    _, tool = control_motion(cell, state.arm.q, state.arm.qd)
    return (safe_norm(tool.x[0] - end[0]) <= REACHED) & (safe_norm(tool.xd[0]) <= SLOW)


def known_distance(params: Params, cell: Cell, sensed: Sensed, q: Float[Array, "joint"]) -> Float[Array, ""]:
    """Distance of the arm in a configuration to people, as the field shows it [m]."""
    body, _ = control_motion(cell, q, jnp.zeros_like(q))
    room, _ = read_room(params, cell, sensed.fields, body)
    return jnp.min(room.person_distance)
