"""Prediction and correction against the textbook's Kalman filter in NumPy."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from hrcjax.body.least_squares import joined
from hrcjax.body.motion import averaged_scatter, corrected, predict, surprise
from hrcjax.body.params import BodyParams
from hrcjax.body.state import KNOWN, PLACES, SHAPE, BodyState, initial_body


def some_state(seed: int = 0) -> BodyState:
    draw = np.random.default_rng(seed)
    n = KNOWN + PLACES
    B = draw.normal(size=(n, n)) * 0.05
    state = initial_body(BodyParams())
    values = (draw.normal(size=(11, 3)), draw.normal(size=(11, 3)), B @ B.T + 0.01 * np.eye(n))
    return eqx.tree_at(
        lambda s: (s.joints, s.speeds, s.covariance), state, tuple(jnp.asarray(v, jnp.float32) for v in values)
    )


def test_prediction_is_that_of_constant_velocity() -> None:
    params, state, dt = BodyParams(), some_state(), 0.04
    after = predict(params, state, dt)
    keep = np.exp(-dt / params.forget)
    F = np.eye(KNOWN + PLACES)
    F[:PLACES, KNOWN:] = dt * np.eye(PLACES)
    F[KNOWN:, KNOWN:] *= keep
    P = F @ np.asarray(state.covariance, float) @ F.T
    a = np.repeat(np.asarray(params.acceleration)[[0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6]], 3)
    push = np.zeros((KNOWN + PLACES, PLACES))
    push[:PLACES] = np.diag(0.5 * a * dt * dt)
    push[KNOWN:] = np.diag(a * dt)
    P = P + push @ push.T
    P[:PLACES, :PLACES] += params.settle**2 * np.eye(PLACES)
    P[PLACES:KNOWN, PLACES:KNOWN] += params.length_drift**2 * dt * np.eye(SHAPE)
    np.testing.assert_allclose(after.covariance, P, atol=1e-5)
    np.testing.assert_allclose(after.joints, state.joints + dt * state.speeds, atol=1e-6)
    np.testing.assert_allclose(after.speeds, float(keep) * state.speeds, atol=1e-6)


def test_correction_is_kalmans_for_a_linear_measurement() -> None:
    state = some_state(1)
    draw = np.random.default_rng(2)
    P = np.asarray(state.covariance, float)
    H = np.zeros((6, KNOWN + PLACES))
    H[:, :KNOWN] = draw.normal(size=(6, KNOWN))
    R = 0.01 * np.eye(6)
    y = draw.normal(size=6) * 0.1
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    expected = P - K @ H @ P
    step = K @ y
    information = np.linalg.inv(P[:KNOWN, :KNOWN])
    after = information + H[:, :KNOWN].T @ np.linalg.inv(R) @ H[:, :KNOWN]
    known = np.asarray(joined(state.joints, state.lengths, state.radii)) + step[:KNOWN]
    speeds, covariance, _ = corrected(
        state, jnp.asarray(known, jnp.float32), jnp.asarray(information, jnp.float32), jnp.asarray(after, jnp.float32)
    )
    np.testing.assert_allclose(speeds.reshape(-1), np.asarray(state.speeds).reshape(-1) + step[KNOWN:], atol=2e-3)
    np.testing.assert_allclose(covariance, expected, atol=2e-3)


def test_a_joint_that_is_seen_keeps_its_speed() -> None:
    params, state = BodyParams(), some_state(3)
    unseen = jnp.full((10,), jnp.inf).at[jnp.asarray([6, 8])].set(0.0)  # left forearm and hand
    after = predict(params, eqx.tree_at(lambda s: s.unseen, state, unseen), 0.04)
    kept = np.isclose(np.asarray(after.speeds), np.asarray(state.speeds), rtol=1e-6).all(axis=1)
    assert kept.tolist() == [j in (5, 7, 9) for j in range(11)]


@pytest.mark.parametrize("factor", [1.0, 4.0, 25.0])
def test_corrections_of_a_filter_that_is_told_too_much_noise_show_by_how_much(factor: float) -> None:
    """Errors drawn from covariances that the filter takes for `factor` times as large."""
    draw = np.random.default_rng(5)
    n = KNOWN + PLACES
    B = draw.normal(size=(n, n)) * 0.01
    P = B @ B.T + 1e-4 * np.eye(n)
    H = np.eye(KNOWN, n)
    R = np.diag(10.0 ** draw.uniform(-4.5, -3.0, KNOWN))
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    after = P - K @ H @ P
    ratios = []
    for _ in range(300):
        error, noise = (draw.multivariate_normal(np.zeros(len(C)), C) / np.sqrt(factor) for C in (P, R))
        moved = (K @ (H @ error + noise))[:KNOWN]
        ratios.append(np.asarray(surprise(*(jnp.asarray(v, jnp.float32) for v in (P, after, moved)))))
    np.testing.assert_allclose(np.mean(ratios, axis=0) * factor, 1.0, atol=0.2)


def test_what_is_not_seen_counts_as_told() -> None:
    params, state = BodyParams(), some_state(4)
    unseen = jnp.zeros((10,)).at[8].set(1.0)  # left hand: its fingers are in no other part
    state = eqx.tree_at(lambda s: (s.unseen, s.scatter), state, (unseen, jnp.full((11,), 0.5)))
    ratio = jnp.full((11,), 0.1).at[0].set(1e6)
    after = np.asarray(averaged_scatter(params, state, ratio, 0.25 * params.scatter_time))
    expected = np.full(11, 0.4)
    expected[0], expected[9] = 0.375 + 0.25 * params.scatter_limits[1], 1.0
    np.testing.assert_allclose(after, expected, rtol=1e-5)
