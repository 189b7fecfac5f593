"""Our safety layer over the baseline: how fast its motion may be played now. The motion itself, and what it plans, stay its own."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from hrcjax.numerics import unrolled_options
from hrcjax.safety import ClockState, advance, initial_clock
from hrcjax.sim import Cell, Params
from hrcjax.sim.own_sensing import Kept, TickImage, first_looks, images_in_use, look_if_due, ticks_of
from hrcjax.sim.parts import Separation, all_finite
from hrcjax.sim.prepare import Surveyed
from hrcjax.sim.survey import SenseParams
from hrcjax.sim.tick import approaching, control_motion, read_room, steered
from hrcjax.sim.watch import Watch
from hrcjax.typing import Array, Float, Joints, PRNGKeyArray

ENDLESS = 1e3
"""Way that remains for the clock: a motion comes to its end by its own law of time [m]."""


class Guarding(NamedTuple):
    """What the guard remembers from one tick to the next."""

    watch: Watch
    """What the cameras have seen."""
    kept: Kept
    """The last images."""
    memory: Any
    """Of the safety monitor."""
    clock: ClockState
    """Pace of the motion, times `full` [m/s]."""
    zone: Array
    """Zone of the safety monitor."""


class Guard:
    """Speed and separation for a motion that is planned elsewhere, from the same images: the parts of `hrcjax.sim.tick`, without path and policy.

    As in mode path the geometry is fixed, and all joints are slowed alike. The pace falls to what is allowed at once, and grows with
    the acceleration and jerk of our path clock, from rest where a motion begins. What the joint servo adds afterwards, to follow its
    command, is not bounded, other than in our tick.
    """

    def __init__(self, cell: Cell, params: Params, known: Surveyed, key: PRNGKeyArray, full: float) -> None:
        """
        Args:
            cell: in mode path.
            params: of our systems.
            known: the cell after its set-up.
            key: of the images' noise.
            full: speed of the tool at pace 1, for the clock's acceleration [m/s].
        """
        sense = SenseParams()
        self._images = ticks_of(cell, known, key)
        watch, kept = jax.jit(lambda key: first_looks(params, cell, known, sense, key))(key)
        dtype = known.q_start.dtype
        zone = jnp.zeros((), jnp.int32)
        self.state = Guarding(watch, kept, cell.safety.start(dtype), initial_clock(dtype), zone)

        def step(state: Guarding, image: TickImage, q: Joints, qd: Joints, along: Joints, rate: Array) -> Guarding:
            watch, kept = look_if_due(params, cell, known, sense, state.watch, state.kept, q, image)
            sensed = images_in_use(cell, known, kept, image.t)
            body, _ = control_motion(cell, q, qd)
            room, people = read_room(params, cell, sensed.fields, body)
            separation = Separation(
                people.distance, people.speeds(qd), sensed.age, sensed.valid, sensed.guarded, cell.dt, None, people.nearest()
            )  # fmt: skip
            memory, decision = cell.safety.decide(params.safety, state.memory, separation)
            top = decision.speed_limit if decision.any_limit is None else decision.any_limit
            allowed = steered(params, cell, along, qd, people, decision, room, top)
            allowed = approaching(allowed, people, decision)
            most = jnp.clip(_ratio(allowed, along), 0.0, 1.0)
            stopped = decision.hold | ~all_finite(most, people.distance)
            most = jnp.where(stopped, 0.0, most)
            clock = ClockState(state.clock.s, jnp.minimum(rate * full, state.clock.v), state.clock.a)
            clock = advance(params.motion.clock, clock, most * full, ENDLESS, cell.dt)
            clock = ClockState(jnp.zeros_like(clock.s), jnp.minimum(clock.v, most * full), clock.a)
            return Guarding(watch, kept, memory, clock, decision.zone)

        self._step = jax.jit(step, compiler_options=unrolled_options())
        self._dtype, self._full = dtype, full

    def most(self, tick: int, q: NDArray, qd: NDArray, along: NDArray, rate: float) -> float:
        """Largest pace of a motion in this tick, 0 to 1 [1]. Called once a tick: it takes the tick's image.

        Args:
            q: joints now [rad].
            qd: their speeds [rad/s].
            along: speeds of the motion at pace 1; 0 where there is none [rad/s].
            rate: pace now [1].
        """
        image = jax.tree.map(lambda a: a[tick], self._images)
        arrays = (jnp.asarray(x, self._dtype) for x in (q, qd, along, rate))
        self.state = self._step(self.state, image, *arrays)
        return float(np.clip(float(self.state.clock.v) / self._full, 0.0, 1.0))

    @property
    def zone(self) -> int:
        """Zone of the last tick: 0 green, 1 yellow, 2 red, 3 stop."""
        return int(self.state.zone)


def _ratio(part: Joints, whole: Joints) -> Float[Array, ""]:
    """How much of a motion is left of it, of two along one line; 1 where there is no motion [1]."""
    size = jnp.sum(whole * whole)
    return jnp.where(size > 1e-12, jnp.sum(part * whole) / jnp.where(size > 1e-12, size, 1.0), 1.0)
