"""The joint servo: torques that track a commanded acceleration within the motors' limits."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.robot import ArmState, inverse_dynamics, step
from hrcjax.sim.cell import Cell
from hrcjax.typing import Array, Bool, Joints, Scalar

_Result = tuple[ArmState, Joints, Bool[Array, ""], Bool[Array, ""]]


def servo(gain: Scalar, cell: Cell, state: ArmState, qdd: Joints) -> _Result:
    """The arm one control period later, under computed torque with velocity feedback at every substep.

    tau = ID(q, qd, qdd_cmd + gain (qd_ref - qd)), clipped to the motors' limits; qd_ref grows from the measured speed by
    qdd_cmd. A torque that is not finite is replaced by gravity compensation, or by 0 where the arm's position is
    not finite: its brakes must engage.

    Returns:
        the state, the torque at the start [N m], whether a torque was clipped, whether one was not finite.
    """
    if cell.linear_servo and cell.backend == "folded" and not np.any(cell.arm.chain.damping):
        return _linear(gain, cell, state, qdd)
    return _tracked(gain, cell, state, qdd)


def _linear(gain: Scalar, cell: Cell, state: ArmState, qdd: Joints) -> _Result:
    """`_tracked` with the derivatives that it has while no torque is clipped: each substep then reaches the acceleration
    commanded, q' = q + n h qd + n (n + 1) / 2 h^2 qdd and qd' = qd + n h qdd after n substeps of h, whatever the gain."""
    n, h, chain = cell.substeps, cell.dt / cell.substeps, cell.arm.chain

    @jax.custom_jvp
    def tracked(q: Joints, qd: Joints, qdd: Joints, gain: Scalar) -> _Result:
        return _tracked(gain, cell, ArmState(q, qd), qdd)

    def slope(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[_Result, Any]:
        (q, qd, qdd, gain), (d_q, d_qd, d_qdd, _) = primals, tangents
        out = tracked(q, qd, qdd, gain)
        _, d_tau = jax.jvp(lambda *motion: inverse_dynamics(chain, *motion), (q, qd, qdd), (d_q, d_qd, d_qdd))
        after = ArmState(d_q + n * h * d_qd + n * (n + 1) / 2 * h**2 * d_qdd, d_qd + n * h * d_qdd)
        none = np.zeros((), jax.dtypes.float0)
        return out, (after, d_tau, none, none)

    tracked.defjvp(slope)
    return tracked(state.q, state.qd, qdd, jnp.asarray(gain, qdd.dtype))


def _tracked(gain: Scalar, cell: Cell, state: ArmState, qdd: Joints) -> _Result:
    """See `servo`."""
    h = cell.dt / cell.substeps
    chain = cell.arm.chain
    top = jnp.asarray(cell.arm.tau_max, qdd.dtype)
    start = state.qd

    def substep(carry: tuple[ArmState, Array, Array], k: Array) -> tuple[tuple[ArmState, Array, Array], Joints]:
        arm, clipped, bad = carry
        wanted = qdd + gain * (start + qdd * (k * h) - arm.qd)
        tau = inverse_dynamics(chain, arm.q, arm.qd, wanted)
        broken = ~jnp.all(jnp.isfinite(tau))
        rest = jnp.zeros_like(qdd)
        weight = jax.lax.stop_gradient(inverse_dynamics(chain, arm.q, rest, rest))
        tau = jnp.where(broken, jnp.where(jnp.isfinite(weight), weight, 0.0), tau)
        clipped = clipped | jnp.any(jnp.abs(tau) > top)
        tau = jnp.clip(tau, -top, top)
        return (step(cell.arm, arm, tau, h, cell.backend), clipped, bad | broken), tau

    no = jnp.asarray(False)
    steps = jnp.arange(cell.substeps).astype(qdd.dtype)
    (arm, clipped, bad), tau = jax.lax.scan(jax.checkpoint(substep), (state, no, no), steps)
    return arm, tau[0], clipped, bad
