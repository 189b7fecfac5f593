"""Joints between two frames: constant velocity, with a covariance that grows by accelerations nobody knows."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.body.least_squares import inverse_spd
from hrcjax.body.params import BodyParams
from hrcjax.body.skeleton import ENDS
from hrcjax.body.state import KNOWN, PLACES, SHAPE, BodyState
from hrcjax.typing import Array, Bool, Float, Scalar

_KINDS = (0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6)
"""Entry of `BodyParams.acceleration` of every joint."""


LEAST_CORRECTION = 3e-4
"""Standard deviation of a correction with which others are compared at least [m]."""


def hidden(params: BodyParams, state: BodyState) -> Bool[Array, "joint"]:
    """Joints of which no part is seen."""
    since = jnp.min(jnp.where(jnp.asarray(ENDS), state.unseen[:, None], jnp.inf), axis=0)
    return since > params.sure_unseen


def predict(params: BodyParams, state: BodyState, dt: Scalar) -> BodyState:
    """The state a time later: every joint goes on; one that is not seen slows down within `params.forget`.

    Args:
        dt: time [s].
    """
    dtype = state.joints.dtype
    keep = jnp.where(hidden(params, state), jnp.exp(-jnp.asarray(dt, dtype) / params.forget), 1.0)
    every = jnp.repeat(keep, 3)
    a = jnp.repeat(jnp.asarray(params.acceleration, dtype)[jnp.asarray(_KINDS)], 3)
    places, speeds = jnp.diag((0.5 * a * dt * dt) ** 2 + params.settle**2), jnp.diag((a * dt) ** 2)
    both, shape = jnp.diag(0.5 * a * a * dt**3), params.length_drift**2 * dt * jnp.eye(SHAPE, dtype=dtype)
    none = jnp.zeros((PLACES, SHAPE), dtype)
    noise = jnp.block([[places, none, both], [none.T, shape, none.T], [both, none, speeds]])

    def moved(P: Array) -> Array:  # its rows; concatenated, as scattered sums are slow
        return jnp.concatenate([P[:PLACES] + dt * P[KNOWN:], P[PLACES:KNOWN], every[:, None] * P[KNOWN:]])

    P = moved(moved(state.covariance).T).T + noise
    return eqx.tree_at(
        lambda b: (b.joints, b.speeds, b.covariance),
        state,
        (state.joints + dt * state.speeds, keep[:, None] * state.speeds, P),
    )


def surprise(
    P: Float[Array, "all all"], after: Float[Array, "all all"], moved: Float[Array, "known"]
) -> Float[Array, "joint"]:
    """Squared correction of every joint's place over its variance [1].

    A filter whose noises are right corrects with a covariance of P - P+, so that this is 1 on average (innovations, Kailath 1968). Where
    process and measurement are told too noisy by one factor, the gains are right and this is one over the factor: the variance of unit
    weight of adjustment theory.

    Args:
        P: covariance as predicted.
        after: P+, the same after the fit.
        moved: how far the fit has moved places, lengths and radii.
    """
    square = jnp.sum(moved[:PLACES].reshape(-1, 3) ** 2, axis=1)
    lost = jnp.maximum(jnp.diagonal(P)[:PLACES] - jnp.diagonal(after)[:PLACES], 0.0)
    return square / jnp.maximum(jnp.sum(lost.reshape(-1, 3), axis=1), LEAST_CORRECTION**2)


def averaged_scatter(
    params: BodyParams, state: BodyState, ratio: Float[Array, "joint"], dt: Scalar
) -> Float[Array, "joint"]:
    """The average of `surprise` over the last frames; 1, as told, for joints that are not seen.

    Args:
        state: before the frame.
        ratio: of the frame.
        dt: time since the last frame; 0: there was none [s].
    """
    gain = jnp.minimum(dt / params.scatter_time, 1.0)
    mean = state.scatter + gain * (jnp.minimum(ratio, params.scatter_limits[1]) - state.scatter)
    return jnp.where(hidden(params, state), 1.0, mean)


def corrected(
    state: BodyState,
    known: Float[Array, "known"],
    before: Float[Array, "known known"],
    information: Float[Array, "known known"],
) -> tuple[Float[Array, "joint 3"], Float[Array, "all all"], Float[Array, "joint"]]:
    """Speeds and covariance after a fit has moved what is measured, and `surprise`.

    Kalman's correction, whose gain speeds get by their correlation.

    Args:
        state: as predicted.
        known: the fit's places, lengths and radii.
        before: inverse of their covariance as predicted.
        information: the fit's normal matrix.
    """
    P = state.covariance
    moved = known - jnp.concatenate([state.joints.reshape(-1), state.lengths, state.radii])
    Pyy, Pyv, Pvv = P[:KNOWN, :KNOWN], P[:KNOWN, KNOWN:], P[KNOWN:, KNOWN:]
    gain = Pyv.T @ before  # (speed known)
    after = inverse_spd(information)
    speeds = state.speeds.reshape(-1) + gain @ moved
    Pvy = gain @ after
    Pvv = Pvv - gain @ (Pyy - after) @ gain.T
    whole = jnp.block([[after, Pvy.T], [Pvy, Pvv]])
    whole = 0.5 * (whole + whole.T)
    return speeds.reshape(state.speeds.shape), whole, surprise(P, whole, moved)
