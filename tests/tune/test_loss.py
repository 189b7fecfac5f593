"""The staged gradient of the declared losses by every numeric parameter, through whole episodes, against central differences."""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.lab.parameters import leaf_names, set_leaves
from hrcjax.plan import PathParams
from hrcjax.sim import Cell, Params, World
from hrcjax.tune import LOSSES
from hrcjax.tune.staged import StagedGradient
from hrcjax.tune.stages import Stages

FELT = {  # differences that are well above rounding in both scenes
    "policy.target.kp", "policy.target.kd", "policy.target.metric_max",
    "policy.joint_limit.metric", "policy.damping.weight", "motion.clock.jerk", "motion.speed",
}  # fmt: skip
FELT_BESIDE_OBSTACLES = {"plan.omega1", "plan.omega2", "potential.zeta", "policy.collision.r_act", "motion.leash"}
"""Without obstacles the best path is straight, whatever the weights; what stands does not depend on the kernel."""
WEIGHTS = {"jerk": 0.1, "effort": 0.1, "energy": 0.1}
PARAMS = jax.tree.map(
    lambda leaf: jnp.asarray(leaf, jnp.float64),
    set_leaves(Params(plan=PathParams()), {"motion.speed": 0.5}),  # so that within the episode the columns are felt
)
NAMES = {name: float(value) for name, value in leaf_names(PARAMS).items()}
START = np.array(list(NAMES.values()))


def one_world(world: World) -> World:
    """A stack of one."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], world)


@pytest.fixture(scope="session")
def programs(cell: Cell):
    """The staged gradient of the setting and both neighbours by every parameter, compiled once for both scenes."""
    losses = tuple(loss for loss in LOSSES.values() if loss.of_episode)
    weights = tuple(WEIGHTS.get(loss.name, 1.0) for loss in losses)
    stages = Stages(
        cell, losses, weights, lambda v: set_leaves(PARAMS, dict(zip(NAMES, v, strict=True))), tuple(NAMES)
    )
    made: dict[str, StagedGradient] = {}

    def program(points: Any, worlds: World) -> StagedGradient:
        if not made:
            made["one"] = StagedGradient(stages, points, worlds)
        return made["one"]

    return program


def points(relative: float) -> np.ndarray:
    """The setting, and every parameter moved up, then down."""
    moves = np.diag(relative * np.maximum(np.abs(START), 1e-6))
    return np.concatenate([START[None], START + moves, START - moves])


def differences(loss: np.ndarray, relative: float):
    """Central difference by each parameter, and what rounding of the two values may add to it."""
    steps, size = relative * np.maximum(np.abs(START), 1e-6), len(START)
    return (loss[1 : 1 + size] - loss[1 + size :]) / (2 * steps), 1e-12 * np.abs(loss).max() / steps


@pytest.mark.slow
def test_gradient_by_every_parameter_equals_finite_differences(cell, world, programs):
    worlds = one_world(world)
    program = programs(jnp.asarray(points(1e-4)), worlds)
    found = program(jnp.asarray(points(1e-4)), worlds)
    assert np.isfinite(found.terms).all() and np.isfinite(found.gradient).all() and program.clipped == 0
    gradient = np.asarray(found.gradient)[0]
    wide, rounding = differences(np.asarray(found.loss), 1e-4)
    right = np.abs(gradient - wide) <= 1e-3 * np.abs(wide) + rounding
    # Where a switch of the path clock lies within the wide step, the narrow one decides, if rounding allows.
    narrow, rounding_narrow = differences(np.asarray(program(jnp.asarray(points(1e-6)), worlds).loss), 1e-6)
    error = np.abs(gradient - narrow)
    right |= (error <= 1e-3 * np.abs(narrow)) & (rounding_narrow < 1e-2 * np.abs(narrow))
    assert right.all(), "\n".join(
        f"{name}: gradient {gradient[i]:.6g}, differences {wide[i]:.6g} and {narrow[i]:.6g}"
        for i, name in enumerate(NAMES)
        if not right[i]
    )
    felt = {name for i, name in enumerate(NAMES) if abs(wide[i]) > 10 * rounding[i]}
    beside = bool(np.asarray(world.scene.mask).any())
    assert felt >= FELT | (FELT_BESIDE_OBSTACLES if beside else set())
    terms = np.asarray(found.terms)[0]
    assert (terms >= 0).all() and float(found.loss[0]) == pytest.approx(np.dot(program.stages.weights, terms))


@pytest.mark.slow
@pytest.mark.parametrize("world", ["robotica"], indirect=True)
def test_a_new_loss_is_the_old_one_where_it_was_a_term(cell, world, programs):
    worlds, start = one_world(world), jnp.asarray(points(1e-4))
    program = programs(start, worlds)
    before, stages = program(start, worlds), program.stages
    program.new_loss(replace(stages, losses=stages.losses[:1], weights=(2.0,)))
    again = program(start, worlds)
    program.new_loss(stages)
    np.testing.assert_allclose(again.loss, 2 * before.each[:, 0, 0], rtol=1e-12)
    wide, rounding = differences(np.asarray(again.loss), 1e-4)
    names = [k for k, name in enumerate(NAMES) if name in ("policy.target.kp", "motion.clock.jerk", "potential.zeta")]
    gradient = np.asarray(again.gradient)[0]
    assert (np.abs(gradient - wide) <= 2e-3 * np.abs(wide) + rounding)[names].all()
