"""The sound score as a loss: the score itself wherever a run succeeds, and a smooth share of success where it does not.

All terms are those of `hrcjax.sim.outcome`, exact and differentiable almost everywhere: the derivative of the least distance is that of the pair
and tick found, that of the time is by the interpolated arrival. What has a step is the success; in its place stands a share that
falls from 1 with the distance by which the goal is missed and with the depth of a contact.
"""

import jax.numpy as jnp

from hrcjax.metrics.sound_score import SoundScoreParams, SoundTerms, sound_quality
from hrcjax.metrics.timing import short_of
from hrcjax.sim import Cell, Episode, Params, World, outcome
from hrcjax.sim.outcome import REACHED
from hrcjax.typing import Array, Float

MISSED = 0.25
"""Share of REACHED, or of the speed that counts as arrived, that a run may miss the goal by to be half a success [1]."""
DEEP = 0.005
"""Depth of a contact that halves a success [m]."""


def share_within(beyond: Float[Array, ""]) -> Float[Array, ""]:
    """1 up to 0, 1/2 at 1, and towards 0 far beyond; its slope at 0 is 0 [1]."""
    return 1 / (1 + jnp.maximum(beyond, 0.0) ** 2)


def sound(params: Params, cell: Cell, world: World, run: Episode) -> Float[Array, ""]:
    """1 - score / 100 of the sound score, with a smooth share of success where a run fails."""
    found = outcome(params, cell, world, run)
    metrics, rules = found.metrics, SoundScoreParams()
    quality = sound_quality(
        rules, SoundTerms(*(getattr(metrics, f"sound_{name}") for name in SoundTerms.__annotations__))
    )
    missed = (
        jnp.min(short_of(run.record.tool, world.scene.goal, REACHED, jnp.asarray(cell.dt, run.record.tool.dtype))) - 1
    )
    arrived = jnp.where(metrics.success > 0, 1.0, share_within(missed / MISSED))
    touched = jnp.where(found.hit | found.run_into, -metrics.separation, 0.0)
    share = arrived * share_within(-metrics.clearance / DEEP) * share_within(touched / DEEP)
    score = share * (rules.least + (100 - rules.least) * quality) + (1 - share) * rules.failed * quality
    return 1 - score / 100
