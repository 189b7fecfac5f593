"""Losses of an episode by name, each a pure function (params, cell, world, episode) -> scalar, lower is better.

They are made of the record of the episode: what the robot senses and does, smooth in every parameter almost everywhere. What
the gradient does not see are the switches of the loop: a zone that is entered or left, a stop and its end, the side on which an
obstacle is passed, the guess that the planner finishes, the assumed speed of a person, which jumps with the distance. There the
loss has a step and the gradient is that of one side. Results are therefore judged by the metrics of `hrcjax.sim.outcome`.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from hrcjax.metrics.smoothness import mean_squared_jerk
from hrcjax.numerics import safe_sqrt
from hrcjax.safety import assumed_human_speed, separation_distance
from hrcjax.sim import Cell, Episode, Params, World
from hrcjax.sim.outcome import REACHED
from hrcjax.tune.loss import SAFE_CLEARANCE, SOFTNESS
from hrcjax.typing import Array, Float

LossFn = Callable[[Params, Cell, World, Episode], Float[Array, ""]]
FAR = 10.0
"""Distances and limits beyond it are the same for a loss, also infinite ones [m], [m/s]."""
FLOOR = 0.02
"""Power of a joint below which its absolute value is rounded off [W]."""
SEPARATION_SOFTNESS = 0.05
"""Width of the soft hinge on the separation [m]."""


def away(world: World, run: Episode) -> Float[Array, "time"]:
    """Share to which the tool is not at the goal: 1 - exp(-(d / REACHED)^2), 0 at the goal and 1 from 5 cm on [1]."""
    return -jnp.expm1(-jnp.sum(((run.record.tool - world.scene.goal) / REACHED) ** 2, axis=-1))


def progress(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """Mean squared distance of the tool to the goal over that at the start."""
    scene = world.scene
    way = jnp.sum((run.record.tool - scene.goal) ** 2, axis=-1)
    return jnp.mean(way / jnp.sum((scene.start - scene.goal) ** 2))


def time(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """Time for which the tool is not at the goal, softly. The whole episode, without a slope, where it comes nowhere near:
    `progress` beside it leads there."""
    return jnp.mean(away(world, run)) * (cell.dt * cell.ticks)


def clearance(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """Mean of a soft hinge on the sensed distance of the arm to the nearest surface, of scene or person, below 5 cm."""
    return jnp.mean(jax.nn.softplus((SAFE_CLEARANCE - run.record.field_clearance) / SOFTNESS))


def protective(params: Params, cell: Cell, run: Episode) -> tuple[Float[Array, "time"], Float[Array, "time"]]:
    """The sensed separation, and the one that the arm's approach needs of a person of the assumed speed, S_p [m]. What S_p
    is measured by is held: no parameter is better for asking less."""
    ssm = jax.lax.stop_gradient(cell.safety.yardstick(params.safety))
    separation = jnp.minimum(run.record.separation, FAR)

    def needed(approach: Float[Array, ""], apart: Float[Array, ""]) -> Float[Array, ""]:
        return separation_distance(ssm, approach, assumed_human_speed(ssm, apart))

    return separation, jax.vmap(needed)(run.record.approach, jax.lax.stop_gradient(separation))


def separation(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """Mean of a soft hinge on the sensed separation below S_p of the assumed person's speed."""
    apart, needed = protective(params, cell, run)
    return jnp.mean(jax.nn.softplus((needed - apart) / SEPARATION_SOFTNESS))


def excess_speed(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """Mean squared speed towards a person above what the safety monitor allows."""
    over = run.record.approach - jnp.clip(run.record.speed_limit, 0.0, FAR)
    return jnp.mean(jnp.maximum(over, 0.0) ** 2)


def effort(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """Mean squared acceleration of the joints."""
    return jnp.mean(jnp.sum(run.record.qdd**2, axis=-1))


def jerk(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """Mean squared jerk of the tool, at the rate of the metrics."""
    k = cell.metric_stride
    return mean_squared_jerk(run.record.tool[::k], 1 / (cell.dt * k))


def energy(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """Work of the joints until the goal, softly, braking counted as driving; powers below 0.02 W are rounded off."""
    power = safe_sqrt((run.record.tau * run.record.qd) ** 2 + FLOOR**2) - FLOOR
    return jnp.sum(jnp.sum(power, axis=-1) * away(world, run)) * cell.dt
