"""One step of tuning: value and gradient over a minibatch of worlds for several starts side by side, and an optimiser's update.

Pure and without jit; `terms` is the one thing that knows of episodes, so that any function of (params, world) can take its place.
"""

from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp

from hrcjax.typing import Array, Bool, Float, Int

ParamsFn = Callable[[Float[Array, "parameter"]], Any]
"""Parameters of a vector of coordinates."""


@runtime_checkable
class Optimiser(Protocol):
    """A gradient transformation as in optax."""

    @property
    def init(self) -> Callable[[Any], Any]:
        """State of a vector."""
        ...

    @property
    def update(self) -> Callable[..., tuple[Any, Any]]:
        """(gradient, state, vector) -> what is added to the vector, and the state."""
        ...


class Values(eqx.Module):
    """Loss and gradient of every start, means over worlds, and the terms in each world."""

    loss: Float[Array, "start"]
    """Weighted sum of the terms."""
    each: Float[Array, "start world term"]
    """Terms in every world, in their units."""
    gradient: Float[Array, "start parameter"]
    """Of the loss by the coordinates."""

    @property
    def terms(self) -> Float[Array, "start term"]:
        """Means over worlds."""
        return jnp.mean(self.each, axis=1)

    @property
    def finite(self) -> Bool[Array, "start"]:
        """Whether loss and gradient are finite."""
        return jnp.isfinite(self.loss) & jnp.all(jnp.isfinite(self.gradient), axis=1)


class TuneState(eqx.Module):
    """What a tuning goes on from."""

    vector: Float[Array, "start parameter"]
    """Coordinates of every start."""
    optimiser: Any
    """State of the optimiser, of every start."""
    key: Any
    """Key of the minibatches; of a step by `jax.random.fold_in`."""
    step: Int[Array, ""]
    """Steps done."""
    skipped: Int[Array, "start"]
    """Steps in which a start went back, as its loss or gradient was not finite."""
    best_loss: Float[Array, "start"]
    """Least loss so far, of a minibatch; infinite at first."""
    best: Float[Array, "start parameter"]
    """Its coordinates."""


def initial_tuning(vectors: Float[Array, "start parameter"], optimiser: Optimiser, key: Any) -> TuneState:
    """Before the first step."""
    count = vectors.shape[0]
    with jax.numpy_dtype_promotion("standard"):  # optax counts on it
        memory = jax.vmap(optimiser.init)(vectors)
    return TuneState(
        vector=vectors,
        optimiser=memory,
        key=key,
        step=jnp.zeros((), jnp.int32),
        skipped=jnp.zeros(count, jnp.int32),
        best_loss=jnp.full(count, jnp.inf, vectors.dtype),
        best=vectors,
    )


def minibatch(key: Any, step: Int[Array, ""], count: int, size: int) -> Int[Array, "batch"]:
    """Places of the worlds of a step: `size` different ones of `count`, all in order where that many are asked for."""
    if size >= count:
        return jnp.arange(count, dtype=jnp.int32)
    return jax.random.choice(jax.random.fold_in(key, step), count, (size,), replace=False).astype(jnp.int32)


def values_and_gradients(
    terms: Callable[[Any, Any], Float[Array, "term"]],
    weights: Sequence[float],
    params_of: ParamsFn,
    vectors: Float[Array, "start parameter"],
    worlds: Any,
) -> Values:
    """Loss, terms and gradient of every start.

    Args:
        terms: every term of the loss, from parameters and one world.
        weights: of each [1/unit].
        worlds: stacked along their first axis.
    """

    def loss(vector: Float[Array, "parameter"]) -> tuple[Float[Array, ""], Float[Array, "world term"]]:
        params = params_of(vector)
        each = jax.vmap(lambda world: terms(params, world))(worlds)
        return jnp.dot(jnp.asarray(weights, each.dtype), jnp.mean(each, axis=0)), each

    (value, each), gradient = jax.vmap(jax.value_and_grad(loss, has_aux=True))(vectors)
    return Values(value, each, gradient)


def tune_step(state: TuneState, found: Values, optimiser: Optimiser) -> TuneState:
    """The state after one update of every start by its gradient. A start whose loss or gradient is not finite keeps its optimiser's
    state, goes half the way back to its best coordinates so far, and does not touch the others."""
    finite = found.finite
    with jax.numpy_dtype_promotion("standard"):
        update, after = jax.vmap(optimiser.update)(found.gradient, state.optimiser, state.vector)

    def where(new: Array, old: Array) -> Array:
        return jnp.where(finite.reshape(-1, *(1,) * (new.ndim - 1)), new, old)

    better = finite & (found.loss < state.best_loss)
    return TuneState(
        vector=where(state.vector + update, (state.vector + state.best) / 2),
        optimiser=jax.tree.map(where, after, state.optimiser),
        key=state.key,
        step=state.step + 1,
        skipped=state.skipped + (~finite).astype(jnp.int32),
        best_loss=jnp.where(better, found.loss, state.best_loss),
        best=jnp.where(better[:, None], state.vector, state.best),
    )
