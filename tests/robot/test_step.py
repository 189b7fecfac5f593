"""Steps: folded, MJX and C MuJoCo walk the same way; the jit carries its option."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from quick import quick_jit
from random_chain import random_model

from hrcjax.robot import ArmState, chain_from_mujoco, jit_for, limit_torque, step

DT = 0.002


def wobble(steps: int) -> np.ndarray:
    """Torques that shake the falling arm."""
    t = np.arange(steps)[:, None] * DT
    rate = np.array([2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
    return np.array([8.0, 4.0, 2.0, 0.2, 0.1, 0.002]) * np.sin(rate * t)


def damped(qd, push):
    return push - jnp.asarray([20.0, 20.0, 8.0, 0.5, 0.2, 0.01], qd.dtype) * qd


def rollout(arm, backend, dtype, steps):
    torque = jnp.asarray(wobble(steps), dtype)

    def one(q):
        def tick(state, push):
            after = step(arm, state, damped(state.qd, push), DT, backend)
            return after, after.q

        return jax.lax.scan(tick, ArmState(q, jnp.zeros_like(q)), torque)[1]

    return jit_for(backend, one)(jnp.asarray(arm.home, dtype))


def c_rollout(arm, steps):
    model, data = arm.model, mujoco.MjData(arm.model)
    model.opt.timestep = DT
    data.qpos[:] = arm.home
    path = []
    for push in wobble(steps):
        data.qfrc_applied[:] = damped(jnp.asarray(data.qvel), push)
        mujoco.mj_step(model, data)
        path.append(data.qpos.copy())
    return np.array(path)


def test_two_seconds_the_same_by_all(ur5, dtype):
    expected = c_rollout(ur5, 1000)
    assert np.max(np.abs(expected - ur5.home)) > 0.5  # it does move
    atol = 1e-4 if dtype == jnp.float32 else 1e-9
    folded = rollout(ur5, "folded", dtype, 1000)
    assert folded.dtype == dtype
    np.testing.assert_allclose(folded, expected, rtol=0, atol=atol)


@pytest.mark.slow
def test_two_seconds_the_same_by_mjx(ur5, dtype):
    expected = c_rollout(ur5, 1000)
    mjx = rollout(ur5, "mjx", dtype, 1000)
    assert mjx.dtype == dtype
    np.testing.assert_allclose(mjx, expected, rtol=0, atol=1e-4 if dtype == jnp.float32 else 1e-9)


def test_one_step_is_semi_implicit(arm):
    """The new speed moves the arm, not the old one."""
    q, qd = jnp.asarray(arm.home), jnp.asarray([0.1, 0.2, -0.3, 0.4, 0.5, -0.6])
    after = step(arm, ArmState(q, qd), jnp.ones(6), 0.01)
    np.testing.assert_allclose(after.q, q + 0.01 * after.qd, atol=1e-15)
    assert float(jnp.max(jnp.abs(after.qd - qd))) > 1e-3


def test_damping_is_implicit_as_in_mujoco(ur5):
    model = random_model(6, seed=8)
    model.opt.timestep = 0.01
    other = replace(ur5, model=model, chain=chain_from_mujoco(model))
    data = mujoco.MjData(model)
    q, qd, tau = np.full(6, 0.3), np.full(6, -2.0), np.arange(6.0)
    data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, qd, tau
    mujoco.mj_step(model, data)
    after = step(other, ArmState(jnp.asarray(q), jnp.asarray(qd)), jnp.asarray(tau), 0.01)
    np.testing.assert_allclose(after.qd, data.qvel, rtol=1e-10)
    np.testing.assert_allclose(after.q, data.qpos, rtol=1e-10)


def test_torques_are_cut_openly(ur5, dtype):
    tau, cut = limit_torque(ur5, jnp.asarray([200.0, -200.0, 150.0, 28.1, -28.1, 0.0], dtype))
    assert tau.tolist() == [150, -150, 150, 28, -28, 0]
    assert cut.tolist() == [True, True, False, True, True, False]
    assert tau.dtype == dtype


def test_step_does_not_cut(ur5):
    state = ArmState(jnp.asarray(ur5.home), jnp.zeros(6))
    big, small = (step(ur5, state, jnp.full(6, k), DT).qd for k in (1000.0, 500.0))
    rest = step(ur5, state, jnp.zeros(6), DT).qd
    np.testing.assert_allclose(big - rest, 2 * (small - rest), rtol=1e-9)


def test_jit_for_carries_the_option(monkeypatch):
    seen = {}

    def fake(f, **options):
        seen.update(options)
        return f

    def f(x):
        return 2 * x + 1

    monkeypatch.setattr(jax, "jit", fake)
    jit_for("mjx", f, static_argnums=0)
    assert seen == {"static_argnums": 0, "compiler_options": {"xla_cpu_use_fusion_emitters": False}}
    seen.clear()
    jit_for("folded", f)
    assert seen == {}


@pytest.mark.parametrize("backend", ["folded", "mjx"])
def test_jit_for_within_other_transformations(backend):
    """JAX refuses compiler options anywhere but at the outermost jit: ours steps aside."""
    f = jit_for(backend, lambda x: x**3)
    x = jnp.asarray(2.0)
    assert float(f(x)) == 8.0
    assert float(jax.jit(lambda x: f(x) + 1)(x)) == 9.0
    assert float(jax.grad(f)(x)) == 12.0
    assert float(jit_for(backend, jax.grad(f))(x)) == 12.0
    assert jax.vmap(f)(jnp.asarray([1.0, 2.0])).tolist() == [1.0, 8.0]


def test_jit_for_compiles_once():
    traces = []

    def f(x):
        traces.append(x)
        return 2 * x

    g = jit_for("mjx", f)
    assert float(g(jnp.asarray(1.0)) + g(jnp.asarray(2.0))) == 6.0
    assert len(traces) == 1


def test_unknown_backend(ur5):
    q = jnp.zeros(6)
    with pytest.raises(ValueError, match=r"'gpu' is not known; accepted: folded, mjx"):
        step(ur5, ArmState(q, q), q, DT, "gpu")
    with pytest.raises(ValueError, match="accepted: folded, mjx"):
        jit_for("gpu", lambda x: x)


def test_gradient_through_a_rollout(ur5):
    """Both modes agree with a central difference over 30 steps."""

    def last(scale):
        def tick(state, push):
            return step(ur5, state, scale * push, DT), None

        start = ArmState(jnp.asarray(ur5.home), jnp.zeros(6))
        return jnp.sum(jax.lax.scan(jax.checkpoint(tick), start, jnp.asarray(wobble(30)))[0].q ** 2)

    x, h = jnp.asarray(1.3), 1e-4
    f = quick_jit(last)
    expected = (f(x + h) - f(x - h)) / (2 * h)
    assert abs(float(expected)) > 1e-6
    np.testing.assert_allclose(quick_jit(jax.grad(last))(x), expected, rtol=1e-6)
    np.testing.assert_allclose(quick_jit(jax.jacfwd(last))(x), expected, rtol=1e-6)
