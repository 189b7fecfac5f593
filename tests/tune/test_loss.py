"""The gradient of an episode's loss by every numeric parameter, against central differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.lab.parameters import leaf_names, set_leaves
from hrcjax.numerics import unrolled_options
from hrcjax.plan import PathParams
from hrcjax.sim import Cell, Params
from hrcjax.tune import episode_loss

FELT = {  # differences that are well above rounding in both scenes
    "policy.target.kp", "policy.target.kd", "policy.target.metric_max",
    "policy.joint_limit.metric", "policy.damping.weight", "motion.clock.jerk", "motion.speed",
}  # fmt: skip
FELT_BESIDE_OBSTACLES = {"plan.omega1", "plan.omega2", "potential.zeta", "policy.collision.r_act", "motion.leash"}
"""Without obstacles the best path is straight, whatever the weights; what stands does not depend on the kernel."""
ROWS = 30
"""Settings of one call: a difference needs two, so that calls are full whatever is left to compare."""


@pytest.fixture(scope="session")
def programs(cell: Cell):
    """Gradient, and values of many settings: each compiled once for both scenes."""
    gradient = jax.jit(
        jax.grad(lambda params, world: episode_loss(params, cell, world)), compiler_options=unrolled_options()
    )
    level_1 = unrolled_options() | {"xla_backend_optimization_level": "1"}  # hundreds of episodes: running counts
    values = jax.vmap(lambda params, world: episode_loss(params, cell, world), in_axes=(0, None))
    return gradient, jax.jit(values, compiler_options=level_1)


def differences(params, names, moved, program, world, relative):
    """Central difference by each of the `moved` parameters, and what rounding of the two values may add to it."""
    size = {name: relative * max(abs(names[name]), 1e-6) for name in moved}
    rows = [(name, sign) for name in moved for sign in (1, -1)]
    rows += [("", 0)] * (-len(rows) % ROWS)
    values = []
    for first in range(0, len(rows), ROWS):
        batch = {
            name: jnp.asarray(
                [value + sign * size.get(name, 0) * (name == row) for row, sign in rows[first : first + ROWS]]
            )
            for name, value in names.items()
        }
        values.append(np.asarray(program(set_leaves(params, batch), world)))
    values = np.concatenate(values)[: 2 * len(moved)].reshape(-1, 2)
    steps = np.array(list(size.values()))
    return (values[:, 0] - values[:, 1]) / (2 * steps), 1e-12 * np.abs(values).max() / steps


@pytest.mark.slow
def test_gradient_of_every_parameter_equals_finite_differences(world, programs):
    grad_program, value_program = programs
    params = eqx.tree_at(
        lambda p: p.motion.speed, Params(plan=PathParams()), 0.5
    )  # so that within the episode the columns are felt
    params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), params)
    names = {name: float(value) for name, value in leaf_names(params).items()}
    gradient = np.array(list(leaf_names(grad_program(params, world)).values()))
    assert np.isfinite(gradient).all()

    wide, rounding = differences(params, names, list(names), value_program, world, 1e-4)
    right = np.abs(gradient - wide) <= 1e-3 * np.abs(wide) + rounding
    # Where a switch of the path clock lies within the wide step, the narrow one decides, if rounding allows.
    doubtful = {name: i for i, name in enumerate(names) if not right[i]}
    if doubtful:
        narrow, rounding_narrow = differences(params, names, list(doubtful), value_program, world, 1e-6)
        found = gradient[list(doubtful.values())]
        good = (np.abs(found - narrow) <= 1e-3 * np.abs(narrow)) & (rounding_narrow < 1e-2 * np.abs(narrow))
        assert good.all(), "\n".join(
            f"{name}: gradient {gradient[i]:.6g}, differences {wide[i]:.6g} and {narrow[n]:.6g}"
            for n, (name, i) in enumerate(doubtful.items())
            if not good[n]
        )
    felt = {name for i, name in enumerate(names) if abs(wide[i]) > 10 * rounding[i]}
    beside = bool(np.asarray(world.scene.mask).any())
    assert felt >= FELT | (FELT_BESIDE_OBSTACLES if beside else set())
