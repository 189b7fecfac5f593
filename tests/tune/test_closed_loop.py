"""Through whole episodes: the staged gradient of all declared losses by bounded parameters, against central differences."""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.cells.named_cell import NamedCell
from hrcjax.plan import PathResult
from hrcjax.sim import Cell, Task, World, path_through
from hrcjax.tune import LOSSES, choose
from hrcjax.tune.staged import StagedGradient
from hrcjax.tune.stages import Stages

STEP = 1e-4


def bent_plan(params: Any, task: Task) -> PathResult:
    """In place of the optimiser, whose derivative compiles longest: an arch whose height zeta decides."""
    u = jnp.linspace(0, 1, 8, dtype=task.scene.start.dtype)[:, None]
    arch = 0.02 * task.potential.zeta * jnp.sin(jnp.pi * u) * jnp.asarray([0.0, 0.0, 1.0], u.dtype)
    return path_through(task, task.scene.start + u * (task.scene.goal - task.scene.start) + arch)


WEIGHTS = {"jerk": 0.1, "effort": 0.1, "energy": 0.1}


@pytest.mark.slow
@pytest.mark.parametrize("world", ["robotica"], indirect=True)
def test_gradient_of_the_declared_losses(cell: Cell, world: World) -> None:
    named = NamedCell(replace(cell, ticks=60, substeps=2, plan=bent_plan))
    words = (
        "policy.target.kp",
        "motion.clock.jerk",
        "zeta=1.2:5",
        "field.length_scale=0.01:0.1",
    )
    chosen = choose(words, named.params, named.known_aliases(), named.known_domains())
    losses = tuple(loss for loss in LOSSES.values() if loss.of_episode)
    weights = tuple(WEIGHTS.get(loss.name, 1.0) for loss in losses)
    worlds = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], world)
    start, size = chosen.start(), len(words)
    moves = np.concatenate([np.eye(size), -np.eye(size)])
    points = jnp.asarray(np.concatenate([start[None], start + STEP * moves]))
    stages = Stages(named.cell, losses, weights, lambda v: chosen.params(named.params, v), chosen.names)
    assert stages.plan_tuned and stages.fields_tuned
    gradient = StagedGradient(stages, points, worlds)
    every = gradient(points, worlds)
    assert np.isfinite(every.terms).all() and np.isfinite(every.gradient).all() and gradient.clipped == 0
    loss = np.asarray(every.loss)
    differences = (loss[1 : 1 + size] - loss[1 + size :]) / (2 * STEP)
    np.testing.assert_allclose(every.gradient[0], differences, rtol=2e-3, atol=1e-7)
    assert (np.abs(differences) > 1e-7).all(), "every parameter is felt"
    terms_apart = np.asarray(every.terms)[0]
    assert (terms_apart >= 0).all() and loss[0] == pytest.approx(np.dot(weights, terms_apart))

    gradient.new_loss(replace(stages, losses=losses[:1], weights=(2.0,)))
    again = gradient(points, worlds)
    np.testing.assert_allclose(again.loss, 2 * every.each[:, 0, 0], rtol=1e-12)
    one = np.asarray(again.loss)
    np.testing.assert_allclose(
        again.gradient[0], (one[1 : 1 + size] - one[1 + size :]) / (2 * STEP), rtol=2e-3, atol=1e-7
    )
