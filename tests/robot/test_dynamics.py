"""Forces and accelerations against C MuJoCo, and the derivative of the accelerations in both modes."""

from functools import cache, partial

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads
from quick import quick_jit
from random_chain import random_model

from hrcjax.robot import bias_force, chain_from_mujoco, forward_dynamics, inverse_dynamics, load_arm, mass_matrix

STATES = 1000


def mujoco_dynamics(model: mujoco.MjModel, Q, QD, TAU) -> dict[str, np.ndarray]:
    data = mujoco.MjData(model)
    out: dict[str, list[np.ndarray]] = {"M": [], "bias": [], "qdd": [], "friction": []}
    for q, qd, tau in zip(*(np.asarray(v, np.float64) for v in (Q, QD, TAU)), strict=True):
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, qd, tau
        mujoco.mj_forward(model, data)
        M = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, M)
        out["M"].append(M)
        out["bias"].append(data.qfrc_bias.copy())
        out["qdd"].append(data.qacc.copy())
        out["friction"].append(-data.qfrc_passive)
    return {k: np.array(v) for k, v in out.items()}


def worst(value, expected: np.ndarray) -> float:
    """Largest norm of an error, relative to the norm of that state's quantity."""
    flat = lambda x: np.asarray(x, np.float64).reshape(len(expected), -1)  # noqa: E731
    error = np.linalg.norm(flat(value) - flat(expected), axis=1)
    return float(np.max(error / np.linalg.norm(flat(expected), axis=1)))


@cache
def all_of(chain):
    """Every quantity, for a batch of states; the arms compiled once for each precision, random chains eager."""

    def one(q, qd, tau, qdd):
        return {
            "M": mass_matrix(chain, q),
            "bias": bias_force(chain, q, qd),
            "qdd": forward_dynamics(chain, q, qd, tau),
            "tau": inverse_dynamics(chain, q, qd, qdd),
        }

    return quick_jit(jax.vmap(one)) if chain.size == 6 else jax.vmap(one)


@pytest.mark.parametrize("torques", ["of the motors", "of modest accelerations"])
def test_against_mujoco(arm, dtype, torques):
    rng = np.random.default_rng(0)
    Q, QD = rng.uniform(-np.pi, np.pi, (STATES, 6)), rng.uniform(-np.pi, np.pi, (STATES, 6))
    TAU = rng.uniform(-1, 1, (STATES, 6)) * arm.tau_max
    if torques == "of modest accelerations":
        ref = mujoco_dynamics(arm.model, Q, QD, TAU)
        TAU = np.einsum("sij,sj->si", ref["M"], rng.uniform(-1, 1, (STATES, 6)) * arm.qdd_max) + ref["bias"]
    q, qd, tau = (jnp.asarray(v, dtype) for v in (Q, QD, TAU))
    ref = mujoco_dynamics(arm.model, q, qd, tau)
    out = all_of(arm.chain)(q, qd, tau, jnp.asarray(ref["qdd"], dtype))
    assert {v.dtype for v in out.values()} == {dtype}
    tight = 1e-5 if dtype == jnp.float32 else 1e-10
    assert worst(out["M"], ref["M"]) < tight / 10
    assert worst(out["bias"], ref["bias"]) < tight
    assert worst(out["tau"], np.asarray(tau, np.float64)) < (2 * tight)
    # where weight and torque cancel, float32 loses the digits that the wrist's small inertia then asks for
    assert worst(out["qdd"], ref["qdd"]) < (tight if torques == "of the motors" or dtype == jnp.float64 else 1e-3)


@pytest.mark.parametrize("joints", [1, 3, 4, 5, 6, 7])
def test_random_chains_against_mujoco(joints):
    model = random_model(joints, seed=10 + joints)
    chain = chain_from_mujoco(model)
    rng = np.random.default_rng(joints)
    q, qd, tau = (jnp.asarray(rng.normal(size=(20, joints)) * k) for k in (2, 2, 20))
    ref = mujoco_dynamics(model, q, qd, tau)
    out = all_of(chain)(q, qd, tau, jnp.asarray(ref["qdd"]))
    assert np.all(np.asarray(chain.damping) > 0)
    assert worst(out["M"], ref["M"]) < 1e-10
    assert worst(out["bias"], ref["bias"]) < 1e-10
    assert worst(out["qdd"], ref["qdd"]) < 1e-10
    assert worst(out["tau"], np.asarray(tau)) < 1e-10


def test_random_states_one_chain_in_float32():
    model = random_model(3, seed=3)
    chain = chain_from_mujoco(model)
    rng = np.random.default_rng(1)
    q, qd, tau = (jnp.asarray(rng.normal(size=(100, 3)) * k, jnp.float32) for k in (2, 2, 20))
    ref = mujoco_dynamics(model, q, qd, tau)
    out = all_of(chain)(q, qd, tau, jnp.asarray(ref["qdd"], jnp.float32))
    for name in ("M", "bias", "qdd"):
        assert worst(out[name], ref[name]) < 1e-5


SINGULAR = {"stretched": np.zeros(6), "home": np.array([0, -0.5, 0.5, -0.5, -0.5, 0]) * np.pi}


@pytest.mark.parametrize("pose", SINGULAR)
@pytest.mark.parametrize("mode", ["fwd", "rev"])
def test_derivatives_of_the_accelerations(ur5, pose, mode):
    q = jnp.asarray(SINGULAR[pose])
    qd = jnp.asarray([0.3, -1.0, 0.5, 0.2, -0.7, 1.1])
    tau = jnp.asarray([1.0, -20.0, 5.0, 0.3, 0.1, 0.01])

    def f(*args):  # check_grads hands NumPy arrays
        return forward_dynamics(ur5.chain, *map(jnp.asarray, args))

    check_grads(f, (q, qd, tau), order=1, modes=(mode,), rtol=2e-3, eps=1e-6)


def test_derivatives_against_those_of_a_general_solve():
    """With damping and armature, where neither is nought."""
    model = random_model(3, seed=5)
    chain = chain_from_mujoco(model)
    rng = np.random.default_rng(2)
    q, qd, tau = (jnp.asarray(rng.normal(size=3)) for _ in range(3))

    def plain(q, qd, tau):
        drag = jnp.asarray(chain.damping) * qd
        return jnp.linalg.solve(mass_matrix(chain, q), tau - bias_force(chain, q, qd) - drag)

    ours, theirs = (jax.jacfwd(f, argnums=(0, 1, 2))(q, qd, tau) for f in (partial(forward_dynamics, chain), plain))
    back = jax.jacrev(partial(forward_dynamics, chain), argnums=(0, 1, 2))(q, qd, tau)
    for a, b, c in zip(ours, theirs, back, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(c, b, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_second_derivative():
    model = random_model(3, seed=6)
    chain = chain_from_mujoco(model)
    q, qd, tau = (jnp.asarray(v) for v in ([0.3, -0.2, 1.0], [1.0, 0.5, -0.4], [2.0, 1.0, 0.5]))

    def f(*args):
        return jnp.sum(jnp.sin(forward_dynamics(chain, *map(jnp.asarray, args), tau)))

    check_grads(f, (q, qd), order=2, rtol=1e-3, eps=1e-5)


UR5 = load_arm("ur5")
POSE = st.lists(st.floats(-3, 3, width=32), min_size=6, max_size=6).map(np.array)


@quick_jit
def _laws(q, qd, qdd):
    chain = UR5.chain
    M = mass_matrix(chain, q)
    tau = inverse_dynamics(chain, q, qd, qdd)
    power = jax.jvp(lambda q: 0.5 * qd @ mass_matrix(chain, q) @ qd, (q,), (qd,))[1]
    weight = bias_force(chain, q, jnp.zeros(6))
    return {
        "M": M,
        "round trip": forward_dynamics(chain, q, qd, tau) - qdd,
        "work": qd @ (bias_force(chain, q, qd) - weight)
        - power,  # Coriolis forces do the work that M's change asks for
        "first": mass_matrix(chain, q.at[0].add(1.0)) - M,
    }


@settings(max_examples=30, deadline=None)
@given(POSE, POSE, POSE)
def test_laws(q, qd, qdd):
    out = _laws(jnp.asarray(q), jnp.asarray(qd), jnp.asarray(qdd))
    M = np.asarray(out["M"])
    np.testing.assert_array_equal(M, M.T)
    assert np.linalg.eigvalsh(M)[0] > 0
    np.testing.assert_allclose(out["round trip"], 0, atol=1e-7)
    np.testing.assert_allclose(out["work"], 0, atol=1e-9)
    np.testing.assert_allclose(out["first"], 0, atol=1e-12)


def test_wrong_shapes(ur5):
    q = jnp.zeros(6)
    calls = {
        "q": lambda: mass_matrix(ur5.chain, q[:5]),
        "qd": lambda: bias_force(ur5.chain, q, q[:5]),
        "qdd": lambda: inverse_dynamics(ur5.chain, q, q, q[:5]),
        "tau": lambda: forward_dynamics(ur5.chain, q, q, q[:5]),
    }
    for name, call in calls.items():
        # the shape checker of the tests may speak before the function does
        with pytest.raises(Exception, match=rf"{name} has shape|Type-check"):
            call()
    with pytest.raises(ValueError, match=r"q has shape \(5,\); accepted: \(6,\)"):
        forward_dynamics(ur5.chain, q[:5], q[:5], q[:5])
