"""Prediction and correction against the textbook's Kalman filter in NumPy."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from hrcjax.body.least_squares import joined
from hrcjax.body.motion import corrected, predict
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
    speeds, covariance = corrected(
        state, jnp.asarray(known, jnp.float32), jnp.asarray(information, jnp.float32), jnp.asarray(after, jnp.float32)
    )
    np.testing.assert_allclose(speeds.reshape(-1), np.asarray(state.speeds).reshape(-1) + step[KNOWN:], atol=2e-3)
    np.testing.assert_allclose(covariance, expected, atol=2e-3)
