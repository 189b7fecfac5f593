"""Inverse kinematics: round trips, the analytic solution, and the error of a rotation against SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from quick import quick_jit
from scipy.spatial.transform import Rotation

from hrcjax.robot import inverse_kinematics, load_arm, tool_frame
from hrcjax.robot.ik import rotation_error


def test_rotation_error_against_scipy(dtype):
    rng = np.random.default_rng(0)
    A = Rotation.random(200, rng=0)
    size = np.concatenate([rng.uniform(0, np.pi, 190), [0, 1e-6, 1e-3, 3.1, 3.14, np.pi - 1e-4, 2.0, 1.0, 0.5, 1e-4]])
    axis = rng.normal(size=(200, 3))
    v = axis / np.linalg.norm(axis, axis=1, keepdims=True) * size[:, None]
    B = Rotation.from_rotvec(v) * A
    to, fro = (jnp.asarray(r.as_matrix(), dtype) for r in (B, A))
    found = np.asarray(quick_jit(jax.vmap(rotation_error))(to, fro), np.float64)
    assert found.shape == (200, 3)
    np.testing.assert_allclose(found, v, atol=3e-6 if dtype == jnp.float32 else 1e-9)


def test_half_a_turn():
    for axis in np.eye(3):
        v = rotation_error(jnp.asarray(Rotation.from_rotvec(np.pi * axis).as_matrix()), jnp.eye(3))
        np.testing.assert_allclose(np.abs(v), np.pi * axis, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.5])
def test_rotation_error_derivative(angle):
    """Finite and right, also where the two agree."""
    R = jnp.asarray(Rotation.from_rotvec([0, angle, 0]).as_matrix())

    def turned(v):
        K = jnp.stack(
            [jnp.stack([0 * v[0], -v[2], v[1]]), jnp.stack([v[2], 0 * v[0], -v[0]]), jnp.stack([-v[1], v[0], 0 * v[0]])]
        )
        return rotation_error(R, jnp.eye(3) + K)

    J = quick_jit(jax.jacfwd(turned))(jnp.zeros(3))
    assert np.all(np.isfinite(J))
    if angle == 0.0:
        np.testing.assert_allclose(J, -np.eye(3), atol=1e-9)
    else:
        f, h = quick_jit(turned), 1e-6
        differences = [(f(h * e) - f(-h * e)) / (2 * h) for e in jnp.eye(3)]
        np.testing.assert_allclose(J, np.stack(differences, axis=1), atol=1e-6)
        np.testing.assert_allclose(quick_jit(jax.jacrev(turned))(jnp.zeros(3)), J, atol=1e-12)


def test_round_trip(ur5, dtype):
    arm = ur5
    rng = np.random.default_rng(1)
    count = 64
    Q = rng.uniform(-2.5, 2.5, (count, 6))
    guess = Q + rng.uniform(-0.3, 0.3, (count, 6))

    def one(q, g):
        R, p = tool_frame(arm, q)
        found, position, rotation = inverse_kinematics(arm, R, p, g)
        R2, p2 = tool_frame(arm, found)
        return found, position, rotation, jnp.max(jnp.abs(p2 - p)), jnp.max(jnp.abs(R2 - R))

    found, position, rotation, dp, dR = quick_jit(jax.vmap(one))(jnp.asarray(Q, dtype), jnp.asarray(guess, dtype))
    assert found.dtype == position.dtype == rotation.dtype == dtype
    loose = 2e-5 if dtype == jnp.float32 else 1e-8
    good = np.asarray(position < loose)
    assert good.mean() >= 0.97
    assert np.max(np.asarray(dp)[good]) < 2 * loose
    assert np.max(np.asarray(dR)[good]) < 5 * loose
    assert np.max(np.asarray(rotation)[good]) < 5 * loose


def test_against_the_analytic_solutions():
    library = pytest.importorskip("ur_analytic_ik")
    arm = load_arm("ur5")
    solve = quick_jit(lambda R, p, g: inverse_kinematics(arm, R, p, g))
    rng = np.random.default_rng(2)
    for _ in range(5):
        q = rng.uniform(-2, 2, 6)
        T = library.ur5.forward_kinematics(*q)
        solutions = np.array(library.ur5.inverse_kinematics(np.ascontiguousarray(T)))
        start = solutions[np.argmin(np.abs(solutions - q).sum(axis=1))] + rng.uniform(-0.1, 0.1, 6)
        found, position, _ = solve(jnp.asarray(T[:3, :3]), jnp.asarray(T[:3, 3]), jnp.asarray(start))
        assert float(position) < 1e-7
        turn = (np.asarray(found) - solutions + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(turn).max(axis=1).min() < 1e-5


def test_out_of_reach_says_so(ur5):
    found, position, rotation = quick_jit(lambda p: inverse_kinematics(ur5, jnp.eye(3), p, jnp.asarray(ur5.home)))(
        jnp.asarray([2.0, 0.0, 0.3])
    )
    assert np.all(np.isfinite(found))
    assert 0.8 < float(position) < 1.4  # the arm reaches some 0.95 m
    R, p = tool_frame(ur5, found)
    np.testing.assert_allclose(np.linalg.norm(np.asarray(p) - [2.0, 0.0, 0.3]), position, rtol=1e-9)
    np.testing.assert_allclose(Rotation.from_matrix(np.asarray(R)).magnitude(), rotation, atol=1e-6)


def test_iterations_count(ur5):
    goal = tool_frame(ur5, jnp.asarray(ur5.home) + 0.4)
    errors = [float(inverse_kinematics(ur5, *goal, jnp.asarray(ur5.home), iterations=n)[1]) for n in (1, 4)]
    assert errors[0] > 4 * errors[1]


@pytest.mark.slow
def test_gradient_is_finite_at_the_singular_arm(ur5):
    q = jnp.zeros(6)

    def found(p):
        R, _ = tool_frame(ur5, q)
        return jnp.sum(inverse_kinematics(ur5, R, p, q, iterations=5)[0])

    _, p = tool_frame(ur5, q)
    for shift in (0.0, -0.01):
        assert np.all(np.isfinite(quick_jit(jax.grad(found))(p + shift)))
