"""Loss of an episode, smooth in every parameter, for tuning by gradient."""

import jax
import jax.numpy as jnp

from hrcjax.sim import Cell, Params, World, episode
from hrcjax.typing import Array, Float

SAFE_CLEARANCE = 0.05
"""Clearance below which the loss grows [m]."""
SOFTNESS = 0.02
"""Width of the soft hinge on clearance [m]."""
EFFORT = 1e-3
"""Weight of the mean squared joint acceleration [s^4/rad^2]."""


def episode_loss(params: Params, cell: Cell, world: World) -> Float[Array, ""]:
    """Progress, effort and clearance of one episode [1].

    The mean squared distance to the goal over that at the start, plus the mean squared joint acceleration, plus the
    mean of a soft hinge on the clearance from the field. Not the score of the papers, whose maxima and thresholds have no
    useful derivative.
    """
    run = episode(params, cell, world, cell.field.fit(params.field, world.frames))
    scene, record = world.scene, run.record
    way = jnp.sum((record.tool - scene.goal) ** 2, axis=-1) / jnp.sum((scene.start - scene.goal) ** 2)
    effort = jnp.sum(record.qdd**2, axis=-1)
    near = jax.nn.softplus((SAFE_CLEARANCE - record.field_clearance) / SOFTNESS)
    return jnp.mean(way) + EFFORT * jnp.mean(effort) + jnp.mean(near)
