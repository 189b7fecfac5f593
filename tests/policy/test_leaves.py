"""Leaves: against the plain NumPy policy, closed forms, and finite differences where they could break."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads as _check_grads

from hrcjax.policy import (
    CollisionParams,
    DampingParams,
    JointLimitParams,
    PostureParams,
    SpeedCapParams,
    TargetParams,
    collision,
    damping,
    joint_limit,
    posture,
    speed_cap,
    target,
    to_goals,
)
from hrcjax.reference import policy as serial

reals = st.floats(-2.0, 2.0, allow_subnormal=False)
vectors = st.tuples(reals, reals, reals).map(np.array)
few = settings(deadline=None, max_examples=30)
zero = jnp.zeros(3, jnp.float64)


def other(params):
    """The same kind of parameters with every number changed, so that a swapped or forgotten one shows."""
    fields = dataclasses.fields(params)
    return dataclasses.replace(
        params, **{f.name: getattr(params, f.name) * (0.9 - 0.05 * i) + 0.01 for i, f in enumerate(fields)}
    )


def close(ours, theirs, rtol=1e-12, atol=1e-13):
    for one, another in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(np.asarray(one), another, rtol=rtol, atol=atol)


def check_grads(f, arguments, order, **settings):
    """Forward and reverse derivatives against finite differences; these hand over NumPy arrays."""
    _check_grads(jax.jit(f), arguments, order, **settings)


def x_(v, dtype=jnp.float64):
    return jnp.asarray(v, dtype)


# ---------------------------------------------------------------- target


@given(vectors, vectors, vectors, vectors, vectors, st.sampled_from([1.0, 0.02]))
@few
def test_target_agrees_with_numpy(x, xd, goal, goal_velocity, goal_acceleration, scale):
    goal = x + scale * goal  # far and near: both sides of the ramp
    for params in (TargetParams(), other(TargetParams())):
        arguments = (x, xd, goal, goal_velocity, goal_acceleration)
        close(target(params, *map(x_, arguments)), serial.target(params, *arguments))


def test_target_closed_forms(dtype):
    p = TargetParams()
    zero, e = x_([0, 0, 0], dtype), x_([1, 0, 0], dtype)
    M, a = target(p, zero, zero, e, zero, zero)
    tol = 1e-6
    np.testing.assert_allclose(a, [0.5 / 1.075, 0, 0], rtol=tol)  # kp n / (n + eps)
    np.testing.assert_allclose(M, np.diag([0.03 * 1.5 + 0.97 * 0.2, 0.045, 0.045]), rtol=tol)
    M, a = target(p, zero, e, zero, zero, zero)
    np.testing.assert_allclose(a, [-1, 0, 0], rtol=tol)
    np.testing.assert_allclose(M, 1.5 * np.eye(3), rtol=tol)
    _, a = target(p, zero, zero, 0.02 * e, zero, zero)
    np.testing.assert_allclose(a, [0.4 * 0.5 * 0.02 / 0.095, 0, 0], rtol=tol)
    M, _ = target(p, zero, zero, 0.05 * e, zero, zero)  # one length: w = .97 exp(-1/2) + .03
    w = 0.97 * np.exp(-0.5) + 0.03
    np.testing.assert_allclose(M[1, 1], 1.5 * w, rtol=tol)
    np.testing.assert_allclose(M[0, 0], 1.5 * w + 0.2 * (1 - w), rtol=tol)
    assert M.dtype == a.dtype == dtype


def test_target_on_a_moving_goal_stays_on_it():
    x, v, acceleration = x_([0.1, 0.2, 0.3]), x_([0.4, -0.5, 0.6]), x_([-1.0, 2.0, 3.0])
    _, a = target(TargetParams(), x, v, x, v, acceleration)
    np.testing.assert_allclose(a, acceleration, atol=1e-15)


@pytest.mark.parametrize("offset", [0.0, 1e-9, 1e-4, 0.01, 0.3])
def test_target_derivatives_near_the_goal(offset):
    goal = x_([0.3, -0.2, 0.5])
    x = goal + offset * x_([0.6, 0.0, -0.8])

    def leaf(x, xd, goal, velocity, acceleration, params):
        return target(params, x, xd, goal, velocity, acceleration)

    params = jax.tree.map(x_, TargetParams())
    step = 1e-6 if offset > 1e-3 or offset == 0 else 1e-8
    check_grads(leaf, (x, zero + 0.1, goal, zero, zero, params), 1, eps=step, atol=2e-3, rtol=1e-4)
    for derivative in (jax.jacfwd, jax.jacrev):
        arguments = jax.tree.map(lambda v: v.astype(jnp.float32), (x, zero, goal, zero, zero, params))
        out = derivative(leaf, argnums=(0, 5))(*arguments)
        assert all(bool(jnp.isfinite(part).all()) for part in jax.tree.leaves(out))


def test_orientation_has_a_share_of_the_metric_of_the_position(dtype):
    rng = np.random.default_rng(0)
    x, xd, goal, v, acc = (x_(rng.normal(size=(3, 3)), dtype) for _ in range(5))
    p = TargetParams(orientation_weight=0.2)
    M, a = to_goals(p, x, xd, goal, v, acc)
    for i, share in enumerate((1.0, 0.2, 0.2)):
        M_one, a_one = target(p, x[i], xd[i], goal[i], v[i], acc[i])
        np.testing.assert_allclose(M[i], share * M_one, rtol=1e-6)
        np.testing.assert_array_equal(a[i], a_one)
    close((M, a), serial.to_goals(p, *map(np.asarray, (x, xd, goal, v, acc))), rtol=1e-5, atol=1e-6)
    assert M.dtype == dtype


# ---------------------------------------------------------------- collision


@given(st.floats(-0.2, 0.6), vectors, vectors)
@few
def test_collision_agrees_with_numpy(d, g, xd):
    for params in (CollisionParams(), other(CollisionParams()), CollisionParams(isotropy=0.0, margin=0.05), PAPER):
        close(collision(params, x_(d), x_(g), x_(xd)), serial.collision(params, d, g, xd))


PAPER = CollisionParams(k_rep=0.8, k_damp=0.8, v_gate=0.5, isotropy=1.0)


def test_collision_closed_forms(dtype):
    g, still = x_([0, 0, 1], dtype), x_([0, 0, 0], dtype)
    M, a = collision(PAPER, x_(0.1, dtype), g, still)
    np.testing.assert_allclose(a, [0, 0, 0.8 / np.e], rtol=1e-6)
    np.testing.assert_allclose(M, 3 / 2 * (0.3 / np.hypot(0.1, 0.01) - 1) ** 2 * np.eye(3), rtol=1e-6)
    xd = x_([1, 0, -0.5], dtype)  # approaching at 0.5 m/s: gate = sigmoid(1)
    damped = dataclasses.replace(PAPER, k_rep=0.0)
    _, a = collision(damped, x_(0.1, dtype), g, xd)
    np.testing.assert_allclose(a, -0.8 / 1.2 / (1 + np.exp(-1)) * np.asarray(xd), rtol=1e-6)
    _, a = collision(dataclasses.replace(damped, isotropy=0.0), x_(0.1, dtype), g, xd)
    np.testing.assert_allclose(a, [0, 0, 0.5 * 0.8 / 1.2 / (1 + np.exp(-1))], rtol=1e-6)
    M, _ = collision(CollisionParams(isotropy=0.0), x_(0.0, dtype), g, still)
    np.testing.assert_allclose(M, np.diag([0.0, 0, 3 / 2 * 29**2]), rtol=1e-5)
    M, a = collision(CollisionParams(), x_(0.31, dtype), g, xd)
    np.testing.assert_array_equal(M, 0)
    assert M.dtype == a.dtype == dtype


def test_collision_metric_grows_towards_contact_and_fades_with_recession(dtype):
    """Nothing outweighs an obstacle at the skin; nothing is held that leaves it, or that moves along it."""
    g, n = x_([0, 0, 1], dtype), CollisionParams(r_act=0.15)
    along = [
        collision(n, x_(d, dtype), g, x_([0, 0, -0.1], dtype))[0] for d in (-0.05, 0.0, 0.01, 0.03, 0.06, 0.1, 0.149)
    ]
    metric = [float(M[2, 2]) for M in along]
    assert metric[0] == metric[1] and (np.diff(metric[1:]) < 0).all() and metric[-1] < 1e-3
    assert metric[1] > 30 * 10.0, "over that of a target of 10"
    for M in along:
        np.testing.assert_allclose(M[0, 0], n.isotropy * M[2, 2], rtol=1e-6)
    approach, still, recede = (
        float(collision(n, x_(0.03, dtype), g, x_([0, 0, v], dtype))[0][2, 2]) for v in (-1, 0, 1)
    )
    assert approach > 1.9 * still and recede < 0.02 * still
    _, a = collision(n, x_(0.03, dtype), g, x_([1.0, 0, 0], dtype))
    assert abs(float(a[0])) < 0.5, "motion along a surface is hardly braked"


def test_collision_takes_a_tool_of_1_m_per_s_away_before_contact():
    """By itself, at the rate of the control: from r_act straight at the surface."""
    for r_act in (0.15, 0.3):
        n, d, v, dt = CollisionParams(r_act=r_act), r_act, -1.0, 0.008
        leaf = jax.jit(lambda d, v, n=n: collision(n, d, x_([0, 0, 1]), v * x_([0, 0, 1]))[1][2])
        least = d
        for _ in range(200):
            v = v + float(leaf(x_(d), x_(v))) * dt
            d, least = d + v * dt, min(least, d)
        assert 0.0 < least < r_act, least


def test_collision_gate_does_not_depend_on_the_frame():
    g, xd = x_([0.6, 0.0, 0.8]), x_([0.3, -0.2, -0.5])
    turn, _ = jnp.linalg.qr(jax.random.normal(jax.random.key(0), (3, 3), jnp.float64))
    params = CollisionParams(isotropy=0.3)
    M, a = collision(params, x_(0.1), g, xd)
    M_turned, a_turned = collision(params, x_(0.1), turn @ g, turn @ xd)
    close((M_turned, a_turned), (turn @ M @ turn.T, turn @ a))


@pytest.mark.parametrize("d", [-0.1, 1e-9, 0.1, 0.3 - 1e-9, 0.3 + 1e-9, 5.0])
@pytest.mark.parametrize("still", [True, False])
def test_collision_derivatives(d, still):
    g = x_([0.6, 0.0, 0.8])
    xd = zero if still else x_([0.1, 0.4, -0.3])
    params = jax.tree.map(x_, CollisionParams(margin=-1e-3 if d == 1e-9 else 0.0))

    def leaf(d, g, xd, params):
        M, a = collision(params, d, g, xd)
        return M / 100, a  # at contact the metric is large

    check_grads(leaf, (x_(d), g, xd, params), 1, eps=1e-6, atol=1e-4, rtol=1e-4)
    for part in jax.tree.leaves(jax.jacrev(leaf, argnums=(0, 1, 2, 3))(x_(d), g, xd, params)):
        assert bool(jnp.isfinite(part).all())


# ---------------------------------------------------------------- joints


@given(st.floats(-0.1, 3.0), st.floats(-2.0, 2.0))
@few
def test_joint_leaves_agree_with_numpy(x, xd):
    for params in (JointLimitParams(), other(JointLimitParams())):
        close(joint_limit(params, x_(x), x_(xd)), serial.joint_limit(params, x, xd), rtol=1e-9, atol=1e-13)
    for cap in (SpeedCapParams(), other(SpeedCapParams())):
        close(speed_cap(cap, x_(xd)), serial.speed_cap(cap, xd))
    for drag in (DampingParams(), other(DampingParams())):
        close(damping(drag, x_(xd)), serial.damping(drag, xd))


@given(vectors, vectors, vectors)
@few
def test_posture_agrees_with_numpy(q, qd, goal):
    for params in (PostureParams(weight=0.005), other(PostureParams(weight=0.005))):
        for near in (1.0, 0.05):
            weight, a = serial.posture(params, q, qd, q + near * goal)
            close(posture(params, x_(q), x_(qd), x_(q + near * goal)), (np.full(3, weight), a), atol=1e-10)


def test_joint_limit_closed_forms(dtype):
    p = JointLimitParams()
    M, a = joint_limit(p, x_(0.1, dtype), x_(0.0, dtype))
    np.testing.assert_allclose((M, a), (0.5 * 0.1 / 10.001, 1 / 1.01), rtol=1e-6)
    M, a = joint_limit(p, x_(0.0, dtype), x_(-0.01, dtype))
    np.testing.assert_allclose((M, a), (100 / (1 + np.exp(-1)), 102.0), rtol=1e-5)
    M_beyond, a_beyond = joint_limit(p, x_(-3.0, dtype), x_(-0.01, dtype))
    assert M_beyond == M and a_beyond == a  # finite beyond the limit, and no weaker
    M_away, _ = joint_limit(p, x_(0.0, dtype), x_(1.0, dtype))
    assert M_away < 1e-6 * M
    assert M.dtype == a.dtype == dtype


def test_speed_cap_closed_forms(dtype):
    p = SpeedCapParams()
    for sign in (-1.0, 1.0):
        M, a = speed_cap(p, x_(sign * 1.625, dtype))  # half way through the band
        np.testing.assert_allclose((M, a), (0.05 / 0.75, -sign * 1.5 * 0.075), rtol=1e-5)
        M, a = speed_cap(p, x_(sign * 5.0, dtype))
        np.testing.assert_allclose((M, a), (0.05 / (1 - 0.99**2), -sign * 1.5 * 3.45), rtol=1e-5)
        assert M.dtype == a.dtype == dtype
    M, a = speed_cap(p, x_(1.54, dtype))
    assert M == 0 and a == 0


def test_damping_and_posture_defaults(dtype):
    M, a = damping(DampingParams(), x_(0.5, dtype))
    np.testing.assert_allclose((M, a), (0.005, -0.5), rtol=1e-6)
    q = x_([1.0, 0.0], dtype)
    m, a = posture(PostureParams(), q, x_([0.0, 0.1], dtype), x_([0.0, 0.0], dtype))
    np.testing.assert_allclose(a, [-50.0, -5.0], rtol=1e-6)
    np.testing.assert_array_equal(m, 0)
    assert m.dtype == a.dtype == dtype


@pytest.mark.parametrize(("x", "xd"), [(1.0, 0.0), (0.1, -0.02), (0.001, -0.005), (-0.5, 0.003), (0.0, 0.0)])
def test_joint_limit_derivatives(x, xd):
    params = jax.tree.map(x_, JointLimitParams())
    if x != 0.0:
        check_grads(lambda x, xd, p: joint_limit(p, x, xd), (x_(x), x_(xd), params), 1, eps=1e-7, rtol=1e-4)
    check_grads(lambda xd, p: joint_limit(p, x_(x), xd), (x_(xd), params), 1, eps=1e-7, rtol=1e-4)


@pytest.mark.parametrize("qd", [0.0, 1.0, 1.6, -1.69, 3.0, -4.0])
def test_speed_cap_derivatives(qd):
    params = jax.tree.map(x_, SpeedCapParams())
    check_grads(lambda v, p: speed_cap(p, v), (x_(qd), params), 1, eps=1e-7, atol=1e-5, rtol=1e-5)
    check_grads(lambda v, p: damping(p, v), (x_(qd), jax.tree.map(x_, DampingParams())), 1, eps=1e-6)


@pytest.mark.parametrize("distance", [0.0, 0.2, 2.0])
def test_posture_derivatives(distance):
    params = jax.tree.map(x_, PostureParams(weight=0.1))
    goal = x_([0.1, 0.2, 0.3])
    q = goal + distance * x_([0.6, 0.0, 0.8])
    check_grads(lambda q, v, g, p: posture(p, q, v, g), (q, zero, goal, params), 1, eps=1e-6, rtol=1e-5)
