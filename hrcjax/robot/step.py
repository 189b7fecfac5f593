"""One step of the arm's dynamics, by the folded chain or by MJX, and the jit that each needs."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any, ParamSpec, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.robot.body import Arm
from hrcjax.robot.dynamics import forward_dynamics
from hrcjax.typing import Array, Bool, Float, Joints

BACKENDS = ("folded", "mjx")
_P = ParamSpec("_P")
_R = TypeVar("_R")


class ArmState(eqx.Module):
    """Where the arm is and how it moves."""

    q: Float[Array, "*batch joint"]
    """Joint positions [rad]."""
    qd: Float[Array, "*batch joint"]
    """Joint speeds [rad/s]."""


def _check_backend(backend: str) -> None:
    if backend not in BACKENDS:
        raise ValueError(f"backend {backend!r} is not known; accepted: {', '.join(BACKENDS)}")


def jit_for(backend: str, f: Callable[_P, _R], **options: Any) -> Callable[_P, _R]:
    """`jax.jit(f, **options)`, with the compiler option that `backend` needs on a CPU.

    XLA's fusion emitters compute the deep expressions of `mjx.step` over and over, which makes it some 100 times
    slower; for "mjx" they are switched off for f alone. Compiler options hold for the outermost jit: where a caller
    wraps the result in a jit of his own, that jit's options count for all, and he has to make it by this function.
    A result inside another jit is not wrong, only slow.

    Raises:
        ValueError: no such backend.
    """
    _check_backend(backend)
    if backend == "mjx" and jax.default_backend() == "cpu":
        options = {"compiler_options": {"xla_cpu_use_fusion_emitters": False}, **options}
    return jax.jit(f, **options)


def limit_torque(arm: Arm, tau: Joints) -> tuple[Joints, Bool[Array, "joint"]]:
    """Torques within the motors' limits [N m], and which of them had to be cut."""
    top = jnp.asarray(arm.tau_max, tau.dtype)
    return jnp.clip(tau, -top, top), jnp.abs(tau) > top


def step(arm: Arm, state: ArmState, tau: Joints, dt: float, backend: str = "folded") -> ArmState:
    """The state one step later: semi-implicit Euler as MuJoCo has it, qd += dt qdd, then q += dt qd.

    Torques are taken as they are; `limit_torque` cuts them to what the motors give, and says so.

    Args:
        tau: torques about the joints, held over the step [N m].
        dt: length of the step [s].
        backend: "folded", the chain written out as scalars; or "mjx", MuJoCo's own step in JAX: jit it by `jit_for`.

    Raises:
        ValueError: no such backend, or wrong shapes.
    """
    _check_backend(backend)
    if backend == "mjx":
        return _mjx_step(arm, state, tau, dt)
    chain = arm.chain
    if np.any(chain.damping):  # MuJoCo takes damping implicitly: M + dt D in place of M
        chain = replace(chain, armature=chain.armature + dt * chain.damping)
    qd = state.qd + dt * forward_dynamics(chain, state.q, state.qd, tau)
    return ArmState(state.q + dt * qd, qd)


@lru_cache(maxsize=16)
def _mjx_model(arm: Arm, dtype: str) -> Any:
    from mujoco import mjx  # slow to import, and only this backend needs it

    with jax.ensure_compile_time_eval(), jax.numpy_dtype_promotion("standard"):
        model = mjx.put_model(arm.model)
        return jax.tree.map(lambda x: _cast(x, dtype), (model, mjx.make_data(model)))


def _cast(x: Any, dtype: str) -> Any:
    return jnp.asarray(x, dtype) if isinstance(x, jax.Array) and jnp.issubdtype(x.dtype, jnp.floating) else x


def _mjx_step(arm: Arm, state: ArmState, tau: Joints, dt: float) -> ArmState:
    from mujoco import mjx

    dtype = state.q.dtype
    model, data = _mjx_model(arm, dtype.name)
    with jax.numpy_dtype_promotion("standard"):  # mjx does not pass the strict rule
        model = model.tree_replace({"opt.timestep": jnp.asarray(dt, dtype)})
        after = mjx.step(model, data.replace(qpos=state.q, qvel=state.qd, qfrc_applied=tau))
    return ArmState(_cast(after.qpos, dtype.name), _cast(after.qvel, dtype.name))
