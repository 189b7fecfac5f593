"""Joints between two frames: constant velocity, with a covariance that grows by accelerations nobody knows."""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.body.least_squares import inverse_spd
from hrcjax.body.params import BodyParams
from hrcjax.body.state import KNOWN, PLACES, SHAPE, BodyState
from hrcjax.typing import Array, Float, Scalar

_KINDS = (0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6)
"""Entry of `BodyParams.acceleration` of every joint."""


def predict(params: BodyParams, state: BodyState, dt: Scalar) -> BodyState:
    """The state a time later: every joint goes on, and slows down within `params.forget`.

    Args:
        dt: time [s].
    """
    dtype = state.joints.dtype
    keep = jnp.exp(-jnp.asarray(dt, dtype) / params.forget)
    P = state.covariance
    P = P.at[:PLACES].add(dt * P[KNOWN:])
    P = P.at[:, :PLACES].add(dt * P[:, KNOWN:])
    P = P.at[KNOWN:].multiply(keep).at[:, KNOWN:].multiply(keep)
    a = jnp.repeat(jnp.asarray(params.acceleration, dtype)[jnp.asarray(_KINDS)], 3)
    x, v = jnp.arange(PLACES), KNOWN + jnp.arange(PLACES)
    P = P.at[x, x].add((0.5 * a * dt * dt) ** 2 + params.settle**2).at[v, v].add((a * dt) ** 2)
    P = P.at[x, v].add(0.5 * a * a * dt**3).at[v, x].add(0.5 * a * a * dt**3)
    s = PLACES + jnp.arange(SHAPE)
    P = P.at[s, s].add(params.length_drift**2 * dt)
    return eqx.tree_at(
        lambda b: (b.joints, b.speeds, b.covariance), state, (state.joints + dt * state.speeds, keep * state.speeds, P)
    )


def corrected(
    state: BodyState,
    known: Float[Array, "known"],
    before: Float[Array, "known known"],
    information: Float[Array, "known known"],
) -> tuple[Float[Array, "joint 3"], Float[Array, "all all"]]:
    """Speeds and covariance after a fit has moved what is measured: Kalman's correction, whose gain speeds get by their correlation.

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
    return speeds.reshape(state.speeds.shape), 0.5 * (whole + whole.T)
