"""Through whole episodes: the gradient of all declared losses by bounded parameters, against central differences."""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.cells.named_cell import NamedCell
from hrcjax.numerics import unrolled_options
from hrcjax.plan import PathResult
from hrcjax.sim import Cell, Task, World, path_through
from hrcjax.tune import LOSSES, choose, episode_terms, values_and_gradients

STEP = 1e-4


def straight_plan(params: Any, task: Task) -> PathResult:
    """In place of the optimiser, whose derivative compiles longest."""
    u = jnp.linspace(0, 1, 8, dtype=task.scene.start.dtype)[:, None]
    return path_through(task, task.scene.start + u * (task.scene.goal - task.scene.start))


WEIGHTS = {"jerk": 0.1, "effort": 0.1, "energy": 0.1}


@pytest.mark.slow
@pytest.mark.parametrize("world", ["robotica"], indirect=True)
def test_gradient_of_the_declared_losses(cell: Cell, world: World) -> None:
    named = NamedCell(replace(cell, ticks=60, substeps=1, plan=straight_plan))
    words = ("motion.speed=0.1:1.5:0.5", "policy.target.kp", "motion.clock.jerk")
    chosen = choose(words, named.params, named.known_aliases(), named.known_domains())
    weights = [WEIGHTS.get(name, 1.0) for name in LOSSES]
    terms = episode_terms(named.cell, tuple(LOSSES.values()))
    worlds = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], world)

    def found(vectors):
        return values_and_gradients(terms, weights, lambda v: chosen.params(named.params, v), vectors, worlds)

    start, size = chosen.start(), len(words)
    moves = np.concatenate([np.eye(size), -np.eye(size)])
    points = jnp.asarray(np.concatenate([start[None], start + STEP * moves]))
    every = jax.jit(found, compiler_options=unrolled_options())(points)
    assert np.isfinite(every.terms).all() and np.isfinite(every.gradient).all()
    loss = np.asarray(every.loss)
    differences = (loss[1 : 1 + size] - loss[1 + size :]) / (2 * STEP)
    np.testing.assert_allclose(every.gradient[0], differences, rtol=2e-3, atol=1e-7)
    assert (np.abs(differences) > 1e-5).any()
    terms_apart = np.asarray(every.terms)[0]
    assert (terms_apart >= 0).all() and loss[0] == pytest.approx(np.dot(weights, terms_apart))
