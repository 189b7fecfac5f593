"""Pullback: against its definition by automatic differentiation, and the laws it must obey."""

import inspect

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcjax.policy import Pulled, add, pull, pullback, pullback_joints, pullback_points

seeds = st.integers(0, 2**31 - 1)
few = settings(deadline=None, max_examples=20)
pullback_once, pullback_all = jax.jit(pullback), jax.jit(pullback_points)


def curved(q):
    """A map of 4 joints to 3 coordinates, curved so that Jd_qd counts."""
    return jnp.stack([jnp.sin(q[0]) * q[1], q[1] * q[2] + 0.3 * q[3] ** 2, jnp.cos(q[2] + q[0])])


def onward(x):
    """A map of 3 coordinates to 2."""
    return jnp.stack([x[0] * x[1], jnp.sin(x[2]) + x[0] ** 2])


def leaf_of(size, seed):
    """A leaf that depends on x and xd, with a symmetric metric."""
    root = jax.random.normal(jax.random.key(seed), (size, size), jnp.float64)

    def leaf(x, xd):
        root_at = root * (1 + x[:, None] ** 2)
        return root_at @ root_at.T, jnp.tanh(root @ xd) - root.T @ x

    return leaf


def state(seed, joints=4):
    return jnp.asarray(np.random.default_rng(seed).normal(size=(2, joints)))


def random_task(seed, points=None):
    rng = np.random.default_rng(seed)
    batch = () if points is None else (points,)
    root = rng.normal(size=(*batch, 3, 3))
    J, Jd_qd, a = (rng.normal(size=(*batch, *shape)) for shape in ((3, 4), (3,), (3,)))
    return J, Jd_qd, root @ np.swapaxes(root, -1, -2), a


@jax.jit
def sum_of_leaves(q, qd):
    one, other = leaf_of(3, 1), leaf_of(3, 2)

    def both(x, xd):
        (M1, a1), (M2, a2) = one(x, xd), other(x, xd)
        return M1 + M2, jnp.linalg.solve(M1 + M2, M1 @ a1 + M2 @ a2)

    return pull(curved, both, q, qd), add(pull(curved, one, q, qd), pull(curved, other, q, qd))


@jax.jit
def chain_of_maps(q, qd):
    leaf = leaf_of(2, 3)
    direct = pull(lambda q: onward(curved(q)), leaf, q, qd)
    x, xd = jax.jvp(curved, (q,), (qd,))
    middle = pull(onward, leaf, x, xd)
    J = jax.jacfwd(curved)(q)
    Jd_qd = jax.jvp(lambda q: jax.jvp(curved, (q,), (qd,))[1], (q,), (qd,))[1]
    return direct, Pulled(J.T @ middle.M @ J, J.T @ (middle.f - middle.M @ Jd_qd))


@jax.jit
def turned_frame(q, qd, turn):
    leaf = leaf_of(3, 4)

    def turned(y, yd):
        M, a = leaf(turn.T @ y, turn.T @ yd)
        return turn @ M @ turn.T, turn @ a

    return pull(curved, leaf, q, qd), pull(lambda q: turn @ curved(q), turned, q, qd)


def close(one: Pulled, other: Pulled, tol=1e-10):
    np.testing.assert_allclose(one.M, other.M, rtol=tol, atol=tol)
    np.testing.assert_allclose(one.f, other.f, rtol=tol, atol=tol)


@given(seeds)
@few
def test_definition(seed):
    J, Jd_qd, M, a = random_task(seed)
    got = pullback_once(*map(jnp.asarray, (J, Jd_qd, M, a)))
    np.testing.assert_allclose(got.M, J.T @ M @ J, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(got.f, J.T @ M @ (a - Jd_qd), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(got.M, got.M.T, rtol=1e-14, atol=1e-14)
    assert np.linalg.eigvalsh(got.M).min() > -1e-10 * np.abs(got.M).max()


@given(seeds)
@few
def test_points_sum(seed):
    J, Jd_qd, M, a = map(jnp.asarray, random_task(seed, points=5))
    total = pullback_once(J[0], Jd_qd[0], M[0], a[0])
    for k in range(1, 5):
        total = add(total, pullback_once(J[k], Jd_qd[k], M[k], a[k]))
    close(pullback_all(J, Jd_qd, M, a), total)


def test_acceleration_along_a_curve_is_matched():
    """On x = (cos q, sin q) the centripetal part is Jd_qd: only what remains of it is asked of the joint."""
    q, qd = jnp.array([0.0]), jnp.array([2.0])

    def circle(q):
        return jnp.stack([jnp.cos(q[0]), jnp.sin(q[0])])

    def leaf(x, xd):
        np.testing.assert_allclose((x, xd), ([1.0, 0.0], [0.0, 2.0]), atol=1e-15)
        return jnp.array([[2.0, 0.5], [0.5, 1.0]]), jnp.array([-4.0, 3.0])

    got = pull(circle, leaf, q, qd)  # J = (0, 1), Jd_qd = (-4, 0)
    np.testing.assert_allclose(got.M, [[1.0]])
    np.testing.assert_allclose(got.f, [3.0])


@given(seeds)
@few
def test_sum_of_leaves_is_sum_of_pullbacks(seed):
    close(*sum_of_leaves(*state(seed)), 1e-7)


@given(seeds)
@few
def test_chain_of_maps_is_map_of_chain(seed):
    close(*chain_of_maps(*state(seed)))


@given(seeds)
@few
def test_a_turned_task_frame_changes_nothing(seed):
    turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    close(*turned_frame(*state(seed), jnp.asarray(turn)))


def test_joints():
    got = pullback_joints(jnp.array([1.0, 2.0]), jnp.array([3.0, -4.0]))
    np.testing.assert_array_equal(got.M, [[1, 0], [0, 2]])
    np.testing.assert_array_equal(got.f, [3, -8])


def test_follows_dtype_jit_and_vmap(dtype):
    J, Jd_qd, M, a = (jnp.asarray(part, dtype) for part in random_task(0, points=5))
    one = [pullback_once(J[k], Jd_qd[k], M[k], a[k]) for k in range(5)]
    batch = jax.jit(jax.vmap(pullback))(J, Jd_qd, M, a)
    assert batch.M.dtype == batch.f.dtype == dtype
    tol = 1e-4 if dtype == jnp.float32 else 1e-12
    for k in range(5):
        close(one[k], Pulled(batch.M[k], batch.f[k]), tol)


def test_wrong_shapes_are_named():
    J, Jd_qd, M, a = map(jnp.asarray, random_task(0, points=5))
    for wrong in ((J, Jd_qd[:4], M, a), (J, Jd_qd, M[:, :2], a), (J, Jd_qd, M, a[:, :2])):
        with pytest.raises(ValueError, match=r"J \(5, 3, 4\) wants"):
            inspect.unwrap(pullback_points)(*wrong)  # without the check of types


def test_derivatives_of_many_points():
    """Those written by hand against those of the definition, for J, the metric, Jd_qd and a, in both modes."""
    J, Jd_qd, M, a = (jnp.asarray(x) for x in random_task(5, points=3))
    down, across = jnp.asarray(np.random.default_rng(6).normal(size=(2, 4, 4)))

    def measure(pulled):
        return jnp.sum(across * pulled.M) + jnp.sum(down[0] * pulled.f)

    def by_hand(J, Jd_qd, root, a):
        return measure(pullback_points(J, Jd_qd, M + root + jnp.swapaxes(root, -1, -2), a))

    def by_definition(J, Jd_qd, root, a):
        metric = M + root + jnp.swapaxes(root, -1, -2)
        W = jnp.einsum("ptu,puj->ptj", metric, J)
        M_q, f_q = jnp.einsum("pti,ptj->ij", J, W), jnp.einsum("ptj,pt->j", W, a - Jd_qd)
        return jnp.sum(across * M_q) + jnp.sum(down[0] * f_q)

    at = (J, Jd_qd, jnp.zeros_like(M), a)
    for mode in (jax.jacrev, jax.jacfwd):
        for got, wanted in zip(
            jax.jit(mode(by_hand, argnums=(0, 1, 2, 3)))(*at),
            jax.jit(jax.grad(by_definition, argnums=(0, 1, 2, 3)))(*at),
            strict=True,
        ):
            np.testing.assert_allclose(got, wanted, rtol=1e-10, atol=1e-12)
