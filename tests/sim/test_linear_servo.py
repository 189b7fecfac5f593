"""The servo's linear derivatives: those of the exact servo while no torque is clipped, in both modes, for several substeps."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.robot import ArmState, load_arm
from hrcjax.sim import Cell
from hrcjax.sim.servo import servo

ARM = load_arm("ur5e")
LINEAR = {n: Cell(arm=ARM, substeps=n, linear_servo=True) for n in (1, 4)}


def moved(cell: Cell, gain: float, q, qd, qdd):
    state, tau, clipped, bad = servo(jnp.asarray(gain), cell, ArmState(q, qd), qdd)
    return jnp.concatenate([state.q, state.qd, tau]), clipped | bad


def at(seed: int, acceleration: float):
    rng = np.random.default_rng(seed)
    sizes = (1.0, 0.5, acceleration)
    return [jnp.asarray(np.asarray(ARM.home) * (k == 0) + size * rng.uniform(-1, 1, 6)) for k, size in enumerate(sizes)]


@pytest.mark.parametrize("substeps", [1, 4])
def test_exact_while_no_torque_is_clipped(substeps: int) -> None:
    linear = LINEAR[substeps]
    exact = replace(linear, linear_servo=False)
    slopes = [
        jax.jit(jax.jacfwd(lambda *x, cell=cell: moved(cell, 20.0, *x)[0], argnums=(0, 1, 2)))
        for cell in (linear, exact)
    ]
    for seed in range(3):
        x = at(seed, 3.0)
        value, clipped = moved(linear, 20.0, *x)
        assert not clipped
        np.testing.assert_array_equal(value, moved(exact, 20.0, *x)[0])
        for a, b in zip(slopes[0](*x), slopes[1](*x), strict=True):
            np.testing.assert_allclose(a, b, atol=1e-7)
    weights = jnp.linspace(-1, 1, 18)
    reverse = jax.grad(lambda *x: moved(linear, 20.0, *x)[0] @ weights, argnums=(0, 1, 2))(*x)
    for a, b in zip(reverse, slopes[1](*x), strict=True):
        np.testing.assert_allclose(a, weights @ b, atol=1e-6)


def test_where_a_torque_is_clipped_they_differ_and_it_is_said() -> None:
    x = at(0, 200.0)
    value, clipped = moved(LINEAR[1], 20.0, *x)
    assert clipped and np.isfinite(value).all()
    by_linear, by_exact = (
        jax.jacfwd(lambda a, cell=cell: moved(cell, 20.0, *x[:2], a)[0])(x[2])
        for cell in (LINEAR[1], replace(LINEAR[1], linear_servo=False))
    )
    assert float(jnp.abs(by_linear - by_exact).max()) > 1e-3
