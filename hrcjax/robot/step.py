"""One step of the arm's dynamics, by the folded chain or by MJX, and the jit that each needs."""

# pyright: reportAttributeAccessIssue=false
# mujoco's types are compiled and have no stubs

import copy
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, wraps
from typing import Any, ParamSpec, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jax.core import Tracer

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
    slower; for "mjx" they are switched off for f alone. JAX takes compiler options for the outermost jit only, and
    raises at any other. So within another transformation (a caller's own jit, grad or vmap) f is traced as part of
    that, with the options of the outermost jit: right, but slow unless that too is made by this function, as in
    `jit_for("mjx", jax.grad(f))`.

    Raises:
        ValueError: no such backend.
    """
    _check_backend(backend)
    if backend == "folded" or jax.default_backend() != "cpu":
        return jax.jit(f, **options)
    compiled = jax.jit(f, compiler_options={"xla_cpu_use_fusion_emitters": False}, **options)

    @wraps(f)
    def outermost(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        inner = any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves((args, kwargs)))
        return f(*args, **kwargs) if inner else compiled(*args, **kwargs)

    return outermost


def limit_torque(arm: Arm, tau: Joints) -> tuple[Joints, Bool[Array, "joint"]]:
    """Torques within the motors' limits [N m], and which of them had to be cut."""
    top = jnp.asarray(arm.tau_max, tau.dtype)
    return jnp.clip(tau, -top, top), jnp.abs(tau) > top


def step(arm: Arm, state: ArmState, tau: Joints, dt: float, backend: str = "folded") -> ArmState:
    """The state one step later: semi-implicit Euler as MuJoCo has it, qd += dt qdd, then q += dt qd.

    Torques are not limited here; `limit_torque` clips them to the motors' limits and tells which.

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
        # Torques alone act, as in the folded chain: no actuators, contacts or limits of the file.
        smooth = copy.deepcopy(arm.model)
        flags = mujoco.mjtDisableBit
        smooth.opt.disableflags |= int(flags.mjDSBL_ACTUATION | flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT)
        model = mjx.put_model(smooth)
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
