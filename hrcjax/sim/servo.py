"""The joint servo: torques that track a commanded acceleration within the motors' limits."""

import jax
import jax.numpy as jnp

from hrcjax.robot import ArmState, inverse_dynamics, step
from hrcjax.sim.cell import Cell
from hrcjax.typing import Array, Bool, Joints, Scalar


def servo(
    gain: Scalar, cell: Cell, state: ArmState, qdd: Joints
) -> tuple[ArmState, Joints, Bool[Array, ""], Bool[Array, ""]]:
    """The arm one control period later, under computed torque with velocity feedback at every substep.

    tau = ID(q, qd, qdd_cmd + gain (qd_ref - qd)), clipped to the motors' limits; qd_ref grows from the measured speed by
    qdd_cmd. A torque that is not finite is replaced by gravity compensation, or by 0 where the arm's position is
    not finite: its brakes must engage.

    Returns:
        the state, the torque at the start [N m], whether a torque was clipped, whether one was not finite.
    """
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
